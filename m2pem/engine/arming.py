"""Arming catch events: which token or scope waits for which trigger.

A wait belongs to a token: at its own node (catch event, receive task, typed start event), at
a boundary event of its activity, or at an event after the event-based gateway that it is on. Or it
belongs to a scope: for the start event of an event subprocess, or, in the scope that the run began
with, for a timer or condition that begins another process. A wait ends when its trigger comes; what
catches again is armed again.

To enter a catch event is to wait for it (BPMN 2.0.2, clause 13.5.2), so that nothing thrown after
record `TokenEntered` is missed. Tokens that enter such elements are in `Execution.entered` and are
armed before any other step; all other steps come in their turn, from `Execution.queue`.

A condition (table 10.95) is evaluated when its event is armed, and after every step that wrote
data, before the next step. It fires when it is true. What catches again must first be false
(table 10.84): its wait is spent until then.
"""

from collections.abc import Iterable

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.execution import Execution, armed_triggers, definitions_of
from m2pem.engine.records import Trigger
from m2pem.engine.state import Scope, Token, TokenOrScope, Wait
from m2pem.engine.throwing import throw_error, throw_expression_error
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.elements import FlowNode, Process
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import shorten
from m2pem.mission.timers import cycle, date_us, next_round, wait_us
from m2pem.mission.values import Value

# --- arming -------------------------------------------------------------------------------------


def arm(
    x: Execution,
    holder: TokenOrScope,
    node: FlowNode,
    definition: EventDefinition,
    *,
    spent: bool = False,
    since_us: int | None = None,
) -> bool:
    """Make a token or scope wait for a trigger at `node`. False: a timer was wrong, and its error
    was thrown.

    Errors, escalations and compensation are not armed: they look for their catcher when thrown.
    A condition is evaluated after the step; `spent`: it has fired before. `since_us`: the mission
    time from which a duration counts; None: from now.
    """
    match definition:
        case SignalEventDefinition():
            await_event(x, holder, node, Trigger.SIGNAL, definition.signal.id)
        case MessageEventDefinition():
            await_event(x, holder, node, Trigger.MESSAGE, definition.message.id)
        case ConditionalEventDefinition():
            text = definition.condition.text
            await_event(x, holder, node, Trigger.CONDITION, text, spent=spent)
            x.data_changed = True
        case TimerEventDefinition():
            try:
                _arm_timer(x, holder, node, definition, since_us)
            except (ExpressionError, ExpressionSyntaxError) as error:
                reason = f"timer of {node.id}: {error}"
                if isinstance(holder, Token):
                    throw_error(x, holder, "EXPRESSION", reason, arming=not spent)
                else:
                    throw_expression_error(x, holder, reason)
                return False
    return True


def arm_events(
    x: Execution, holder: TokenOrScope, events: Iterable[FlowNode], *, since_us: int | None = None
) -> bool:
    """Arm events for a token or scope that comes to them, or that is there when a revision brings
    them. False: a timer was wrong, its error was thrown, and the events after it are not armed.

    What begins other processes is awaited by the scope that the run began with. `since_us`: as in
    `arm`.
    """
    for event in events:
        of_process = isinstance(holder, Scope) and isinstance(event.container, Process)
        for definition in armed_triggers(event) if of_process else definitions_of(event):
            if not arm(x, holder, event, definition, since_us=since_us):
                return False
    return True


def await_event(
    x: Execution,
    holder: TokenOrScope,
    node: FlowNode,
    trigger: Trigger,
    ref: str = "",
    due_us: int = 0,
    calendar: bool = False,
    left: int = 0,
    period: str = "",
    spent: bool = False,
    armed_us: int | None = None,
) -> None:
    """Record that a token or scope waits for a trigger at `node`."""
    scope = holder if isinstance(holder, Scope) else holder.scope
    x.emit(
        r.EventAwaited(
            holder.id if isinstance(holder, Token) else 0,
            x.process_of(node),
            node.id,
            scope.id,
            x.state.last_wait + 1,
            trigger,
            ref,
            due_us,
            calendar,
            left,
            period,
            spent,
            armed_us,
        )
    )


def due_after(
    x: Execution, holder: TokenOrScope, expression: Expression, since_us: int | None = None
) -> int:
    """Return the mission time, in microseconds, at which a duration ends that counts from now, or
    from the mission time `since_us`.

    Raises:
        ExpressionError, ExpressionSyntaxError: the value is no duration.
    """
    length = _value(expression, holder)
    now_us = x.state.mission_time_us(x.now_us)
    begun_us = now_us if since_us is None else since_us
    return begun_us + wait_us(length, x.now_us - (now_us - begun_us))


def _value(expression: Expression, holder: TokenOrScope) -> Value:
    value = expression.evaluate(reader(holder))
    if value is None:
        why = expression.why_null(reader(holder))
        raise ExpressionError(
            f"{shorten(expression.text.strip())!r} gives null{why and f': {why}'}"
        )
    return value


def _arm_timer(
    x: Execution,
    holder: TokenOrScope,
    node: FlowNode,
    definition: TimerEventDefinition,
    since_us: int | None,
) -> None:
    if definition.kind is TimerKind.DURATION:
        if since_us is None:
            since_us = x.state.mission_time_us(x.now_us)
        due_us = due_after(x, holder, definition.expression, since_us)
        await_event(x, holder, node, Trigger.TIMER, due_us=due_us, armed_us=since_us)
        return
    value = _value(definition.expression, holder)
    if definition.kind is TimerKind.DATE:
        await_event(x, holder, node, Trigger.TIMER, due_us=date_us(value), calendar=True)
        return
    rounds = cycle(value)
    due_us, left, period = rounds.first(x.now_us)
    if not rounds.dated:
        due_us += x.state.mission_time_us(x.now_us) - x.now_us
    await_event(x, holder, node, Trigger.TIMER, "", due_us, rounds.dated, left, period)


def arm_again(x: Execution, wait: Wait) -> None:
    """Arm a non-interrupting event again: it catches as long as its activity or scope lasts."""
    holder = wait.token or wait.scope
    if wait.trigger is not Trigger.TIMER:
        spent = wait.trigger is Trigger.CONDITION
        await_event(x, holder, wait.node, wait.trigger, wait.ref, spent=spent)
        return
    # A mission time as a date, because months are those of the calendar.
    shift_us = 0 if wait.calendar else x.state.started_us
    now_us = x.now_us if wait.calendar else x.state.mission_time_us(x.now_us) + shift_us
    due_us = wait.due_us + shift_us
    following = next_round(wait.cycle, due_us, now_us, wait.left, dated=wait.calendar)
    if following is not None:
        due_us, left, period = following
        next_us = due_us - shift_us
        await_event(x, holder, wait.node, Trigger.TIMER, "", next_us, wait.calendar, left, period)


# --- time ---------------------------------------------------------------------------------------


def next_timer(x: Execution) -> tuple[int, Wait] | None:
    """Return the timer that is due first, with its mission time in microseconds."""
    state = x.state
    found: tuple[int, int] | None = None
    offset_us = state.started_us + state.paused_total_us
    for heap, shift_us in ((state.timers, 0), (state.dates, offset_us)):
        if heap:
            candidate = (heap[0][0] - shift_us, heap[0][1])
            if found is None or candidate < found:
                found = candidate
    return None if found is None else (found[0], state.waits[found[1]])


def definition_of(wait: Wait) -> ConditionalEventDefinition:
    """Return the definition of the condition that is awaited."""
    return next(
        definition
        for definition in definitions_of(wait.node)
        if isinstance(definition, ConditionalEventDefinition)
        and definition.condition.text == wait.ref
    )


def condition_fires(x: Execution, wait: Wait) -> bool:
    """Whether an armed condition fires now; a spent one that is false may fire from now on.

    A condition that cannot be evaluated throws error EXPRESSION where it is awaited, once: not
    while an incident is open there.
    """
    holder = wait.token or wait.scope
    try:
        holds = definition_of(wait).condition.holds(reader(holder))
    except ExpressionError as error:
        reason = f"condition of {wait.node.id}: {error}"
        if wait.token is not None and wait.token.incident:
            return False
        if wait.token is not None:
            throw_error(x, wait.token, "EXPRESSION", reason)
        else:
            throw_expression_error(x, wait.scope, reason)
        return False
    ready = x.state.conditions[wait.id]
    if not holds and not ready:
        x.emit(r.ConditionReset(wait.id))
    return holds and ready


def arm_next(x: Execution) -> None:
    """Arm the element of the first token that entered, unless the token has left already."""
    token = x.entered.popleft()
    if x.is_active(token):
        x.handlers[type(token.node)].enter(x, token)


def arm_entered(x: Execution) -> None:
    """Arm the elements of all tokens that entered, before something is thrown.

    Conditions that are true may let ever more tokens enter; the batch limits these.
    """
    there = len(x.entered)
    while x.entered and (there > 0 or x.steps_left > 0):
        there -= 1
        x.steps_left -= 1
        arm_next(x)
