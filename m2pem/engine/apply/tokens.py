"""What records about tokens and scopes do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply import compensation
from m2pem.engine.apply.events import end_wait, node_of, take_message
from m2pem.engine.state import (
    Join,
    Loop,
    RunState,
    Scope,
    Token,
)
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    CallActivity,
    ComplexGateway,
    Container,
    FlowNode,
    InclusiveGateway,
    ParallelGateway,
    Process,
    SequenceFlow,
    SubProcess,
)


def is_join(node: FlowNode) -> bool:
    """Whether tokens wait at a gateway for those of its other flows."""
    kind = type(node)
    if kind is ParallelGateway or kind is InclusiveGateway:
        return len(node.incoming) > 1
    return kind is ComplexGateway


def _is_choice(scope: Scope, node: FlowNode) -> bool:
    if not isinstance(scope.container, AdHocSubProcess) or scope.loop is not None:
        return False
    return node in scope.container.entries


def token_entered(state: RunState, record: r.TokenEntered) -> None:
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
    if scope.compensations and compensation.enter_compensation(scope, token):
        return
    if flow is not None and is_join(node):
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


def gateway_activated(state: RunState, record: r.GatewayActivated) -> None:
    node = node_of(state, record.element)
    used = tuple(flow for flow in node.incoming if flow.id in record.flows)
    state.scopes[record.scope].activated[node] = used


def gateway_reset(state: RunState, record: r.GatewayReset) -> None:
    del state.scopes[record.scope].activated[node_of(state, record.element)]


def activities_chosen(state: RunState, record: r.ActivitiesChosen) -> None:
    state.scopes[record.scope].chosen = [node_of(state, element) for element in record.elements]


def tokens_gathered(state: RunState, record: r.TokensGathered) -> None:
    _no_longer_gathered(state.tokens[record.token])


def _no_longer_gathered(token: Token) -> None:
    gathered = token.scope.gathered
    waiting = gathered.get(token.node)
    if waiting is not None and token in waiting:
        waiting.remove(token)
        if not waiting:
            del gathered[token.node]


def token_left(state: RunState, record: r.TokenLeft) -> None:
    token = state.tokens.pop(record.token)
    scope = token.scope
    del scope.tokens[record.token]
    if token.waits is not None:
        for wait in list(token.waits.values()):
            end_wait(state, wait)
    compensation.leave_compensation(token)
    if token.flow is not None and is_join(token.node):
        join = scope.joins[token.node]
        arrived = join.by_flow[token.flow]
        arrived.remove(token)
        if not arrived:
            del join.by_flow[token.flow]
            if not join.by_flow:
                del scope.joins[token.node]
    elif scope.loop is not None and token.compensates is None:
        if record.outcome is r.TokenOutcome.COMPLETED:
            scope.loop.completed += 1
        else:
            scope.loop.terminated += 1
    elif scope.gathered:
        _no_longer_gathered(token)


def instance_output(state: RunState, record: r.InstanceOutput) -> None:
    loop = state.scopes[record.scope].loop
    assert loop is not None
    loop.outputs[record.instance] = record.value


def scope_opened(state: RunState, record: r.ScopeOpened) -> None:
    parent = state.scopes[record.parent] if record.parent is not None else None
    owner = state.tokens[record.token] if record.token is not None else None
    container: Container
    element = state.mission.elements[record.element]
    if record.instances is not None:
        assert isinstance(element, Activity)
        container = element.container
    elif isinstance(element, CallActivity):
        container = element.called
    else:
        assert isinstance(element, (Process, SubProcess))
        container = element
    depth = parent.depth + 1 if parent is not None else 0
    scope = Scope(record.scope, container, parent, owner, depth, state.shared)
    if record.instances is not None:
        scope.loop = Loop(record.instances, record.items)
        scope.depth -= 1  # its activity is one level, not two
    state.scopes[record.scope] = scope
    state.last_scope = record.scope
    if owner is not None:
        owner.inner = scope
    if state.root is None:
        state.root = scope
    if record.message:
        take_message(state, record.message)


def scope_closed(state: RunState, record: r.ScopeClosed) -> None:
    scope = state.scopes.pop(record.scope)
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        end_wait(state, wait)
    compensation.note_on_owner(scope, record)


def scope_interrupted(state: RunState, record: r.ScopeInterrupted) -> None:
    scope = state.scopes[record.scope]
    scope.interrupted = True
    scope.activated.clear()  # no token comes any more for which a complex gateway would wait
    compensation.drop_compensations(scope)
    _disarm_event_subprocesses(state, scope)


def scope_completing(state: RunState, record: r.ScopeCompleting) -> None:
    scope = state.scopes[record.scope]
    scope.completing = True
    _disarm_event_subprocesses(state, scope)


def _disarm_event_subprocesses(state: RunState, scope: Scope) -> None:
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        if isinstance(wait.node.container, SubProcess):
            end_wait(state, wait)


def transaction_cancelled(state: RunState, record: r.TransactionCancelled) -> None:
    """Deactivate a transaction: from here only its compensation is executed."""
    scope = state.scopes[record.scope]
    scope.cancelled = scope.interrupted = True
    scope.activated.clear()
    compensation.drop_compensations(scope)
    for holder in (scope, scope.owner):
        if holder is not None and holder.waits is not None:
            for wait in list(holder.waits.values()):
                end_wait(state, wait)
