"""Gateways (BPMN 2.0.2, clause 10.6)."""

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.reading import Reading, reference, text_of
from m2pem.bpmn.rules.gateways import NO_ACTIVATION_CONDITION, PARALLEL_EVENT_GATEWAY
from m2pem.bpmn.scan import Scan, scan
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


def read_gateway(reading: Reading, element: etree._Element) -> Gateway:
    """A gateway of any kind."""
    identifier = reading.claim(element)
    found = scan(reading, element, identifier)
    name, line = element.get("name", ""), reading.report.line(element)
    gateway: Gateway
    if element.tag == _COMPLEX:
        gateway = ComplexGateway(identifier, name, line, _activation(reading, found))
    elif element.tag == _EVENT_BASED:
        instantiate = reading.boolean(element, "instantiate", False, identifier)
        parallel = element.get("eventGatewayType") == "Parallel"
        if parallel and not instantiate:
            reading.report.error(
                element,
                identifier,
                PARALLEL_EVENT_GATEWAY,
                "an event-based gateway that waits for all of its events (eventGatewayType="
                '"Parallel") is allowed only where it begins the process',
                'add instantiate="true" where it has no incoming flow; else fork with a parallel '
                "gateway, and wait for one event on each branch",
            )
        gateway = EventBasedGateway(identifier, name, line, instantiate, parallel)
    else:
        gateway = _PLAIN[element.tag](identifier, name, line)
    default = element.get("default")
    if default:
        reading.defaults.append((gateway, reference(default), line))
    return gateway


def _activation(reading: Reading, found: Scan) -> Expression | None:
    for condition in found.of("activationCondition"):
        text = text_of(condition)
        if text:
            return reading.expression(condition, found.id, text, condition.get("language"))
    reading.report.warning(
        found.element,
        found.id,
        NO_ACTIVATION_CONDITION,
        "the complex gateway has no activationCondition; any token activates it",
        "add one, for example <activationCondition>activationCount >= 2</activationCondition>",
    )
    return None
