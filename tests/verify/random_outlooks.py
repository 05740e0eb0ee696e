"""Random missions of all kinds, for outlooks: those of other tests, with what they lack laid over.

Outputs of instances that are collected, event-based gateways, messages that are kept from the
begin on, correlation keys, and processes that messages start.
"""

from random import Random

from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission
from tests.engine.notation import xml
from tests.engine.random_compensation import with_compensation
from tests.engine.random_missions import graph, structured
from tests.verify.random_counting import counting

_B = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
_OWN = "{https://m2pem.org/schema/1}"
_EVENTS = ("signalRef s1", "signalRef s2", "messageRef m1", "messageRef m2")


def for_outlook(dice: Random) -> Mission:
    """A random mission. Raises MissionError: it came out wrong."""
    kind = dice.choice(("structured", "structured", "graph", "undone", "counting"))
    if kind == "counting":
        root = etree.fromstring(counting(dice).source)
    elif kind == "undone":
        root = etree.fromstring(with_compensation(structured(dice), dice)[1])
    else:
        root = etree.fromstring(xml(graph(dice) if kind == "graph" else structured(dice)))
    if dice.random() < 0.9:
        _without_services(root)
    for lay in (_collected, _keyed):
        if dice.random() < 0.4:
            lay(root, dice)
    if kind != "counting":
        for lay in (_alternatives, _kept):
            if dice.random() < 0.5:
                lay(root, dice)
    return parse_mission(etree.tostring(root), "test.bpmn")


def _add(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, _B + tag, attributes)


def _flow(container: etree._Element, source: str, target: str) -> None:
    _add(container, "sequenceFlow", id=f"{source}_{target}", sourceRef=source, targetRef=target)


def _declared(root: etree._Element, ref: str) -> bool:
    return any(each.get("id") == ref for each in root)


def _without_services(root: etree._Element) -> None:
    """Tasks in place of service tasks, of which an outlook does not know what they write."""
    for service in list(root.iter(f"{_B}serviceTask")):
        service.tag = f"{_B}task"
        for child in list(service):
            if not child.tag.endswith("LoopCharacteristics"):
                service.remove(child)


def _collected(root: etree._Element, dice: Random) -> None:
    """Instances whose outputs are collected."""
    for number, loop in enumerate(root.iter(f"{_B}multiInstanceLoopCharacteristics")):
        activity = loop.getparent()
        assert activity is not None
        container = activity.getparent()
        assert container is not None
        if loop.find(f"{_B}loopDataOutputRef") is not None or dice.random() < 0.3:
            continue
        name = f"all{number}"
        container.insert(0, etree.Element(f"{_B}dataObject", id=name, name=name))
        there = etree.Element(f"{_B}loopDataOutputRef")
        there.text = name
        item = etree.Element(f"{_B}outputDataItem", id=f"item{number}", name=f"r{number}")
        at = 1 if loop.find(f"{_B}loopCardinality") is not None else 0
        loop.insert(at, there)
        loop.insert(at + 1, item)
        if activity.tag == f"{_B}userTask":
            activity.set(f"{_OWN}store", f"r{number}")


def _keyed(root: etree._Element, dice: Random) -> None:
    """A message with a key: sender and receiver must agree on it."""
    for message in root.iter(f"{_B}message"):
        if dice.random() < 0.5:
            message.set(f"{_OWN}correlationKey", dice.choice("ab"))


def _alternatives(root: etree._Element, dice: Random) -> None:
    """Event-based gateways in front of catch events, each with another event."""
    for event in list(root.iter(f"{_B}intermediateCatchEvent")):
        name, container = f"{event.get('id')}", event.getparent()
        assert container is not None
        leaving = [each for each in container if each.get("sourceRef") == name]
        if event.find(f"{_B}linkEventDefinition") is not None or len(leaving) != 1:
            continue
        attribute, _, ref = dice.choice(_EVENTS).partition(" ")
        gate, other, merge = f"{name}g", f"{name}o", f"{name}m"
        for each in container:
            if each.get("targetRef") == name:
                each.set("targetRef", gate)
        leaving[0].set("sourceRef", merge)
        _add(container, "eventBasedGateway", id=gate)
        _add(container, "exclusiveGateway", id=merge)
        if not _declared(root, ref):
            root.insert(0, etree.Element(f"{_B}{attribute[:-3]}", id=ref, name=ref))
        if attribute == "messageRef" and dice.random() < 0.4:
            _add(container, "receiveTask", id=other, messageRef=ref)
        else:
            catch = _add(container, "intermediateCatchEvent", id=other)
            _add(catch, f"{attribute[:-3]}EventDefinition", **{attribute: ref})
        for source, target in ((gate, name), (gate, other), (name, merge), (other, merge)):
            _flow(container, source, target)


def _kept(root: etree._Element, dice: Random) -> None:
    """Messages that are thrown when the run begins."""
    process = next(each for each in root.iter(f"{_B}process") if each.get("id") == "MAIN")
    starts = [each.get("id") for each in process if each.tag == f"{_B}startEvent"][:1]
    flow = next((each for each in process if each.get("sourceRef") in starts), None)
    if flow is None:
        return
    target, last = f"{flow.get('targetRef')}", ""
    for number in range(dice.randint(1, 4)):
        ref, name = dice.choice(("m1", "m2", "m2")), f"kept{number}"
        if not _declared(root, ref):
            root.insert(0, etree.Element(f"{_B}message", id=ref, name=ref))
        event = _add(process, "intermediateThrowEvent", id=name)
        _add(event, "messageEventDefinition", messageRef=ref)
        if last:
            _flow(process, last, name)
        else:
            flow.set("targetRef", name)
        last = name
    _flow(process, last, target)
