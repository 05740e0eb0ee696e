"""Where tokens can go by the drawing alone (conditions are not looked at)."""

from collections.abc import Iterable

from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    Container,
    EventBasedGateway,
    FlowNode,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    ReceiveTask,
    SubProcess,
)


def following(node: FlowNode) -> list[FlowNode]:
    """Where a token on a node can go next: by its flows, boundary events and link."""
    found: list[FlowNode] = [flow.target for flow in node.outgoing]
    if isinstance(node, Activity):
        found += node.boundary
    elif isinstance(node, IntermediateThrowEvent) and node.links_to is not None:
        found.append(node.links_to)
    return found


def preceding(node: FlowNode) -> list[FlowNode]:
    """The nodes that `node` is `following` of."""
    found = [flow.source for flow in node.incoming]
    if isinstance(node, BoundaryEvent):
        found.append(node.attached_to)
    elif isinstance(node, IntermediateCatchEvent):
        found += node.linked_from
    return found


def instantiates(node: FlowNode) -> bool:
    """Whether it begins its process, though it is no start event (clauses 10.3.3 and 10.6.6)."""
    return isinstance(node, EventBasedGateway | ReceiveTask) and node.instantiate


def begins_by_itself(node: FlowNode) -> bool:
    """Whether something else than a token before it can begin a node that is no start event."""
    if instantiates(node):
        return True
    if isinstance(node, SubProcess) and node.triggered_by_event:
        return True
    return isinstance(node, Activity) and node.for_compensation


def unreached(container: Container, also: Iterable[FlowNode] = ()) -> list[FlowNode]:
    """The nodes directly in a container that no path leads to from its entries, or from `also`."""
    waiting: list[FlowNode] = [*container.entries, *also]
    waiting += [node for node in container.nodes if begins_by_itself(node)]
    reached = set(waiting)
    while waiting:
        for each in following(waiting.pop()):
            if each not in reached:
                reached.add(each)
                waiting.append(each)
    return [node for node in container.nodes if node not in reached]
