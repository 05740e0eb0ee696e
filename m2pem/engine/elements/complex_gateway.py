"""The complex gateway (BPMN 2.0.2, clauses 10.6.5 and 13.4.5, table 13.5).

It has two phases. Waiting for start, it is activated when its condition becomes true: it uses up
one token of each incoming flow that has any, and splits like an inclusive gateway. Waiting to
reset, it waits for tokens on the other flows as long as one can still come, uses those up, and
splits again, this time only along conditions that are true. Where no other flow is left, as in a
gateway that only splits, there is nothing to wait for and no second phase.
"""

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.elements.flows import true_flows
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error, throw_error_in
from m2pem.errors import ExpressionError
from m2pem.mission.elements import ComplexGateway, SequenceFlow
from m2pem.mission.values import ReadValue, Value

ACTIVATION_COUNT = "activationCount"
WAITING_FOR_START = "waitingForStart"


def complex_gateway(x: Execution, token: Token) -> None:
    """A token has come: perhaps it activates the gateway."""
    node, scope = token.node, token.scope
    assert isinstance(node, ComplexGateway)
    if node in scope.activated:
        return
    read = _reader(scope, node, reader(token), waiting_for_start=True)
    if node.activation is not None:
        try:
            active = node.activation.holds(read)
        except ExpressionError as error:
            throw_error(x, token, "EXPRESSION", f"activationCondition of {node.id}: {error}")
            return
        if not active:
            return
    flows = true_flows(x, token, node.default, read=read)
    if flows is None:
        return
    used = _use(x, scope, node, keep=token)
    if len(used) < len(node.incoming):
        flow_ids = tuple(flow.id for flow in used)
        x.emit(r.GatewayActivated(x.process_of(node), node.id, scope.id, flow_ids))
    x.proceed(token, flows)


def reset(x: Execution, scope: Scope, node: ComplexGateway) -> None:
    """Every token that could still come has come: use them up, and begin anew.

    A flow without a condition has had its token in the first phase, and gets none here.
    """
    read = _reader(scope, node, reader(scope), waiting_for_start=False)
    flows: list[SequenceFlow] = []
    for flow in node.outgoing:
        if flow is node.default or flow.condition is None:
            continue
        try:
            if flow.condition.holds(read):
                flows.append(flow)
        except ExpressionError as error:
            throw_error_in(x, scope, "EXPRESSION", f"condition of {flow.id}: {error}")
            return
    if not flows and node.default is not None:
        flows.append(node.default)
    _use(x, scope, node, but=scope.activated[node])
    process = x.process_of(node)
    x.emit(r.GatewayReset(process, node.id, scope.id))
    for flow in flows:
        number = x.state.last_token + 1
        x.emit(r.FlowTaken(number, process, node.id, scope.id, flow.id))
        x.enter(number, flow.target, scope, flow)
    for waiting in _waiting(scope, node):
        x.queue.append(waiting)
        break
    x.look_later(scope)


def _waiting(scope: Scope, node: ComplexGateway) -> list[Token]:
    join = scope.joins.get(node)
    return [tokens[0] for tokens in join.by_flow.values()] if join is not None else []


def _use(
    x: Execution,
    scope: Scope,
    node: ComplexGateway,
    *,
    keep: Token | None = None,
    but: tuple[SequenceFlow, ...] = (),
) -> list[SequenceFlow]:
    """Consume the first token of each incoming flow, other than `keep` and those of `but`."""
    used: list[SequenceFlow] = []
    for token in _waiting(scope, node):
        flow = token.flow
        assert flow is not None
        if flow in but:
            continue
        used.append(flow)
        if keep is None or flow is not keep.flow:
            x.leave(token, TokenOutcome.COMPLETED)
    return used


def _reader(
    scope: Scope, node: ComplexGateway, outer: ReadValue, *, waiting_for_start: bool
) -> ReadValue:
    """Reads what its conditions may refer to besides the data."""
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
