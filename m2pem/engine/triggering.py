"""What follows when the trigger of a catch event comes; signals and messages.

A signal reaches every catcher in the run. A message goes to one receiver, the one that has waited
longest of those that it is for (BPMN 2.0.2, clause 8.4.11; `m2pem.engine.correlation`). A message
that nothing waits for yet is kept for the next receiver; one that nothing in the mission receives,
for what a revision may bring.
"""

from typing import TypeAlias

from m2pem.engine import records as r
from m2pem.engine.arming import arm, arm_again, arm_events, condition_fires, definition_of
from m2pem.engine.correlation import keys_of, matches, remember_keys
from m2pem.engine.data_flow import payload, receive_payload
from m2pem.engine.execution import Execution, armed_triggers, definitions_of, received_messages
from m2pem.engine.records import Trigger
from m2pem.engine.scopes import move_to_boundary, start_event_subprocess
from m2pem.engine.state import Scope, Token, TokenOrScope, Wait
from m2pem.engine.throwing import throw_error
from m2pem.errors import ExpressionError
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    Event,
    EventBasedGateway,
    FlowNode,
    Process,
    ReceiveTask,
    StartEvent,
)
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.values import Value


def arm_boundary(x: Execution, token: Token, activity: Activity) -> bool:
    """Arm the boundary events of the activity that a token has entered.

    False: the token has left already, because a timer was wrong, a message had been kept or a
    condition was true.
    """
    return (
        arm_events(x, token, activity.boundary)
        and take_kept_messages(x, token)
        and fire_true_conditions(x, token)
    )


def arm_event_subprocesses(x: Execution, scope: Scope) -> bool:
    """Arm the start events of a scope's event subprocesses (clause 13.5.4).

    False: a timer was wrong, and its error has been thrown.
    """
    subprocesses = scope.container.event_subprocesses
    return arm_events(x, scope, [start for each in subprocesses for start in each.starts])


def arm_triggered_timers(x: Execution, root: Scope) -> bool:
    """Arm the timer starts of the processes that get an instance for each trigger.

    They last as long as the process that the run began with. False: a timer was wrong, and its
    error has been thrown.
    """
    for start in x.triggered_starts:
        for definition in armed_triggers(start):
            if isinstance(definition, TimerEventDefinition) and not arm(x, root, start, definition):
                return False
    return True


def take_kept_messages(x: Execution, holder: TokenOrScope) -> bool:
    """Trigger the message events of a token or scope for which a message was kept.

    False: the token has left with a message.
    """
    found = bool(x.state.kept_messages)
    while found and holder.waits is not None:
        found = False
        for wait in list(holder.waits.values()):
            number = _kept_message_for(x, wait) if wait.id in x.state.waits else None
            if number is not None:
                found = True
                kept = x.state.kept_messages[wait.ref][number]
                trigger(x, wait, kept.data, kept.keys, kept_index=number)
                if isinstance(holder, Token) and x.state.tokens.get(holder.id) is not holder:
                    return False
    return True


def deliver_kept_messages(x: Execution) -> None:
    """Deliver the kept messages that have a receiver in a new version of the mission: to what waits
    for them, the longest first, else to the processes that they start."""
    if not x.state.kept_messages:
        return
    for wait in list(x.state.waits.values()):
        if wait.id in x.state.waits:
            take_kept_messages(x, wait.token or wait.scope)
    for message in list(x.state.kept_messages):
        found = _started_by(x, message)
        while found is not None and (kept := x.state.kept_messages.get(message)):
            _start_process(x, *found, kept[0].data, kept[0].keys, kept_message=message)


def _kept_message_for(x: Execution, wait: Wait) -> int | None:
    """Return the index of the first kept message that a wait matches."""
    if wait.trigger is not Trigger.MESSAGE:
        return None
    for number, kept in enumerate(x.state.kept_messages.get(wait.ref, ())):
        if matches(x, wait.ref, kept.keys, wait.token or wait.scope):
            return number
    return None


# --- conditions ---------------------------------------------------------------------------------


def arm_conditional_starts(x: Execution, root: Scope) -> None:
    """Arm the conditions that begin the other processes of the file.

    A process has no data before it begins: the conditions read the data of the process that the
    run began with, and are awaited as long as that lasts (docs/missions.md).
    """
    for start in x.triggered_starts:
        for definition in definitions_of(start):
            if isinstance(definition, ConditionalEventDefinition):
                arm(x, root, start, definition)


def fire_true_conditions(x: Execution, token: Token) -> bool:
    """Fire the true conditions that a token waits for, in the order in which they were armed.

    False: the token has left.
    """
    for number in list(token.waits or ()):
        if number in x.state.conditions and condition_fires(x, x.state.waits[number]):
            trigger(x, x.state.waits[number], {})
    return x.is_active(token)


# --- triggering ---------------------------------------------------------------------------------


def trigger(
    x: Execution,
    wait: Wait,
    data: dict[str, Value],
    keys: dict[str, Value] | None = None,
    *,
    kept_index: int | None = None,
) -> None:
    """Trigger an awaited event: a catch event is left, a boundary event is entered.

    `keys`: the correlation keys of a message. `kept_index`: the index of the kept message that it
    is.
    """
    x.emit(r.EventTriggered(wait.id, kept_index is not None, kept_index or 0))
    token, node = wait.token, wait.node
    if keys and token is not None:
        remember_keys(x, token, keys)
    if token is None:
        _trigger_in_scope(x, wait, data, keys or {})
    elif node is token.node:
        if receive_payload(x, token, data) and not _awaits_more_triggers(node, token.waits):
            x.handlers[type(node)].trigger(x, token)
    elif isinstance(node, BoundaryEvent):
        _trigger_boundary(x, wait, token, node, data)
    else:
        _trigger_of_gateway(x, token, node, data)


def _awaits_more_triggers(node: FlowNode, waits: dict[int, Wait] | None) -> bool:
    """Whether a parallel multiple event must still wait for others of its triggers (10.5.1)."""
    if not isinstance(node, Event) or not node.parallel_multiple:
        return False
    return any(wait.node is node for wait in (waits or {}).values())


def _arm_again(x: Execution, wait: Wait) -> None:
    """Arm a non-interrupting event again; a parallel multiple event, with all its triggers."""
    node = wait.node
    if isinstance(node, Event) and node.parallel_multiple:
        for definition in node.definitions:
            if not arm(x, wait.token or wait.scope, node, definition, spent=True):
                return
    else:
        arm_again(x, wait)


def _trigger_boundary(
    x: Execution, wait: Wait, token: Token, node: BoundaryEvent, data: dict[str, Value]
) -> None:
    if _awaits_more_triggers(node, token.waits):
        x.write_all(token, data)
    elif node.interrupting:
        receive_payload(x, move_to_boundary(x, token, node), data)
    else:
        _arm_again(x, wait)
        receive_payload(x, x.spawn(node, token.scope), data)


def _trigger_in_scope(
    x: Execution, wait: Wait, data: dict[str, Value], keys: dict[str, Value]
) -> None:
    """Trigger the start event of an event subprocess, or a timer or condition that begins a
    process."""
    node = wait.node
    if isinstance(node.container, Process):
        arm_again(x, wait)
        _start_process(x, node, _definition_of(wait), data, keys)
        return
    assert isinstance(node, StartEvent)
    if _awaits_more_triggers(node, wait.scope.waits):
        x.write_in(wait.scope, node, data)
        return
    if not node.interrupting:
        _arm_again(x, wait)
    begun = start_event_subprocess(x, wait.scope, node)
    remember_keys(x, begun, keys)
    receive_payload(x, begun, data)


def _definition_of(wait: Wait) -> EventDefinition:
    """Return the definition of a condition or timer that begins a process."""
    if wait.trigger is Trigger.CONDITION:
        return definition_of(wait)
    definitions = definitions_of(wait.node)
    return next(each for each in definitions if isinstance(each, TimerEventDefinition))


# --- event-based gateways -----------------------------------------------------------------------


def await_events_of_gateway(x: Execution, token: Token, but: FlowNode | None = None) -> bool:
    """Make a token on an event-based gateway wait for the events after it, except `but`.

    False: a timer was wrong, and its error was thrown.
    """
    targets = [flow.target for flow in token.node.outgoing]
    return arm_events(x, token, [each for each in targets if each is not but])


def _trigger_of_gateway(x: Execution, token: Token, node: FlowNode, data: dict[str, Value]) -> None:
    """Move a token from an event-based gateway to the event that has occurred (13.4.4).

    After a parallel one, which begins a process, each event gets a token; the last event gets the
    gateway's own.
    """
    gateway = token.node
    assert isinstance(gateway, EventBasedGateway)
    if _awaits_more_triggers(node, token.waits):
        x.write_all(token, data)
        return
    flow = next(flow for flow in gateway.outgoing if flow.target is node)
    if gateway.parallel and token.waits:
        number = x.state.last_token + 1
        x.emit(r.FlowTaken(number, x.process_of(gateway), gateway.id, token.scope.id, flow.id))
        moved = x.enter(number, node, token.scope, flow)
    else:
        x.proceed(token, [flow])
        moved = x.state.tokens[token.id]
    if receive_payload(x, moved, data):
        x.handlers[type(node)].trigger(x, moved)


# --- signals and messages -----------------------------------------------------------------------


def throw_signal(x: Execution, signal: str, data: dict[str, Value]) -> bool:
    """Trigger every catcher of a signal, in the order of arming. True: there was one."""
    waits = list(x.state.catchers.get((Trigger.SIGNAL, signal), {}).values())
    for wait in waits:
        if wait.id in x.state.waits:
            trigger(x, wait, data)
    started = False
    for start in x.triggered_starts:
        for definition in definitions_of(start):
            if isinstance(definition, SignalEventDefinition) and definition.signal.id == signal:
                _start_process(x, start, definition, data, {})
                started = True
    return bool(waits) or started


def message_receiver(x: Execution, message: str, keys: dict[str, Value]) -> "Wait | _Start | None":
    """Return the receiver of a message: the longest wait that matches, else a process to start."""
    for wait in x.state.catchers.get((Trigger.MESSAGE, message), {}).values():
        if not keys or matches(x, message, keys, wait.token or wait.scope):
            return wait
    return _started_by(x, message)


_Start: TypeAlias = tuple[FlowNode, EventDefinition]
"""An element that begins a process, and the trigger by which it does."""


def _started_by(x: Execution, message: str) -> _Start | None:
    for start in x.triggered_starts:
        for definition in definitions_of(start):
            if isinstance(definition, MessageEventDefinition) and definition.message.id == message:
                return start, definition
    return None


def deliver(
    x: Execution, receiver: Wait | _Start, data: dict[str, Value], keys: dict[str, Value]
) -> None:
    """Deliver a message to its receiver."""
    if isinstance(receiver, Wait):
        trigger(x, receiver, data, keys)
    else:
        _start_process(x, *receiver, data, keys)


def _start_process(
    x: Execution,
    start: FlowNode,
    came: EventDefinition,
    data: dict[str, Value],
    keys: dict[str, Value],
    *,
    kept_message: str = "",
) -> None:
    """Start an instance of a process at the element whose trigger has occurred (clause 13.2).

    Of several triggers that must all occur, the others are awaited in the instance. `kept_message`:
    the trigger is the first of the kept messages of that id.
    """
    process = start.container
    number = x.state.last_scope + 1
    x.emit(r.ScopeOpened(number, process.id, process.id, message=kept_message))
    scope = x.state.scopes[number]
    _enter_start(x, scope, start, came, data, keys)
    # Last: its event subprocesses may read the data that came.
    gone = x.state.scopes.get(number) is not scope
    if not gone and not scope.interrupted and arm_event_subprocesses(x, scope):
        take_kept_messages(x, scope)


def _enter_start(
    x: Execution,
    scope: Scope,
    start: FlowNode,
    came: EventDefinition,
    data: dict[str, Value],
    keys: dict[str, Value],
) -> None:
    if isinstance(start, StartEvent):
        token = x.spawn(start, scope)
        remember_keys(x, token, keys)
        receive_payload(x, token, data)
        others = start.definitions if start.parallel_multiple else ()
        for definition in others:
            if definition is not came and not arm(x, token, start, definition):
                return
        take_kept_messages(x, token)
    elif isinstance(start, ReceiveTask) and start.instantiate:
        token = x.spawn(start, scope)
        remember_keys(x, token, keys)
        if receive_payload(x, token, data):
            x.handlers[type(start)].trigger(x, token)
    else:
        gateway = start.incoming[0].source
        assert isinstance(gateway, EventBasedGateway)
        token = x.spawn(gateway, scope)
        remember_keys(x, token, keys)
        if not gateway.parallel or await_events_of_gateway(x, token, start):
            _trigger_of_gateway(x, token, start, data)
            if x.state.tokens.get(token.id) is token:
                take_kept_messages(x, token)


def send(x: Execution, token: Token, message: str) -> None:
    """Throw a message, with its data inputs, from the element that a token is on."""
    node = token.node
    data = payload(x, token)
    if data is None:
        return
    try:
        keys = keys_of(x, message, data, token)
    except ExpressionError as error:
        throw_error(x, token, "EXPRESSION", f"correlation of message {message}: {error}")
        return
    remember_keys(x, token, keys)
    receiver = message_receiver(x, message, keys)
    kept = receiver is None and _is_kept(x, message)
    x.emit(
        r.MessageThrown(
            message,
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            kept=kept,
            data=data if kept else {},
            keys=keys,
        )
    )
    if receiver is not None:
        deliver(x, receiver, data, keys)


UNRECEIVED = 1000
"""So many messages of one id are kept that nothing in the mission receives: a revision may bring
what does."""


def _is_kept(x: Execution, message: str) -> bool:
    there = x.state.kept_messages.get(message, ())
    return message in received_messages(x.mission) or len(there) < UNRECEIVED


def receive(x: Execution, message: str, data: dict[str, Value], by: str) -> None:
    """Receive a message from outside that some element of the mission catches."""
    try:
        keys = keys_of(x, message, data, None)
    except ExpressionError as error:
        x.ignore(f"message {message} cannot be matched: {error}")
        return
    receiver = message_receiver(x, message, keys)
    kept = receiver is None
    x.emit(r.MessageThrown(message, by=by, kept=kept, data=data if kept else {}, keys=keys))
    if receiver is not None:
        deliver(x, receiver, data, keys)
