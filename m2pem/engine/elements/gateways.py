"""Gateways (BPMN 2.0.2, clauses 10.6 and 13.4).

Inclusive joins and complex gateways that reset must look at the tokens elsewhere: they wait for
what can still arrive (tables 13.3 and 13.5).

A complex gateway has two phases. Waiting for start, it is activated when its condition becomes
true: it uses up one token of each incoming flow that has any, and splits like an inclusive gateway.
Waiting to reset, it waits for tokens on the other flows as long as one can still come, uses those
up, and splits again, this time only along conditions that are true. Where no other flow is left, as
in a gateway that only splits, there is nothing to wait for and no second phase.
"""

from collections.abc import Container

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.elements.sequence_flows import true_flows
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Join, Scope, Token
from m2pem.engine.throwing import throw_error, throw_expression_error
from m2pem.engine.triggering import await_events_of_gateway, take_kept_messages
from m2pem.errors import ExpressionError
from m2pem.mission.elements import (
    ComplexGateway,
    ExclusiveGateway,
    FlowNode,
    InclusiveGateway,
    SequenceFlow,
)
from m2pem.mission.values import ReadValue, Value


def exclusive(x: Execution, token: Token) -> None:
    """Take the first true flow, else the default, else throw NO_FLOW. Every token passes."""
    node = token.node
    assert isinstance(node, ExclusiveGateway)
    if len(node.outgoing) == 1 and node.outgoing[0].condition is None:
        x.proceed(token, node.outgoing)
        return
    decided = true_flows(x, token, node.default, first_only=True)
    if decided is not None:
        x.proceed(token, *decided)


def parallel(x: Execution, token: Token) -> None:
    """Proceed when every incoming flow has a token (clause 13.4.1, table 13.1).

    The token that arrived last proceeds, the others are consumed; a second token on a flow stays
    for the next round.
    """
    node = token.node
    if len(node.incoming) > 1:
        join = token.scope.joins[node]
        if len(join.by_flow) < len(node.incoming):
            return
        merge(x, token, join)
    x.proceed(token, node.outgoing)


def inclusive(x: Execution, token: Token) -> None:
    """Split at once; a join fires when no other step is left (`fire_joins`)."""
    node = token.node
    assert isinstance(node, InclusiveGateway)
    if len(node.incoming) <= 1:
        split_inclusive(x, token, node)


def split_inclusive(x: Execution, token: Token, node: InclusiveGateway) -> None:
    """Take every true flow, else the default (table 13.3)."""
    decided = true_flows(x, token, node.default)
    if decided is not None:
        x.proceed(token, *decided)


def merge(x: Execution, last: Token, join: Join) -> None:
    """Consume one token of each flow that has any, except `last`, which proceeds."""
    for tokens in [tokens for flow, tokens in join.by_flow.items() if flow is not last.flow]:
        x.leave(tokens[0], TokenOutcome.COMPLETED)


def event_based(x: Execution, token: Token) -> None:
    """Wait for the events after it; `m2pem.engine.triggering` handles the first that occurs."""
    if token.waits is not None:
        return  # it began its process: the first of its events has occurred
    if await_events_of_gateway(x, token):
        take_kept_messages(x, token)


ACTIVATION_COUNT = "activationCount"
WAITING_FOR_START = "waitingForStart"


def complex_gateway(x: Execution, token: Token) -> None:
    """Activate a complex gateway if its condition is true with the token that has arrived."""
    node, scope = token.node, token.scope
    assert isinstance(node, ComplexGateway)
    if node in scope.activated:
        return
    read = _gateway_reader(scope, node, reader(token), waiting_for_start=True)
    if node.activation is not None:
        try:
            active = node.activation.holds(read)
        except ExpressionError as error:
            throw_error(x, token, "EXPRESSION", f"activationCondition of {node.id}: {error}")
            return
        if not active:
            return
    decided = true_flows(x, token, node.default, read=read)
    if decided is None:
        return
    used = _consume_tokens(x, scope, node, keep=token)
    if len(used) < len(node.incoming):
        flow_ids = tuple(flow.id for flow in used)
        x.emit(r.GatewayActivated(x.process_of(node), node.id, scope.id, flow_ids))
    x.proceed(token, *decided)


def reset_complex_gateway(x: Execution, scope: Scope, node: ComplexGateway) -> None:
    """Consume the tokens of the second phase, and reset a complex gateway.

    A flow without a condition has had its token in the first phase, and gets none here.
    """
    read = _gateway_reader(scope, node, reader(scope), waiting_for_start=False)
    flows: list[SequenceFlow] = []
    for flow in node.outgoing:
        if flow is node.default or flow.condition is None:
            continue
        try:
            if flow.condition.holds(read):
                flows.append(flow)
        except ExpressionError as error:
            throw_expression_error(x, scope, f"condition of {flow.id}: {error}")
            return
    if not flows and node.default is not None:
        flows.append(node.default)
    _consume_tokens(x, scope, node, but=scope.activated[node])
    process = x.process_of(node)
    x.emit(r.GatewayReset(process, node.id, scope.id))
    for flow in flows:
        number = x.state.last_token + 1
        x.emit(r.FlowTaken(number, process, node.id, scope.id, flow.id))
        x.enter(number, flow.target, scope, flow)
    for waiting in _waiting_tokens(scope, node):
        x.queue.append(waiting)
        break
    x.check_scope_later(scope)


def _waiting_tokens(scope: Scope, node: ComplexGateway) -> list[Token]:
    join = scope.joins.get(node)
    return [tokens[0] for tokens in join.by_flow.values()] if join is not None else []


def _consume_tokens(
    x: Execution,
    scope: Scope,
    node: ComplexGateway,
    *,
    keep: Token | None = None,
    but: tuple[SequenceFlow, ...] = (),
) -> list[SequenceFlow]:
    """Consume the first token of each incoming flow, other than `keep` and those of `but`."""
    used: list[SequenceFlow] = []
    for token in _waiting_tokens(scope, node):
        flow = token.flow
        assert flow is not None
        if flow in but:
            continue
        used.append(flow)
        if keep is None or flow is not keep.flow:
            x.leave(token, TokenOutcome.COMPLETED)
    return used


def _gateway_reader(
    scope: Scope, node: ComplexGateway, outer: ReadValue, *, waiting_for_start: bool
) -> ReadValue:
    """Return a reader of the data, of the counts of tokens by flow, and of the gateway's state."""
    join = scope.joins.get(node)
    by_flow = join.by_flow if join is not None else {}
    own: dict[str, Value] = {
        ACTIVATION_COUNT: len(by_flow),
        WAITING_FOR_START: waiting_for_start,
    }
    for flow in node.incoming:
        own[flow.local_id] = len(by_flow.get(flow, ()))

    def read(name: str) -> Value:
        return own[name] if name in own else outer(name)

    return read


def fire_joins(x: Execution) -> bool:
    """Fire joins that need to wait no longer, one in each scope. False: there was none.

    Called when no other step is left: then all tokens that can move without an input have moved.
    Whether a join is complete depends on the tokens of its scope alone.
    """
    moved = sorted(x.joins_to_check)
    x.joins_to_check.clear()
    fired = False
    for number in moved:
        scope = x.state.scopes.get(number)
        if scope is not None and (scope.joins or scope.activated) and _fire_one(x, scope):
            x.joins_to_check.add(number)  # another join may have waited for this one
            fired = True
    return fired


def _fire_one(x: Execution, scope: Scope) -> bool:
    for node, join in scope.joins.items():
        if x.state.incidents and _is_stopped(join):
            continue
        if isinstance(node, InclusiveGateway) and not _more_tokens_can_come(
            x, scope, node, join.by_flow
        ):
            last = list(join.by_flow.values())[-1][0]
            merge(x, last, join)
            split_inclusive(x, last, node)
            return True
    for node, used in scope.activated.items():
        if x.state.incidents and node in scope.joins and _is_stopped(scope.joins[node]):
            continue
        waiting = scope.joins[node].by_flow if node in scope.joins else {}
        if not _more_tokens_can_come(x, scope, node, {*used, *waiting}):
            assert isinstance(node, ComplexGateway)
            reset_complex_gateway(x, scope, node)
            return True
    return False


def _is_stopped(join: Join) -> bool:
    """Whether a token that has fired the join is stopped there by an incident."""
    return any(token.incident for tokens in join.by_flow.values() for token in tokens)


def _more_tokens_can_come(
    x: Execution, scope: Scope, node: FlowNode, taken: Container[SequenceFlow]
) -> bool:
    """Whether an incoming flow without a token may still get one (the rule of table 13.3).

    A token elsewhere in the scope keeps the join waiting when it can reach such a flow, along a
    path that does not pass the join, unless it can also reach one that is taken already. Those
    that wait at the join itself reach nothing, nor does one whose activity is being undone.
    """
    reach = x.upstream(node)
    bits = 0
    for index, flow in enumerate(node.incoming):
        if flow in taken:
            bits |= 1 << index
    for token in scope.tokens.values():
        reachable = 0 if token.is_reopened else reach.get(token.node, 0)
        if reachable & ~bits and not reachable & bits:
            return True
    return False
