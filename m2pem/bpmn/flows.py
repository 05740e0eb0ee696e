"""Sequence flows and their conditions (BPMN 2.0.2, clause 8.4.13)."""

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.reading import FlowEnds, Reading, reference, text_of
from m2pem.bpmn.rules.sequence_flows import EMPTY_CONDITION
from m2pem.bpmn.scan import Order
from m2pem.bpmn.schema import SHAPES
from m2pem.mission.elements import Container, SequenceFlow
from m2pem.mission.expression import Expression

SEQUENCE_FLOW = BPMN + "sequenceFlow"
_CONDITION = BPMN + "conditionExpression"
_SHAPE = SHAPES[SEQUENCE_FLOW]


def read_flow(reading: Reading, element: etree._Element, container: Container) -> None:
    """A sequence flow; its ends are looked up when all nodes are known."""
    identifier = reading.claim(element)
    reading.check_attributes(element, _SHAPE, identifier)
    condition = None
    if len(element):
        order = Order()
        for child in element:
            order.check(reading, element, child, _SHAPE, identifier)
            if child.tag == _CONDITION:
                condition = _condition(reading, child, identifier)
    flow = SequenceFlow(
        identifier, element.get("name", ""), reading.report.line(element), condition
    )
    reading.flows.append(
        FlowEnds(
            flow,
            reference(element.get("sourceRef", "")),
            reference(element.get("targetRef", "")),
            container,
        )
    )


def _condition(reading: Reading, element: etree._Element, identifier: str) -> Expression | None:
    reading.check_attributes(element, SHAPES[_CONDITION], identifier)
    text = text_of(element)
    if not text:
        reading.report.warning(
            element,
            identifier,
            EMPTY_CONDITION,
            "the condition is empty; the flow counts as one without a condition",
            "write the condition, or delete the conditionExpression",
        )
        return None
    return reading.expression(element, identifier, text, element.get("language"))
