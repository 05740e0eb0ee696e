"""What an inclusive join knows of the nodes before it."""

from random import Random

from m2pem.mission.elements import BoundaryEvent, FlowNode, InclusiveGateway
from m2pem.mission.reachability import upstream
from tests.engine.notation import mission
from tests.engine.random_missions import graph


def reached(text: str, join: str = "join") -> dict[str, str]:
    """The incoming flows of the join that each node can reach, by their sources."""
    node = mission(text).elements[join]
    assert isinstance(node, FlowNode)
    return {
        each.id: " ".join(
            flow.source.id for place, flow in enumerate(node.incoming) if bits >> place & 1
        )
        for each, bits in upstream(node).items()
    }


def test_each_node_knows_the_flows_that_it_can_reach() -> None:
    assert reached("""
        <startEvent id="s"/> <exclusiveGateway id="which"/> <task id="a"/> <task id="b"/>
        <inclusiveGateway id="join"/> <task id="after"/> <task id="aside"/>
        s -> which -> a -> join
        which -> b -> join
        join -> after
        which -> aside
    """) == {"a": "a", "b": "b", "which": "a b", "s": "a b"}


def test_paths_do_not_pass_the_join() -> None:
    assert reached("""
        <startEvent id="s"/> <inclusiveGateway id="join"/> <task id="a"/> <task id="back"/>
        s -> join -> a -> back -> join
    """) == {"s": "s", "back": "back", "a": "back"}


def test_an_activity_reaches_what_its_boundary_events_reach() -> None:
    assert reached("""
        <startEvent id="s"/> <userTask id="a"/> <userTask id="b"/> <inclusiveGateway id="join"/>
        <boundaryEvent id="late" attachedToRef="a">timer PT1S</boundaryEvent>
        s -> a -> b -> join
        late -> join
    """) == {"b": "b", "late": "late", "a": "b late", "s": "b late"}


def test_reachability_agrees_with_a_walk_from_each_node() -> None:
    for seed in range(200):
        for join in mission(graph(Random(seed))).nodes:
            if isinstance(join, InclusiveGateway):
                found = upstream(join)
                for node in join.container.nodes:
                    assert found.get(node, 0) == walk(node, join)


def walk(start: FlowNode, join: FlowNode) -> int:
    bits = 0
    seen = set()
    waiting = [start] if start is not join else []
    while waiting:
        node = waiting.pop()
        seen.add(node)
        nexts = [flow.target for flow in node.outgoing]
        nexts += [
            each
            for each in node.container.nodes
            if isinstance(each, BoundaryEvent) and each.attached_to is node
        ]
        for flow in node.outgoing:
            if flow.target is join:
                bits |= 1 << join.incoming.index(flow)
        waiting += [each for each in nexts if each is not join and each not in seen]
    return bits
