"""When inclusive and complex gateways are activated: tables 13.3 and 13.5 of BPMN 2.0.2.

A path is read off the drawing, flow by flow, whatever the conditions say. What the tables leave
open is settled so:

- a token inside an activity or an event that waits is where the flows out of it begin;
- an activity leads to the flows out of its boundary events too, since a token may take them;
- a link event leads to its target.
"""

from tests.reference.diagram import Flow, Level, Node, is_link_target
from tests.reference.marking import Scope


def inclusive_is_activated(scope: Scope, gateway: Node) -> bool:
    taken = frozenset(f for f in scope.level.entries[gateway.id] if scope.tokens[f])
    return bool(taken) and _nothing_else_is_coming(scope, gateway, taken)


def complex_is_activated(scope: Scope, gateway: Node) -> bool:
    """In the state `waiting for start`: the activation condition is true."""
    entries = scope.level.entries[gateway.id]
    return gateway.id not in scope.fired and (
        sum(1 for flow in entries if scope.tokens[flow]) >= gateway.needed
    )


def complex_resets(scope: Scope, gateway: Node) -> bool:
    """In the state `waiting for reset`: no token is expected any more."""
    if gateway.id not in scope.fired:
        return False
    entries = scope.level.entries[gateway.id]
    taken = scope.fired[gateway.id] | {flow for flow in entries if scope.tokens[flow]}
    return _nothing_else_is_coming(scope, gateway, taken)


def _nothing_else_is_coming(scope: Scope, gateway: Node, taken: frozenset[str]) -> bool:
    level = scope.level
    untaken = frozenset(level.entries[gateway.id]) - taken
    if not untaken:
        return True
    for carrier in _carriers(scope):
        reached = _reachable(level, carrier, gateway)
        if reached & untaken and not reached & taken:
            return False
    return True


def _carriers(scope: Scope) -> list[tuple[str, ...]]:
    """The flows with a token, and the flows that lead on from where one is."""
    on_flows = [(flow,) for flow in scope.tokens]
    return on_flows + [tuple(_out_of(scope.level, work.node)) for work in scope.works]


def _reachable(level: Level, begin: tuple[str, ...], gateway: Node) -> frozenset[str]:
    """The flows on the paths from these that do not visit the gateway (they may end there)."""
    known = level.reachable.get((begin, gateway.id))
    if known is not None:
        return known
    reached = set(begin)
    todo = list(reached)
    while todo:
        target = level.by_id[level.targets[todo.pop()]]
        if target.id == gateway.id:
            continue
        for flow in _out_of(level, target):
            if flow not in reached:
                reached.add(flow)
                todo.append(flow)
    return level.reachable.setdefault((begin, gateway.id), frozenset(reached))


def _out_of(level: Level, node: Node) -> list[str]:
    flows: list[Flow] = list(level.outgoing[node.id])
    for boundary in level.boundaries[node.id]:
        flows += level.outgoing[boundary.id]
    return [flow.id for flow in flows] + [
        entry
        for other in level.nodes
        if node.kind == "throw" and is_link_target(other) and other.event == node.event
        for entry in level.entries[other.id]
    ]
