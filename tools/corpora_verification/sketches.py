"""Filling in what sketches leave unsaid, so that they can be checked for all that it may be.

Most models that people draw say nothing of when a timer comes or what a condition is: the reader
refuses them, since they cannot be executed. What is missing is filled in here with something that
the check takes for unknown. A flow that is drawn from or to nothing joins nothing, and goes. A task
of which nothing is said but its name does nothing in a mission; in a sketch it is work that takes
time. A loop that does not say when it ends may end after any round.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress

from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.bpmn.xml import BPMN, M2PEM
from m2pem.errors import MissionError
from m2pem.findings import Finding, Severity
from m2pem.mission.mission import Mission

_MOST_ROUNDS = 4
"""Filling one thing in can show that another is missing."""
UNREACHABLE = "unreachable"
"""The rule of what no start event reaches: it says itself that it is dead."""
_UNKNOWN = "unsaid.condition_{}"
WORK = "work"
"""The service that tasks are taken for."""
_PLAIN = ("task", "manualTask", "businessRuleTask", "serviceTask")
_PARSER = etree.XMLParser(resolve_entities=False, no_network=True)
_TIMES = ("timeDate", "timeDuration", "timeCycle")

Fill = Callable[[etree._Element, str], bool]


def read_sketch(data: bytes, file: str) -> tuple[Mission, tuple[str, ...]]:
    """The mission, and the rules of what had to be filled in.

    Raises:
        MissionError: there is more wrong than that something is left unsaid.
    """
    filled: dict[str, None] = {}
    with suppress(etree.XMLSyntaxError):  # which the reader says
        data = _at_work(data)
    for _ in range(_MOST_ROUNDS):
        try:
            return parse_mission(data, file), tuple(filled)
        except MissionError as error:
            made = _filled_in(data, error.findings)
            if made is None:
                raise
            data, rules = made
            filled.update(dict.fromkeys(rules))
    return parse_mission(data, file), tuple(filled)


def _filled_in(data: bytes, findings: Sequence[Finding]) -> tuple[bytes, list[str]] | None:
    """The file with what findings miss, and which rules those were of; None: it cannot be."""
    wrong = [each for each in findings if each.severity is Severity.ERROR]
    wanted = [each for each in wrong if each.rule != UNREACHABLE]
    if any(each.rule not in _FILLS for each in wanted):
        return None
    root = etree.fromstring(data, _PARSER)
    by_id = {name: each for each in root.iter(etree.Element) if (name := each.get("id"))}
    once = dict.fromkeys((each.rule, each.element) for each in wanted)
    for rule, identifier in once:
        element = by_id.get(identifier)
        if element is None or not _FILLS[rule](element, identifier):
            return None
    return etree.tostring(root), [rule for rule, _ in once]


def _at_work(data: bytes) -> bytes:
    """Plain tasks as services, which take time; and loops that may end."""
    root = etree.fromstring(data, _PARSER)
    for element in root.iter(*(f"{BPMN}{name}" for name in _PLAIN)):
        if _says_nothing(element):
            element.tag = f"{BPMN}serviceTask"
            element.set(f"{M2PEM}class", WORK)
    for element in root.iter(f"{BPMN}standardLoopCharacteristics"):
        if not element.get("loopMaximum") and not _children(element, "loopCondition"):
            _put(element, "loopCondition", _UNKNOWN.format("again"))
    return etree.tostring(root)


def _says_nothing(task: etree._Element) -> bool:
    """Whether nothing but its name says what it does."""
    said = [key for key in task.attrib if key == "implementation" or str(key).startswith("{")]
    return not said and not any(str(each.tag).startswith(M2PEM) for each in task.iter())


def _children(element: etree._Element, *names: str) -> list[etree._Element]:
    return [c for c in element.iter(etree.Element) if etree.QName(c).localname in names]


def _put(parent: etree._Element, name: str, text: str) -> None:
    made = etree.SubElement(parent, f"{{{etree.QName(parent).namespace}}}{name}")
    made.text = text


def _time(element: etree._Element, _: str) -> bool:
    """Timers come in any order: which time it is makes no difference."""
    timers = _children(element, "timerEventDefinition")
    for timer in timers:
        for child in _children(timer, *_TIMES):
            timer.remove(child)
        _put(timer, "timeDuration", "PT1H")
    return bool(timers)


def _condition(element: etree._Element, identifier: str) -> bool:
    """Nothing writes the name: it may become true at any time."""
    found = _children(element, "conditionalEventDefinition")
    for number, each in enumerate(found):
        for child in _children(each, "condition"):
            each.remove(child)
        _put(each, "condition", _unknown(f"{identifier}{number}"))
    return bool(found)


def _expression(element: etree._Element, identifier: str) -> bool:
    """A condition in prose is one that nobody knows."""
    found = [
        each
        for each in element
        if etree.QName(each).localname == "conditionExpression" and (each.text or "").strip()
    ]
    for each in found:
        each.attrib.clear()
        each.text = _unknown(identifier)
    return bool(found)


def _count(element: etree._Element, _: str) -> bool:
    found = _children(element, "multiInstanceLoopCharacteristics")[:1]
    for each in found:
        for child in _children(each, "loopCardinality"):
            each.remove(child)
        _put(each, "loopCardinality", "unsaid.count")
    return bool(found)


def _dangling(element: etree._Element, _: str) -> bool:
    """Of references that lead nowhere, those of flows only."""
    if etree.QName(element).localname != "sequenceFlow":
        return False
    if element.get("sourceRef") and element.get("targetRef"):
        return False
    parent = element.getparent()
    assert parent is not None
    parent.remove(element)
    for each in _children(parent, "incoming", "outgoing"):
        if (each.text or "").strip().rpartition(":")[2] == element.get("id"):
            around = each.getparent()
            assert around is not None
            around.remove(each)
    for each in parent.iter(etree.Element):
        if each.get("default") == element.get("id"):
            del each.attrib["default"]
    return True


def _unknown(identifier: str) -> str:
    return _UNKNOWN.format("".join(c if c.isalnum() else "_" for c in identifier))


_FILLS: dict[str, Fill] = {
    "timer-time": _time,
    "no-condition": _condition,
    "bad-expression": _expression,
    "instance-count": _count,
    "dangling-reference": _dangling,
}
