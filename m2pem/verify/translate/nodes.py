"""The rules of each kind of element."""

from collections.abc import Callable

from m2pem.mission import elements as e
from m2pem.verify.translate import activities, containers, events, gateways
from m2pem.verify.translate.making import Making
from m2pem.verify.translate.net import Area

_BUILD: tuple[tuple[type[e.FlowNode], Callable[[Making, e.FlowNode, Area], None]], ...] = (
    (e.Activity, activities.activity),
    (e.ExclusiveGateway, gateways.exclusive),
    (e.ParallelGateway, gateways.parallel),
    (e.InclusiveGateway, gateways.inclusive),
    (e.ComplexGateway, gateways.complex_gateway),
    (e.EventBasedGateway, events.event_based),
    (e.StartEvent, events.start),
    (e.EndEvent, events.end),
    (e.IntermediateCatchEvent, events.catch),
    (e.IntermediateThrowEvent, events.throw),
)


def build_node(making: Making, node: e.FlowNode, area: Area) -> None:
    """Make the rules of one element in one area."""
    making.net.knows(node)
    if isinstance(node, e.SubProcess) and node.triggered_by_event:
        containers.event_subprocess(making, node, area)
        return
    for kind, build in _BUILD:
        if isinstance(node, kind):
            build(making, node, area)
            return
