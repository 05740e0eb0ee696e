"""Joins that must look at the tokens elsewhere: inclusive ones, and complex ones that reset.

Both wait for what can still arrive (BPMN 2.0.2, tables 13.3 and 13.5).
"""

from collections.abc import Container

from m2pem.engine.elements.complex_gateway import reset
from m2pem.engine.elements.gateways import merge, split
from m2pem.engine.execution import Execution
from m2pem.engine.state import Scope
from m2pem.mission.elements import ComplexGateway, FlowNode, InclusiveGateway, SequenceFlow


def fire_joins(x: Execution) -> bool:
    """Let joins go on that need to wait no more, one in each scope. False: none could.

    Called when no other step is left, so that whatever can move without outside input has moved.
    Whether a join is complete depends on the tokens of its scope alone.
    """
    moved = sorted(x.moved)
    x.moved.clear()
    fired = False
    for number in moved:
        scope = x.state.scopes.get(number)
        if scope is not None and (scope.joins or scope.activated) and _fire_one(x, scope):
            x.moved.add(number)  # what one has done may be what another waited for
            fired = True
    return fired


def _fire_one(x: Execution, scope: Scope) -> bool:
    for node, join in scope.joins.items():
        if isinstance(node, InclusiveGateway) and not _more_can_come(x, scope, node, join.by_flow):
            last = list(join.by_flow.values())[-1][0]
            merge(x, last, join)
            split(x, last, node)
            return True
    for node, used in scope.activated.items():
        waiting = scope.joins[node].by_flow if node in scope.joins else {}
        if not _more_can_come(x, scope, node, {*used, *waiting}):
            assert isinstance(node, ComplexGateway)
            reset(x, scope, node)
            return True
    return False


def _more_can_come(
    x: Execution, scope: Scope, node: FlowNode, taken: Container[SequenceFlow]
) -> bool:
    """Whether a flow that no token came by may still get one (the rule of table 13.3).

    A token elsewhere in the scope keeps the join waiting when it can reach such a flow, along a
    path that does not pass the join, unless it can also reach one that is taken already. Those
    that wait at the join itself reach nothing, nor does one whose activity is being undone.
    """
    reach = x.upstream(node)
    bits = 0
    for place, flow in enumerate(node.incoming):
        if flow in taken:
            bits |= 1 << place
    for token in scope.tokens.values():
        reachable = 0 if token.is_reopened else reach.get(token.node, 0)
        if reachable & ~bits and not reachable & bits:
            return True
    return False
