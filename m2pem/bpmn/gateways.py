"""Gateways (BPMN 2.0.2, clause 10.6)."""

from lxml import etree

from m2pem.bpmn.children import Children, read_children
from m2pem.bpmn.context import ReadingContext, reference, text_of
from m2pem.bpmn.rules.gateways import NO_ACTIVATION_CONDITION, PARALLEL_EVENT_GATEWAY
from m2pem.bpmn.xml import BPMN
from m2pem.mission.elements import (
    ComplexGateway,
    EventBasedGateway,
    ExclusiveGateway,
    Gateway,
    InclusiveGateway,
    ParallelGateway,
)
from m2pem.mission.expression import Expression

_PLAIN: dict[str, type[Gateway]] = {
    BPMN + "exclusiveGateway": ExclusiveGateway,
    BPMN + "inclusiveGateway": InclusiveGateway,
    BPMN + "parallelGateway": ParallelGateway,
}
_COMPLEX = BPMN + "complexGateway"
_EVENT_BASED = BPMN + "eventBasedGateway"
GATEWAYS = frozenset({*_PLAIN, _COMPLEX, _EVENT_BASED})


def read_gateway(context: ReadingContext, element: etree._Element) -> Gateway:
    """A gateway of any kind."""
    identifier = context.claim(element)
    found = read_children(context, element, identifier)
    head = context.head(element, identifier)
    gateway: Gateway
    if element.tag == _COMPLEX:
        gateway = ComplexGateway(*head, _activation(context, found))
    elif element.tag == _EVENT_BASED:
        instantiate = context.boolean(element, "instantiate", False, identifier)
        parallel = element.get("eventGatewayType") == "Parallel"
        if parallel and not instantiate:
            context.findings.error(
                element,
                identifier,
                PARALLEL_EVENT_GATEWAY,
                "an event-based gateway that waits for all of its events (eventGatewayType="
                '"Parallel") is allowed only where it begins the process',
            )
        gateway = EventBasedGateway(*head, instantiate, parallel)
    else:
        gateway = _PLAIN[element.tag](*head)
    default = element.get("default")
    if default:
        context.defaults.append((gateway, reference(default), gateway.line))
    return gateway


def _activation(context: ReadingContext, found: Children) -> Expression | None:
    for condition in found.of("activationCondition"):
        if text_of(condition):
            return context.expression_in(condition, found.id)
    context.findings.warning(
        found.element,
        found.id,
        NO_ACTIVATION_CONDITION,
        "the complex gateway has no activationCondition; any token activates it",
    )
    return None
