"""New versions of a mission: its XML with elements removed, inserted or with other content."""

from collections.abc import Sequence
from random import Random

from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.errors import MissionError
from m2pem.mission.mission import Mission

_BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
_TIMES = ("timeDuration", "timeCycle", "timeDate")
_TASKS = ("task", "userTask", "manualTask")
_NODES = (
    *(f"{_BPMN}{each}" for each in _TASKS),
    *(
        f"{_BPMN}{each}"
        for each in (
            "scriptTask",
            "serviceTask",
            "sendTask",
            "receiveTask",
            "subProcess",
            "callActivity",
            "boundaryEvent",
            "intermediateCatchEvent",
            "intermediateThrowEvent",
            "exclusiveGateway",
            "parallelGateway",
            "inclusiveGateway",
            "endEvent",
        )
    ),
)


def changed(source: bytes, dice: Random) -> Mission | None:
    """A mission like that of `source`; None: what came of it is wrong."""
    root = etree.fromstring(source)
    for number in range(dice.randint(1, 4)):
        dice.choice(_CHANGES)(root, dice, number)
    try:
        return parse_mission(etree.tostring(root), "new.bpmn")
    except MissionError:
        return None


def _pick(found: Sequence[etree._Element], dice: Random) -> etree._Element | None:
    return dice.choice(found) if found else None


def _insert(root: etree._Element, dice: Random, number: int) -> None:
    """Insert a task in a sequence flow."""
    flow = _pick(root.findall(f".//{_BPMN}sequenceFlow"), dice)
    if flow is None:
        return
    container = flow.getparent()
    assert container is not None
    name = f"new{number}_{dice.randrange(1000)}"
    etree.SubElement(container, f"{_BPMN}{dice.choice(_TASKS)}", id=name)
    target = flow.get("targetRef") or ""
    flow.set("targetRef", name)
    etree.SubElement(
        container, f"{_BPMN}sequenceFlow", id=f"to_{name}", sourceRef=name, targetRef=target
    )


def _bypass(root: etree._Element, dice: Random, number: int) -> None:
    """Remove a node; the flows that led to it lead to what came after it."""
    node = _pick([each for each in root.iter() if each.tag in _NODES], dice)
    if node is None:
        return
    name = node.get("id") or ""
    container = node.getparent()
    assert container is not None
    leaving = [each for each in container if each.get("sourceRef") == name]
    arriving = [each for each in container if each.get("targetRef") == name]
    container.remove(node)
    target = leaving[0].get("targetRef") if leaving else None
    for each in leaving:
        container.remove(each)
    arriving = [each for each in arriving if each not in leaving]
    for each in arriving:
        if target is None or target == name:
            container.remove(each)
        elif each.getparent() is not None:
            each.set("targetRef", target)
    for each in [each for each in root.iter() if each.get("attachedToRef") == name]:
        parent = each.getparent()
        assert parent is not None
        parent.remove(each)


def _cut(root: etree._Element, dice: Random, number: int) -> None:
    """Remove a sequence flow."""
    flow = _pick(root.findall(f".//{_BPMN}sequenceFlow"), dice)
    if flow is not None and flow.getparent() is not None:
        parent = flow.getparent()
        assert parent is not None
        parent.remove(flow)


def _time(root: etree._Element, dice: Random, number: int) -> None:
    """Change when a timer is due."""
    found = [each for name in _TIMES for each in root.iter(f"{_BPMN}{name}")]
    timer = _pick(found, dice)
    if timer is not None and timer.tag == f"{_BPMN}timeDuration":
        timer.text = f"PT{dice.randint(1, 9)}S"


def _ref(root: etree._Element, dice: Random, number: int) -> None:
    """Have an event wait for, or throw, something else."""
    for name in ("signalRef", "messageRef"):
        found = [each for each in root.iter() if each.get(name)]
        one, other = _pick(found, dice), _pick(found, dice)
        if one is not None and other is not None:
            one.set(name, other.get(name) or "")


def _kind(root: etree._Element, dice: Random, number: int) -> None:
    """Make a task one of another kind."""
    found = [each for name in _TASKS for each in root.iter(f"{_BPMN}{name}")]
    task = _pick(found, dice)
    if task is not None:
        task.tag = f"{_BPMN}{dice.choice(_TASKS)}"


def _text(root: etree._Element, dice: Random, number: int) -> None:
    """Change a parameter, an attribute of a behavior, or how often something is done."""
    found = [each for each in root.iter() if each.get("value") is not None]
    one = _pick(found, dice)
    if one is not None:
        one.set("value", f"{dice.randint(1, 9)}")
    several = _pick(list(root.iter(f"{_BPMN}loopCardinality")), dice)
    if several is not None and dice.random() < 0.5:
        several.text = f"{dice.randint(0, 4)}"


_CHANGES = (_insert, _bypass, _bypass, _cut, _time, _ref, _kind, _text)
