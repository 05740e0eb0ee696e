"""Lays compensation over a random mission: what compensates, what throws, transactions."""

from random import Random

from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission
from tests.engine.notation import xml

_B = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
_UNDONE = ("task", "userTask", "scriptTask", "serviceTask", "subProcess", "callActivity")
_UNDO = ("task", "userTask", "userTask", "scriptTask", "subProcess")
_THROWS = ({}, {}, {"waitForCompletion": "false"}, {"activityRef": ""})


def with_compensation(text: str, dice: Random) -> tuple[Mission, str]:
    """The mission that the notation says, with compensation; and its XML."""
    root = etree.fromstring(xml(text))
    if dice.randrange(4):
        _calm(root)
    for element in list(root.iter()):
        plain = element.tag == f"{_B}subProcess" and element.get("triggeredByEvent") is None
        if plain and dice.randrange(2):
            element.tag = f"{_B}transaction"
            _catch_cancel(element)
    for element in list(root.iter(*(_B + name for name in (*_UNDONE, "transaction")))):
        if element.get("triggeredByEvent") is None and dice.randrange(100) < 40:
            _undo(element, dice)
    for element in list(root.iter(f"{_B}intermediateThrowEvent", f"{_B}endEvent")):
        if not _is_link(element) and dice.randrange(100) < 70:
            _throw(element, dice)
    for element in list(root.iter(f"{_B}subProcess", f"{_B}transaction")):
        if dice.randrange(100) < 20:
            _event_subprocess(element, dice)
    for element in list(root.iter(*(_B + name for name in (*_UNDONE, "transaction")))):
        if element.get("triggeredByEvent") is None and dice.randrange(100) < 20:
            _repeat(element, dice)
    whole = etree.tostring(root, encoding="unicode", pretty_print=True)
    return parse_mission(whole.encode(), "test.bpmn"), whole


def _calm(root: etree._Element) -> None:
    """Without errors, divisions and other ends before the end, so that there is more to undo."""
    for script in root.iter(f"{_B}script"):
        if "throw" in (script.text or ""):
            script.text = "a = a + 1"
    for condition in root.iter(f"{_B}condition", f"{_B}conditionExpression"):
        if "/" in (condition.text or ""):
            condition.text = "a > b"
    for name in ("error", "terminate"):
        for definition in list(root.iter(f"{_B}{name}EventDefinition")):
            event = definition.getparent()
            assert event is not None
            if event.tag == f"{_B}endEvent":
                event.remove(definition)


def _is_link(event: etree._Element) -> bool:
    return event.find(f"{_B}linkEventDefinition") is not None


def _add(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, _B + tag, attributes)


def _undo(activity: etree._Element, dice: Random) -> None:
    around, name = activity.getparent(), activity.get("id")
    assert around is not None
    assert name is not None
    event = _add(around, "boundaryEvent", id=f"{name}c", attachedToRef=name)
    _add(event, "compensateEventDefinition")
    tag = dice.choice(_UNDO)
    handler = _add(around, tag, id=f"{name}u", isForCompensation="true")
    if tag == "scriptTask":
        _add(handler, "script").text = dice.choice(("a = a + 1", "throw error E1", "b = 0"))
    elif tag == "subProcess":
        _line(handler, f"{name}u", None, dice)
    _add(around, "association", id=f"{name}a", sourceRef=f"{name}c", targetRef=f"{name}u")


def _line(inside: etree._Element, name: str, trigger: str | None, dice: Random) -> None:
    """A start event, a task that can be undone, and an end event that may throw."""
    start = _add(inside, "startEvent", id=f"{name}s")
    if trigger is not None:
        _add(start, trigger)
    task = _add(inside, dice.choice(("task", "userTask")), id=f"{name}t")
    end = _add(inside, "endEvent", id=f"{name}e")
    for number, (source, target) in enumerate(((start, task), (task, end))):
        ends = {"sourceRef": f"{source.get('id')}", "targetRef": f"{target.get('id')}"}
        _add(inside, "sequenceFlow", id=f"{name}f{number}", **ends)
    if dice.randrange(2):
        _add(end, "compensateEventDefinition")


def _repeat(activity: etree._Element, dice: Random) -> None:
    if any(child.tag.endswith("LoopCharacteristics") for child in activity):
        return
    sequential = dice.choice(("true", "false"))
    loop = etree.Element(f"{_B}multiInstanceLoopCharacteristics", isSequential=sequential)
    _add(loop, "loopCardinality").text = str(dice.randrange(3))
    activity.insert(0, loop)


def _event_subprocess(around: etree._Element, dice: Random) -> None:
    name = f"{around.get('id')}h"
    inside = _add(around, "subProcess", id=name, triggeredByEvent="true")
    _line(inside, name, "compensateEventDefinition", dice)


def _throw(event: etree._Element, dice: Random) -> None:
    for definition in event:
        if definition.tag.endswith("EventDefinition"):
            event.remove(definition)
    around = event.getparent()
    assert around is not None
    is_end = event.tag == f"{_B}endEvent"
    if is_end and around.tag == f"{_B}transaction" and dice.randrange(3):
        _add(event, "cancelEventDefinition")
        return
    attributes = dict(dice.choice(_THROWS))
    if "activityRef" in attributes:
        beside = [e.get("id") for e in around if e.tag in {_B + name for name in _UNDONE}]
        if not beside:
            return
        attributes["activityRef"] = str(dice.choice(beside))
    _add(event, "compensateEventDefinition", **attributes)


def _catch_cancel(transaction: etree._Element) -> None:
    """A cancel boundary event; its flow merges with that out of the transaction."""
    around, name = transaction.getparent(), f"{transaction.get('id')}"
    assert around is not None
    flows = [e for e in around if e.tag == f"{_B}sequenceFlow" and e.get("sourceRef") == name]
    event = _add(around, "boundaryEvent", id=f"{name}x", attachedToRef=name)
    _add(event, "cancelEventDefinition")
    _add(around, "exclusiveGateway", id=f"{name}m")
    for flow in flows[1:]:
        around.remove(flow)
    for flow in flows[:1]:
        flow.set("sourceRef", f"{name}m")
        for condition in flow:
            flow.remove(condition)
    for source in (name, f"{name}x"):
        _add(around, "sequenceFlow", id=f"{source}f", sourceRef=source, targetRef=f"{name}m")
