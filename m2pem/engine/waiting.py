"""Catch events: arming them, and what happens when their trigger comes.

A wait belongs to a token: at its own node (catch event, receive task, typed start) or at a boundary
event of the activity that it is on. When it is over it is gone; what catches again is armed again.
"""

from collections.abc import Callable

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.execution import Execution
from m2pem.engine.interruption import divert, throw_error
from m2pem.engine.records import TokenOutcome, Trigger
from m2pem.engine.state import Token, Wait
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.model.duration import cycle, date_us, duration_us
from m2pem.model.elements import Activity, BoundaryEvent, FlowNode, StartEvent
from m2pem.model.events import (
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.model.expression import Expression
from m2pem.model.values import Value

WHEN_TRIGGERED: dict[type[FlowNode], Callable[[Execution, Token], None]] = {}
"""What a wait at a token's own node leads to, by kind of node; filled by the handlers."""


class _NotATimeError(Exception):
    """A timer's expression gave something that is not a time."""


# --- arming -------------------------------------------------------------------------------------


def arm(x: Execution, token: Token, node: FlowNode, definition: EventDefinition) -> bool:
    """Have a token wait for a trigger at `node`. False: a wrong timer's error was thrown."""
    match definition:
        case SignalEventDefinition():
            await_event(x, token, node, Trigger.SIGNAL, definition.signal.id)
        case MessageEventDefinition():
            await_event(x, token, node, Trigger.MESSAGE, definition.message.id)
        case TimerEventDefinition():
            try:
                _arm_timer(x, token, node, definition)
            except (ExpressionError, ExpressionSyntaxError, _NotATimeError) as error:
                throw_error(x, token, "EXPRESSION", f"timer of {node.id}: {error}")
                return False
    return True


def await_event(
    x: Execution,
    token: Token,
    node: FlowNode,
    trigger: Trigger,
    ref: str = "",
    due_us: int = 0,
    calendar: bool = False,
    left: int = 0,
    period: str = "",
) -> None:
    """State that a token waits for a trigger at `node`."""
    x.emit(
        r.EventAwaited(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            x.state.last_wait + 1,
            trigger,
            ref,
            due_us,
            calendar,
            left,
            period,
        )
    )


def due_after(x: Execution, token: Token, expression: Expression) -> int:
    """Mission time, in microseconds, at which a duration that starts now is over.

    Raises:
        ExpressionError, ExpressionSyntaxError: it is no duration.
    """
    text = expression.evaluate(reader(token.scope))
    if not isinstance(text, str):
        raise ExpressionError(f"{expression.text!r} gives {text!r}, not an ISO 8601 duration")
    return x.state.mission_time_us(x.now_us) + duration_us(text, x.now_us)


def _arm_timer(
    x: Execution, token: Token, node: FlowNode, definition: TimerEventDefinition
) -> None:
    if definition.kind is TimerKind.DURATION:
        due_us = due_after(x, token, definition.expression)
        await_event(x, token, node, Trigger.TIMER, due_us=due_us)
        return
    text = definition.expression.evaluate(reader(token.scope))
    if not isinstance(text, str):
        raise _NotATimeError(f"{definition.expression.text!r} gives {text!r}, not an ISO 8601 time")
    if definition.kind is TimerKind.DATE:
        await_event(x, token, node, Trigger.TIMER, due_us=date_us(text), calendar=True)
        return
    rounds = cycle(text)
    left = -1 if rounds.repetitions is None else rounds.repetitions - 1
    if rounds.start_us is not None:
        due_us = rounds.first_us(x.now_us)
        await_event(x, token, node, Trigger.TIMER, "", due_us, True, left, rounds.period)
    else:
        due_us = x.state.mission_time_us(x.now_us) + duration_us(rounds.period, x.now_us)
        await_event(x, token, node, Trigger.TIMER, "", due_us, False, left, rounds.period)


def arm_boundary(x: Execution, token: Token, activity: Activity) -> bool:
    """Arm the boundary events of the activity that a token has entered.

    Errors and escalations are not armed: they look for their catcher. False: the token has left
    already, because a timer was wrong or a message had been kept.
    """
    for boundary in activity.boundary:
        for definition in boundary.definitions:
            if not arm(x, token, boundary, definition):
                return False
    return collect_letters(x, token)


def collect_letters(x: Execution, token: Token) -> bool:
    """Let a token that waits for messages have those kept for it. False: it has left with one."""
    found = bool(x.state.mailbox)
    while found and token.waits is not None:
        found = False
        for wait in list(token.waits.values()):
            letters = x.state.mailbox.get(wait.ref) if wait.trigger is Trigger.MESSAGE else None
            if letters:
                found = True
                trigger(x, wait, letters[0], kept=True)
                if x.state.tokens.get(token.id) is not token:
                    return False
    return True


# --- triggering ---------------------------------------------------------------------------------


def trigger(x: Execution, wait: Wait, data: dict[str, Value], *, kept: bool = False) -> None:
    """What a token waited for has come: a catch event goes on, a boundary event is entered."""
    x.emit(r.EventTriggered(wait.id, kept))
    token, node = wait.token, wait.node
    if node is token.node:
        x.write_all(token, data)
        WHEN_TRIGGERED[type(node)](x, token)
        return
    assert isinstance(node, BoundaryEvent)
    if node.interrupting:
        x.write_all(divert(x, token, node, TokenOutcome.INTERRUPTED), data)
        return
    _arm_again(x, wait)
    x.write_all(x.spawn(node, token.scope), data)


def _arm_again(x: Execution, wait: Wait) -> None:
    """A boundary event that does not interrupt catches as long as its activity lasts."""
    if wait.trigger is not Trigger.TIMER:
        await_event(x, wait.token, wait.node, wait.trigger, wait.ref)
    elif wait.left != 0:
        left = wait.left - 1 if wait.left > 0 else -1
        at_us = wait.due_us + (0 if wait.calendar else x.state.started_us)
        try:
            due_us = wait.due_us + duration_us(wait.cycle, at_us)
        except ExpressionSyntaxError:  # the next round is beyond the calendar: it never comes
            return
        await_event(
            x, wait.token, wait.node, Trigger.TIMER, "", due_us, wait.calendar, left, wait.cycle
        )


def throw_signal(x: Execution, signal: str, data: dict[str, Value]) -> bool:
    """Reach every catcher in the run, in the order they were armed. True: there was one."""
    waits = list(x.state.catchers.get((Trigger.SIGNAL, signal), {}).values())
    for wait in waits:
        if wait.id in x.state.waits:
            trigger(x, wait, data)
    started = False
    for start in x.triggered_starts:
        for definition in start.definitions:
            if isinstance(definition, SignalEventDefinition) and definition.signal.id == signal:
                _instance(x, start, data)
                started = True
    return bool(waits) or started


def message_receiver(x: Execution, message: str) -> Wait | StartEvent | None:
    """Who gets a message: the one that has waited longest, else a process that it starts."""
    waits = x.state.catchers.get((Trigger.MESSAGE, message))
    if waits:
        return next(iter(waits.values()))
    for start in x.triggered_starts:
        for definition in start.definitions:
            if isinstance(definition, MessageEventDefinition) and definition.message.id == message:
                return start
    return None


def deliver(x: Execution, receiver: Wait | StartEvent, data: dict[str, Value]) -> None:
    """Hand a message over."""
    if isinstance(receiver, Wait):
        trigger(x, receiver, data)
    else:
        _instance(x, receiver, data)


def _instance(x: Execution, start: StartEvent, data: dict[str, Value]) -> None:
    """One instance of a process, from the start event that was triggered."""
    process = start.container
    number = x.state.last_scope + 1
    x.emit(r.ScopeOpened(number, process.id, process.id))
    scope = x.state.scopes[number]
    x.write_all(x.spawn(start, scope), data)


# --- time ---------------------------------------------------------------------------------------


def next_timer(x: Execution) -> tuple[int, Wait] | None:
    """The timer that is due first, with its mission time."""
    state = x.state
    found: tuple[int, int] | None = None
    offset_us = state.started_us + state.paused_total_us
    for heap, shift_us in ((state.timers, 0), (state.dates, offset_us)):
        if heap:
            candidate = (heap[0][0] - shift_us, heap[0][1])
            if found is None or candidate < found:
                found = candidate
    return None if found is None else (found[0], state.waits[found[1]])
