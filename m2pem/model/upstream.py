"""Which incoming flows of a gateway a token can still reach: what an inclusive join must know."""

from collections import OrderedDict

from m2pem.model.elements import BoundaryEvent, FlowNode


def upstream(join: FlowNode) -> dict[FlowNode, int]:
    """For every node that can reach `join`: a bit mask of the incoming flows it can reach.

    Bit n stands for `join.incoming[n]`. Paths do not pass `join` itself. A token on an activity
    can also go by the boundary events attached to it.
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
        for before in node.incoming:
            news[before.source] = news.get(before.source, 0) | bits
        if isinstance(node, BoundaryEvent):
            news[node.attached_to] = news.get(node.attached_to, 0) | bits
    return reach
