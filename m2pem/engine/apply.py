"""The fold: what each record does to the state. Nothing else changes a `RunState`.

An applier never decides and never fails on a journal that the engine wrote. It may rely only on
the state and the record, so that a replay by a later release gives the same state.
"""

from collections.abc import Callable
from heapq import heapify, heappop, heappush
from typing import Any

from m2pem.engine import apply_compensation as undoing
from m2pem.engine import records as r
from m2pem.engine.state import (
    Behavior,
    BehaviorPhase,
    Join,
    Letter,
    Loop,
    Prompt,
    RunState,
    RunStatus,
    Scope,
    Service,
    Token,
    Wait,
)
from m2pem.model.elements import (
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

STALE_TIMERS = 64
"""Timers that are over stay inside their heap until there are this many more than live ones."""


def apply(state: RunState, record: r.Record) -> None:
    """Fold one record into the state."""
    state.seq += 1
    _APPLIERS[type(record)](state, record)


def _node(state: RunState, element: str) -> FlowNode:
    node = state.mission.elements[element]
    assert isinstance(node, FlowNode)
    return node


def _is_join(node: FlowNode) -> bool:
    if isinstance(node, ComplexGateway):
        return True
    return isinstance(node, (ParallelGateway, InclusiveGateway)) and len(node.incoming) > 1


# --- the run ------------------------------------------------------------------------------------


def _run_started(state: RunState, record: r.RunStarted) -> None:
    state.status = RunStatus.RUNNING
    state.started_us = record.started_us


def _run_claimed(state: RunState, record: r.RunClaimed) -> None:
    state.epoch = record.epoch


def _run_paused(state: RunState, record: r.RunPaused) -> None:
    state.status = RunStatus.PAUSED
    state.paused_at_us = record.at_us


def _run_resumed(state: RunState, record: r.RunResumed) -> None:
    state.status = RunStatus.RUNNING
    state.paused_total_us += record.at_us - state.paused_at_us
    state.deferred.clear()


def _run_ended(state: RunState, record: r.RunEnded) -> None:
    state.status = RunStatus.ENDED
    state.outcome = record.outcome
    state.detail = record.detail
    state.mailbox.clear()
    state.deferred.clear()
    state.yielded = ()


def _run_yielded(state: RunState, record: r.RunYielded) -> None:
    state.yielded = record.steps


def _nothing(state: RunState, record: r.Record) -> None:
    pass


def _input_deferred(state: RunState, record: r.InputDeferred) -> None:
    state.deferred.append(record.input)


def _input_seen(state: RunState, record: r.InputSeen) -> None:
    state.seen[record.id] = None


def _control_taken(state: RunState, record: r.OperatorTookControl) -> None:
    state.taken[record.resource] = record.by


def _control_returned(state: RunState, record: r.OperatorGaveControlBack) -> None:
    del state.taken[record.resource]


def _geometry_received(state: RunState, record: r.GeometryReceived) -> None:
    state.geometries[record.name] = record.geometry


# --- scopes and tokens --------------------------------------------------------------------------


def _scope_opened(state: RunState, record: r.ScopeOpened) -> None:
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


def _scope_closed(state: RunState, record: r.ScopeClosed) -> None:
    scope = state.scopes.pop(record.scope)
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        _end_wait(state, wait)
    undoing.settle_owner(scope, record)


def _is_choice(scope: Scope, node: FlowNode) -> bool:
    if not isinstance(scope.container, AdHocSubProcess) or scope.loop is not None:
        return False
    return node in scope.container.entries


def _scope_interrupted(state: RunState, record: r.ScopeInterrupted) -> None:
    scope = state.scopes[record.scope]
    scope.interrupted = True
    undoing.drop_compensations(scope)
    _disarm_event_subprocesses(state, scope)


def _scope_completing(state: RunState, record: r.ScopeCompleting) -> None:
    scope = state.scopes[record.scope]
    scope.completing = True
    _disarm_event_subprocesses(state, scope)


def _disarm_event_subprocesses(state: RunState, scope: Scope) -> None:
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        if isinstance(wait.node.container, SubProcess):
            _end_wait(state, wait)


def _transaction_cancelled(state: RunState, record: r.TransactionCancelled) -> None:
    """The transaction is not active any more: nothing but its rollback can happen to it."""
    scope = state.scopes[record.scope]
    scope.cancelled = scope.interrupted = True
    undoing.drop_compensations(scope)
    for holder in (scope, scope.owner):
        if holder is not None and holder.waits is not None:
            for wait in list(holder.waits.values()):
                _end_wait(state, wait)


def _token_entered(state: RunState, record: r.TokenEntered) -> None:
    node = _node(state, record.element)
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
    node = _node(state, record.element)
    used = tuple(flow for flow in node.incoming if flow.id in record.flows)
    state.scopes[record.scope].activated[node] = used


def _gateway_reset(state: RunState, record: r.GatewayReset) -> None:
    del state.scopes[record.scope].activated[_node(state, record.element)]


def _activities_chosen(state: RunState, record: r.ActivitiesChosen) -> None:
    state.scopes[record.scope].chosen = [_node(state, element) for element in record.elements]


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
            _end_wait(state, wait)
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


# --- behaviors, prompts, services ---------------------------------------------------------------


def _behavior_requested(state: RunState, record: r.BehaviorRequested) -> None:
    state.last_behavior += 1
    state.behaviors[record.behavior] = Behavior(
        record.behavior,
        record.token,
        record.element,
        record.process,
        record.scope,
        record.type,
        record.name,
        record.resources,
        record.roles,
        record.parameters,
        record.preempts,
    )
    for resource in record.resources:
        state.held.setdefault(resource, []).append(record.behavior)
    state.tokens[record.token].behavior = record.behavior


def _behavior_progressed(state: RunState, record: r.BehaviorProgressed) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.number = record.number
    behavior.state = record.state
    if record.native_ref is not None:
        behavior.native_ref = record.native_ref


def _behavior_cancel_requested(state: RunState, record: r.BehaviorCancelRequested) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.CANCELLING
    _forget_behavior(state, behavior)


def _behavior_unsettled(state: RunState, record: r.BehaviorUnsettled) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.UNSETTLED
    behavior.state = record.state


def _behavior_continued(state: RunState, record: r.BehaviorContinued) -> None:
    state.behaviors[record.behavior].phase = BehaviorPhase.ACTIVE


def _behavior_restarted(state: RunState, record: r.BehaviorRestarted) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.ACTIVE
    behavior.state = None
    behavior.number = 0
    behavior.native_ref = None


def _behavior_ended(state: RunState, record: r.BehaviorEnded) -> None:
    behavior = state.behaviors.pop(record.behavior)
    for resource in behavior.resources:
        holders = state.held[resource]
        holders.remove(behavior.id)
        if not holders:
            del state.held[resource]
    _forget_behavior(state, behavior)


def _forget_behavior(state: RunState, behavior: Behavior) -> None:
    token = state.tokens.get(behavior.token)
    if token is not None and token.behavior == behavior.id:
        token.behavior = ""


def _prompt_opened(state: RunState, record: r.PromptOpened) -> None:
    token = state.tokens[record.token]
    state.last_prompt += 1
    state.prompts[record.prompt] = Prompt(
        record.prompt, token, record.text, record.decisions, record.role, record.behavior
    )
    token.prompt = record.prompt


def _prompt_ended(state: RunState, record: r.PromptAnswered | r.PromptWithdrawn) -> None:
    state.prompts.pop(record.prompt).token.prompt = ""


def _service_requested(state: RunState, record: r.ServiceRequested) -> None:
    token = state.tokens[record.token]
    state.last_service += 1
    state.services[record.service] = Service(
        record.service, token, record.name, record.roles, record.properties
    )
    token.service = record.service


def _service_ended(state: RunState, record: r.ServiceEnded | r.ServiceWithdrawn) -> None:
    state.services.pop(record.service).token.service = ""


# --- data and events ----------------------------------------------------------------------------


def _data_written(state: RunState, record: r.DataWritten) -> None:
    if not record.own:
        store = state.scopes[record.store].data if record.store else state.shared.data
        store[record.key] = record.value
        return
    token = state.tokens[record.own]
    if token.own is None:
        token.own = {}
    token.own[record.key] = record.value


def _event_awaited(state: RunState, record: r.EventAwaited) -> None:
    holder: Token | Scope
    if record.token:
        holder = token = state.tokens[record.token]
        scope = token.scope
    else:
        holder, token, scope = state.scopes[record.scope], None, state.scopes[record.scope]
    wait = Wait(
        record.wait,
        token,
        scope,
        _node(state, record.element),
        record.trigger,
        record.ref,
        record.due_us,
        record.calendar,
        record.left,
        record.cycle,
    )
    state.last_wait = record.wait
    state.waits[wait.id] = wait
    if holder.waits is None:
        holder.waits = {}
    holder.waits[wait.id] = wait
    if wait.trigger is r.Trigger.TIMER:
        heappush(state.dates if wait.calendar else state.timers, (wait.due_us, wait.id))
    elif wait.trigger is r.Trigger.CONDITION:
        state.conditions[wait.id] = not record.spent
    else:
        state.catchers.setdefault((wait.trigger, wait.ref), {})[wait.id] = wait


def _end_wait(state: RunState, wait: Wait) -> None:
    del state.waits[wait.id]
    waits = wait.token.waits if wait.token is not None else wait.scope.waits
    assert waits is not None
    del waits[wait.id]
    if wait.trigger is r.Trigger.TIMER:
        heap = state.dates if wait.calendar else state.timers
        while heap and heap[0][1] not in state.waits:
            heappop(heap)
        if len(heap) > 2 * len(state.waits) + STALE_TIMERS:
            heap[:] = [entry for entry in heap if entry[1] in state.waits]
            heapify(heap)
        return
    if wait.trigger is r.Trigger.CONDITION:
        del state.conditions[wait.id]
        return
    key = (wait.trigger, wait.ref)
    catchers = state.catchers[key]
    del catchers[wait.id]
    if not catchers:
        del state.catchers[key]


def _event_triggered(state: RunState, record: r.EventTriggered) -> None:
    wait = state.waits[record.wait]
    _end_wait(state, wait)
    if record.kept:
        letters = state.mailbox[wait.ref]
        letters.pop(record.letter)
        if not letters:
            del state.mailbox[wait.ref]


def _condition_reset(state: RunState, record: r.ConditionReset) -> None:
    state.conditions[record.wait] = True


def _message_thrown(state: RunState, record: r.MessageThrown) -> None:
    if record.kept:
        state.mailbox.setdefault(record.message, []).append(Letter(record.data, record.keys))


_APPLIERS: dict[type, Callable[[RunState, Any], None]] = {
    r.RunStarted: _run_started,
    r.RunClaimed: _run_claimed,
    r.RunPaused: _run_paused,
    r.RunResumed: _run_resumed,
    r.RunEnded: _run_ended,
    r.RunYielded: _run_yielded,
    r.InputIgnored: _nothing,
    r.InputDeferred: _input_deferred,
    r.InputSeen: _input_seen,
    r.OperatorTookControl: _control_taken,
    r.OperatorGaveControlBack: _control_returned,
    r.GeometryReceived: _geometry_received,
    r.ScopeOpened: _scope_opened,
    r.ScopeClosed: _scope_closed,
    r.ScopeInterrupted: _scope_interrupted,
    r.ScopeCompleting: _scope_completing,
    r.TokenEntered: _token_entered,
    r.TokenLeft: _token_left,
    r.InstanceOutput: _instance_output,
    r.FlowTaken: _nothing,
    r.ActivitiesChosen: _activities_chosen,
    r.TokensGathered: _tokens_gathered,
    r.GatewayActivated: _gateway_activated,
    r.GatewayReset: _gateway_reset,
    r.BehaviorRequested: _behavior_requested,
    r.BehaviorProgressed: _behavior_progressed,
    r.BehaviorCancelRequested: _behavior_cancel_requested,
    r.BehaviorUnsettled: _behavior_unsettled,
    r.BehaviorContinued: _behavior_continued,
    r.BehaviorRestarted: _behavior_restarted,
    r.BehaviorEnded: _behavior_ended,
    r.PromptOpened: _prompt_opened,
    r.PromptAnswered: _prompt_ended,
    r.PromptWithdrawn: _prompt_ended,
    r.ServiceRequested: _service_requested,
    r.ServiceEnded: _service_ended,
    r.ServiceWithdrawn: _service_ended,
    r.DataWritten: _data_written,
    r.EventAwaited: _event_awaited,
    r.EventTriggered: _event_triggered,
    r.ConditionReset: _condition_reset,
    r.SignalThrown: _nothing,
    r.MessageThrown: _message_thrown,
    r.EscalationThrown: _nothing,
    r.ErrorThrown: _nothing,
    r.CompensationEnabled: undoing.compensation_enabled,
    r.CompensationTriggered: undoing.compensation_triggered,
    r.CompensationBegan: undoing.compensation_began,
    r.CompensationEnded: undoing.compensation_ended,
    r.ScopeReopened: undoing.scope_reopened,
    r.TransactionCancelled: _transaction_cancelled,
}
