"""Gateways (BPMN 2.0.2, clauses 10.6 and 13.4)."""

from m2pem.engine.execution import Execution
from m2pem.engine.nodes.flows import true_flows
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Join, Scope, Token
from m2pem.model.elements import ExclusiveGateway, InclusiveGateway


def exclusive(x: Execution, token: Token) -> None:
    """First true flow, else the default, else error NO_FLOW. Every incoming token passes."""
    node = token.node
    assert isinstance(node, ExclusiveGateway)
    if len(node.outgoing) == 1 and node.outgoing[0].condition is None:
        x.proceed(token, node.outgoing)
        return
    flows = true_flows(x, token, node.default, first_only=True)
    if flows is not None:
        x.proceed(token, flows)


def parallel(x: Execution, token: Token) -> None:
    """Goes on when every incoming flow has a token (clause 13.4.1, table 13.1).

    The token that came last goes on, the others are consumed; a second token on a flow stays for
    the next round.
    """
    node = token.node
    if len(node.incoming) > 1:
        join = token.scope.joins[node]
        if len(join.by_flow) < len(node.incoming):
            return
        _merge(x, token, join)
    x.proceed(token, node.outgoing)


def inclusive(x: Execution, token: Token) -> None:
    """Joins at the next quiet moment (`fire_inclusive_joins`); a split goes on at once."""
    node = token.node
    assert isinstance(node, InclusiveGateway)
    if len(node.incoming) <= 1:
        _split(x, token, node)


def _split(x: Execution, token: Token, node: InclusiveGateway) -> None:
    flows = true_flows(x, token, node.default)
    if flows is not None:
        x.proceed(token, flows)


def _merge(x: Execution, last: Token, join: Join) -> None:
    """Consume one token of each flow that has any, but for `last`, which goes on."""
    for tokens in [tokens for flow, tokens in join.by_flow.items() if flow is not last.flow]:
        x.leave(tokens[0], TokenOutcome.COMPLETED)


def fire_inclusive_joins(x: Execution) -> bool:
    """Let inclusive joins go on that need to wait no more, one in each scope. False: none could.

    Called when no other step is left, so that whatever can move without outside input has moved.
    Whether a join is complete depends on the tokens of its scope alone.
    """
    moved = sorted(x.moved)
    x.moved.clear()
    fired = False
    for number in moved:
        scope = x.state.scopes.get(number)
        if scope is not None and scope.joins:
            fired = _fire_one(x, scope) or fired
    return fired


def _fire_one(x: Execution, scope: Scope) -> bool:
    for node, join in scope.joins.items():
        if isinstance(node, InclusiveGateway) and _is_complete(x, scope, node, join):
            last = list(join.by_flow.values())[-1][0]
            _merge(x, last, join)
            _split(x, last, node)
            return True
    return False


def _is_complete(x: Execution, scope: Scope, node: InclusiveGateway, join: Join) -> bool:
    """The rule of table 13.3.

    A token elsewhere in the scope keeps the join waiting when it can reach a flow that nobody
    came by yet, along a path that does not pass the join, unless it can also reach one that is
    taken already. Those that wait at the join itself reach nothing, nor does one whose activity
    is being undone.
    """
    reach = x.upstream(node)
    taken = 0
    for place, flow in enumerate(node.incoming):
        if flow in join.by_flow:
            taken |= 1 << place
    for token in scope.tokens.values():
        if token.is_reopened:
            continue
        reachable = reach.get(token.node, 0)
        if reachable & ~taken and not reachable & taken:
            return False
    return True
