"""Which incoming flows of a gateway a token can still reach: what an inclusive join must know."""

from collections import OrderedDict

from m2pem.mission.elements import FlowNode
from m2pem.mission.reach import preceding


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
