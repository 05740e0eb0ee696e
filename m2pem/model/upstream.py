"""Which incoming flows of a gateway a token can still reach: what an inclusive join must know."""

from m2pem.model.elements import BoundaryEvent, FlowNode


def upstream(join: FlowNode) -> dict[FlowNode, int]:
    """For every node that can reach `join`: a bit mask of the incoming flows it can reach.

    Bit n stands for `join.incoming[n]`. Paths do not pass `join` itself. A token on an activity
    can also go by the boundary events attached to it.
    """
    reach: dict[FlowNode, int] = {}
    for place, flow in enumerate(join.incoming):
        bit = 1 << place
        pending = [flow.source]
        while pending:
            node = pending.pop()
            if node is join or reach.get(node, 0) & bit:
                continue
            reach[node] = reach.get(node, 0) | bit
            pending.extend(before.source for before in node.incoming)
            if isinstance(node, BoundaryEvent):
                pending.append(node.attached_to)
    return reach
