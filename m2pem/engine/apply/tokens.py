"""What records about tokens do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply import compensation as undoing
from m2pem.engine.apply.appliers import Appliers
from m2pem.engine.apply.events import end_wait, node_of
from m2pem.engine.state import (
    Join,
    RunState,
    Scope,
    Token,
)
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    ComplexGateway,
    FlowNode,
    InclusiveGateway,
    ParallelGateway,
    SequenceFlow,
)


def _is_join(node: FlowNode) -> bool:
    kind = type(node)
    if kind is ParallelGateway or kind is InclusiveGateway:
        return len(node.incoming) > 1
    return kind is ComplexGateway


def _is_choice(scope: Scope, node: FlowNode) -> bool:
    if not isinstance(scope.container, AdHocSubProcess) or scope.loop is not None:
        return False
    return node in scope.container.entries


def _token_entered(state: RunState, record: r.TokenEntered) -> None:
    node = node_of(state, record.element)
    scope = state.scopes[record.scope]
    flow: SequenceFlow | None = None
    if record.flow:
        element = state.mission.elements[record.flow]
        assert isinstance(element, SequenceFlow)
        flow = element
    token = Token(record.token, node, scope, flow, instance=record.instance)
    state.tokens[record.token] = token
    scope.tokens[record.token] = token
    state.last_token = max(state.last_token, record.token)
    if scope.compensations and undoing.enter_to_undo(scope, token):
        return
    if flow is not None and _is_join(node):
        join = scope.joins.get(node)
        if join is None:
            join = scope.joins[node] = Join()
        join.by_flow.setdefault(flow, []).append(token)
    elif scope.loop is not None:
        scope.loop.started += 1
    elif _is_choice(scope, node) and flow is None:
        scope.begun[node] = None
        if scope.chosen and scope.chosen[0] is node:
            scope.chosen.pop(0)
    elif isinstance(node, Activity) and node.start_quantity > 1:
        scope.gathered.setdefault(node, []).append(token)


def _gateway_activated(state: RunState, record: r.GatewayActivated) -> None:
    node = node_of(state, record.element)
    used = tuple(flow for flow in node.incoming if flow.id in record.flows)
    state.scopes[record.scope].activated[node] = used


def _gateway_reset(state: RunState, record: r.GatewayReset) -> None:
    del state.scopes[record.scope].activated[node_of(state, record.element)]


def _activities_chosen(state: RunState, record: r.ActivitiesChosen) -> None:
    state.scopes[record.scope].chosen = [node_of(state, element) for element in record.elements]


def _tokens_gathered(state: RunState, record: r.TokensGathered) -> None:
    _no_longer_gathered(state.tokens[record.token])


def _no_longer_gathered(token: Token) -> None:
    gathered = token.scope.gathered
    waiting = gathered.get(token.node)
    if waiting is not None and token in waiting:
        waiting.remove(token)
        if not waiting:
            del gathered[token.node]


def _token_left(state: RunState, record: r.TokenLeft) -> None:
    token = state.tokens.pop(record.token)
    scope = token.scope
    del scope.tokens[record.token]
    if token.waits is not None:
        for wait in list(token.waits.values()):
            end_wait(state, wait)
    undoing.leave_compensation(token)
    if token.flow is not None and _is_join(token.node):
        join = scope.joins[token.node]
        arrived = join.by_flow[token.flow]
        arrived.remove(token)
        if not arrived:
            del join.by_flow[token.flow]
            if not join.by_flow:
                del scope.joins[token.node]
    elif scope.loop is not None and token.undoes is None:
        if record.outcome is r.TokenOutcome.COMPLETED:
            scope.loop.completed += 1
        else:
            scope.loop.terminated += 1
    elif scope.gathered:
        _no_longer_gathered(token)


def _instance_output(state: RunState, record: r.InstanceOutput) -> None:
    loop = state.scopes[record.scope].loop
    assert loop is not None
    loop.outputs[record.instance] = record.value


APPLIERS: Appliers = {
    r.TokenEntered: _token_entered,
    r.TokenLeft: _token_left,
    r.InstanceOutput: _instance_output,
    r.ActivitiesChosen: _activities_chosen,
    r.TokensGathered: _tokens_gathered,
    r.GatewayActivated: _gateway_activated,
    r.GatewayReset: _gateway_reset,
}
