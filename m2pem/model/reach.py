"""What no token can ever visit, by the drawing alone (conditions are not looked at)."""

from collections.abc import Iterable

from m2pem.findings import Finding, Severity
from m2pem.model.elements import Activity, Container, FlowNode


def unreached(container: Container, also: Iterable[FlowNode] = ()) -> list[FlowNode]:
    """The nodes directly in a container that no path leads to from its entries, or from `also`."""
    waiting: list[FlowNode] = [*container.entries, *also]
    reached = set(waiting)
    while waiting:
        node = waiting.pop()
        following: list[FlowNode] = [flow.target for flow in node.outgoing]
        if isinstance(node, Activity):
            following += node.boundary
        for each in following:
            if each not in reached:
                reached.add(each)
                waiting.append(each)
    return [node for node in container.nodes if node not in reached]


def unreachable(file: str, node: FlowNode) -> Finding:
    """The finding about one of them."""
    what = "no start event can reach it" if node.container.starts else "nothing can reach it"
    return Finding(
        Severity.ERROR,
        file,
        node.line,
        node.id,
        "unreachable",
        f"{what}, so it would never run",
        "draw a sequence flow to it, or delete it",
    )
