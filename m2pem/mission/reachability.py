"""Where tokens can go by the graph alone: conditions are not looked at."""

from collections import OrderedDict
from collections.abc import Collection, Hashable, Iterable, Mapping
from typing import TypeVar

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
    """Return the nodes to which a token can go next: by flows, boundary events and a link."""
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
    begun = (node for node in container.nodes if begins_by_itself(node))
    reached = reach((*container.entries, *also, *begun))
    return [node for node in container.nodes if node not in reached]


def reach(entries: Iterable[FlowNode], barrier: FlowNode | None = None) -> set[FlowNode]:
    """Return where tokens on `entries` can be, then or later. None goes on from `barrier`."""
    waiting = list(entries)
    found = set(waiting)
    while waiting:
        node = waiting.pop()
        if node is barrier:
            continue
        for each in following(node):
            if each not in found:
                found.add(each)
                waiting.append(each)
    return found


def upstream(join: FlowNode) -> dict[FlowNode, int]:
    """For every node that can reach `join`: a bit mask of the incoming flows it can reach.

    Bit n stands for `join.incoming[n]`. Paths do not pass `join` itself. A token on an activity
    can also go by the boundary events attached to it, one on a link source by its target.
    """
    reach: dict[FlowNode, int] = {}
    news: OrderedDict[FlowNode, int] = OrderedDict()  # more for a node goes with what waits
    for place, flow in enumerate(join.incoming):
        news[flow.source] = news.get(flow.source, 0) | 1 << place
    while news:
        node, bits = news.popitem(last=False)
        bits &= ~reach.get(node, 0)
        if node is join or not bits:
            continue
        reach[node] = reach.get(node, 0) | bits
        for before in preceding(node):
            news[before] = news.get(before, 0) | bits
    return reach


N = TypeVar("N", bound=Hashable)


def components(successors: Mapping[N, Collection[N]]) -> dict[N, int]:
    """Return a number for each node; nodes that can reach each other have the same one.

    Successors that are no keys are not in the graph.
    """
    # Loaded when needed: it loads NumPy, and what runs a mission asks for other things alone.
    import rustworkx  # noqa: PLC0415

    graph: rustworkx.PyDiGraph = rustworkx.PyDiGraph()
    index = dict(zip(successors, graph.add_nodes_from(tuple(successors)), strict=True))
    graph.add_edges_from_no_data(
        [
            (index[node], index[each])
            for node, following in successors.items()
            for each in following
            if each in index
        ]
    )
    found = rustworkx.strongly_connected_components(graph)
    return {graph[at]: number for number, members in enumerate(found) for at in members}
