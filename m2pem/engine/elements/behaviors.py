"""Behaviors of vehicles, payloads and teams, from request to end (paper, section 4.2).

A task requests a behavior. A terminal report of its arbiter completes the task or throws its error.
A fault of one of its resources throws that error. After a restart, an operator or the resume policy
says what becomes of a behavior that is not as it was (docs/architecture.md, section 5).

When an operator takes control of a vehicle, its behavior ends with error TAKEN_OVER, so that the
mission can wait or go on another way, as its author drew it. Until the operator releases control,
a behavior for the vehicle is refused.
"""

from dataclasses import replace

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.arming import await_event
from m2pem.engine.data import reader
from m2pem.engine.elements.activities import complete
from m2pem.engine.elements.allocations import (
    allocation_timed_out,
    emit_behavior,
    refusal_of,
    request_allocation,
    store_chosen,
)
from m2pem.engine.elements.losses import end_work, what_is_done
from m2pem.engine.execution import Execution
from m2pem.engine.keeping import end_keeping
from m2pem.engine.records import RequestOutcome, RunOutcome, Trigger
from m2pem.engine.remaining import is_nothing_left, note_remaining
from m2pem.engine.scopes import end_run
from m2pem.engine.state import Behavior, BehaviorPhase, RunState, Token
from m2pem.engine.throwing import catcher_of_error, throw_error
from m2pem.engine.triggering import throw_signal
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.space import may_wait_for_space
from m2pem.mission.behavior import Behavior as BehaviorOfTask
from m2pem.mission.behavior import OnLoss
from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from m2pem.mission.elements import Event
from m2pem.mission.expression import Expression
from m2pem.mission.losses import BATTERY_LOW, PREEMPTED, TAKEN_OVER, UNAVAILABLE
from m2pem.mission.timers import duration_us
from m2pem.mission.values import Value
from m2pem.units import Dimension, UnitError, quantity

YEAR_10000_US = 253_402_300_800_000_000
"""The end of the calendar, in microseconds since the Unix epoch: no timer runs longer."""


def request_behavior(x: Execution, token: Token, behavior: BehaviorOfTask) -> None:
    """Request a behavior from the arbiters; their terminal report completes the task.

    A resource that another behavior holds, and that is not being cancelled, is
    RESOURCE_UNAVAILABLE.
    """
    parameters = _evaluate(x, token, behavior)
    if parameters is None:
        return
    if is_nothing_left(behavior, parameters):
        complete(x, token)
        return
    if token.lost_work is not None:  # an operator has it start again, with what was left
        parameters |= token.lost_work.remaining
    if not behavior.roles and behavior.name == "hold":
        _hold_for(x, token, parameters.get("duration"))
        return
    if token.replacements is not None:
        _request_with_replacements(x, token, behavior, token.replacements, parameters)
        return
    if behavior.allocated_at_start:
        request_allocation(x, token, behavior, parameters)
        return
    try:
        allocation = allocate(behavior, x.fleet)
    except AllocationError as error:
        throw_error(x, token, UNAVAILABLE, str(error))
        return
    if not allocation.resources:
        throw_error(x, token, UNAVAILABLE, f"no resource is allocated to {behavior.name}")
    elif refusal := refusal_of(x, token, allocation.resources):
        throw_error(x, token, UNAVAILABLE, refusal)
    elif may_wait_for_space(x.fleet, behavior.type, behavior.name, allocation.resources):
        request_allocation(x, token, behavior, parameters)
    else:
        emit_behavior(x, token, behavior, allocation.resources, allocation.roles, parameters)


def _request_with_replacements(
    x: Execution,
    token: Token,
    behavior: BehaviorOfTask,
    roles: dict[str, tuple[str, ...]],
    parameters: dict[str, Value],
) -> None:
    """Request a behavior that starts again with the resources that an operator has chosen. The
    roles of which the operator said nothing are filled as at the start of the task."""
    resources = tuple(dict.fromkeys(each for chosen in roles.values() for each in chosen))
    if refusal := refusal_of(x, token, resources):
        throw_error(x, token, UNAVAILABLE, refusal)
        return
    if any(role.name not in roles and not role.resource for role in behavior.roles):
        request_allocation(x, token, behavior, parameters)
        return
    store_chosen(x, token, behavior, roles)
    emit_behavior(x, token, behavior, resources, roles, parameters)


def time_is_up(x: Execution, token: Token) -> None:
    """End the wait of a task for its resources, or a `hold` without a role."""
    if token.allocation:
        allocation_timed_out(x, token)
    else:
        complete(x, token)


def _evaluate(x: Execution, token: Token, behavior: BehaviorOfTask) -> dict[str, Value] | None:
    """Evaluate the parameters; None: error EXPRESSION was thrown."""
    read = reader(token)
    values: dict[str, Value] = {}
    for parameter in behavior.parameters:
        if isinstance(parameter.value, Expression):
            try:
                values[parameter.name] = parameter.value.evaluate(read)
            except ExpressionError as error:
                throw_error(x, token, "EXPRESSION", f"parameter {parameter.name}: {error}")
                return None
        else:
            values[parameter.name] = parameter.value
    return values


def _hold_for(x: Execution, token: Token, duration: Value) -> None:
    """Wait for the duration of a `hold` that has no role, and so commands no resource."""
    due_us = x.state.mission_time_us(x.now_us)
    if duration is not None:
        try:
            due_us += wait_us(duration, x.now_us)
        except (UnitError, ExpressionSyntaxError) as error:
            throw_error(x, token, "REJECTED", f"parameter duration: {error}")
            return
    await_event(x, token, token.node, Trigger.TIMER, due_us=due_us)


def wait_us(duration: Value, at_us: int) -> int:
    """Return a `hold`'s duration in microseconds: from "30 s", a number of seconds, or ISO 8601.

    Raises:
        UnitError, ExpressionSyntaxError: no duration, a negative one, or beyond the year 9999.
    """
    if isinstance(duration, str) and duration.startswith("P"):
        return duration_us(duration, at_us)
    seconds = quantity(duration, Dimension.DURATION)
    if seconds < 0:
        raise UnitError(f"{duration!r} is negative")
    if at_us + seconds * 1_000_000 >= YEAR_10000_US:
        raise UnitError(f"{duration!r} ends after the year 9999")
    return round(seconds * 1_000_000)


DEFAULT_CODES: dict[BehaviorState, str] = {
    BehaviorState.FAILED: "FAILED",
    BehaviorState.REJECTED: "REJECTED",
    BehaviorState.CANCELLED: "FAILED",
    BehaviorState.LOST: "LINK_LOST",
    BehaviorState.UNKNOWN: "FAILED",
}
"""Error code of a task by the end of its behavior, where the arbiter gave no code."""

RECOVERY_DECISIONS: tuple[dict[str, str], ...] = (
    {"value": "resume", "label": "Resume"},
    {"value": "skip", "label": "Skip the task"},
    {"value": "abort", "label": "Abort the mission"},
)
"""The decisions that an operator has about a behavior that is not as it was after a restart."""


def behavior_reported(x: Execution, item: i.BehaviorReported) -> None:
    """Handle an arbiter's report: a terminal one completes the task, or throws its error."""
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        x.ignore(f"{item.state.value} for {item.behavior}, which is not active")
        return
    if not item.state.terminal:
        if item.number <= behavior.number:
            x.ignore(f"report {item.number} of {item.behavior} came before")
            return
        x.emit(
            r.BehaviorProgressed(
                item.behavior, item.number, item.state, item.native_ref, item.remaining
            )
        )
        return
    if item.remaining is not None:
        behavior = replace(behavior, remaining=item.remaining)
    _ended(x, behavior, item.state, item.code, item.reason, item.outputs, item.evidence)


def _ended(
    x: Execution,
    behavior: Behavior,
    state: BehaviorState,
    code: str = "",
    reason: str = "",
    outputs: dict[str, Value] | None = None,
    evidence: dict[str, Value] | None = None,
) -> None:
    if state is BehaviorState.SUCCEEDED:
        code = ""
    elif state is not BehaviorState.CANCELLED or behavior.phase is not BehaviorPhase.CANCELLING:
        code = code or DEFAULT_CODES[state]
    token = x.state.tokens.get(behavior.token)
    if token is not None and token.behavior != behavior.id:
        token = None
    if token is not None and token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    x.emit(
        r.BehaviorEnded(
            behavior.token,
            behavior.process,
            behavior.element,
            behavior.scope,
            behavior.id,
            state,
            code,
            reason,
            evidence or {},
        )
    )
    if token is None:
        return
    note_remaining(x, token, behavior, succeeded=state is BehaviorState.SUCCEEDED)
    x.write_all(token, outputs or {})  # also those of a failed behavior, such as pictures
    if state is BehaviorState.SUCCEEDED:
        complete(x, token)
    else:
        reason = reason or f"{behavior.name} ended {state.value}"
        end_work(x, token, behavior, code, reason, behavior.resources, state)


def behavior_missing(x: Execution, item: i.BehaviorMissing) -> None:
    """Restart, fail or hold a behavior that is not as it was after a restart, by its policy."""
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        x.ignore(f"{item.behavior} is not active")
        return
    if behavior.phase is BehaviorPhase.CANCELLING:
        _ended(x, behavior, BehaviorState.CANCELLED, "", item.reason)
        return
    if behavior.phase is BehaviorPhase.UNSETTLED:
        x.ignore(f"an operator is asked about {item.behavior} already")
        return
    if item.policy is ResumePolicy.RESTART:
        x.emit(r.BehaviorRestarted(behavior.id, x.state.epoch))
    elif item.policy is ResumePolicy.FAIL:
        _ended(x, behavior, BehaviorState.LOST, "FAILED", item.reason)
    else:
        _ask_what_to_do(x, behavior, item)


def _ask_what_to_do(x: Execution, behavior: Behavior, item: i.BehaviorMissing) -> None:
    token = x.state.tokens[behavior.token]
    label = token.node.label
    x.emit(r.BehaviorUnsettled(behavior.id, item.state, item.reason))
    x.emit(
        r.PromptOpened(
            token.id,
            behavior.process,
            behavior.element,
            behavior.scope,
            f"p{x.state.last_prompt + 1}",
            f"{label}: {behavior.name} of {', '.join(behavior.resources)} is not as it was"
            f" ({item.reason or item.state.value}). Resume it, skip the task, or abort?",
            RECOVERY_DECISIONS,
            "",
            behavior.id,
        )
    )


def recovery_answered(x: Execution, behavior: Behavior, answer: i.PromptAnswer) -> None:
    """Carry out an operator's decision about a behavior that was held after a restart."""
    if answer.decision == "resume":
        if behavior.state in (BehaviorState.RUNNING, BehaviorState.ACCEPTED):
            x.emit(r.BehaviorContinued(behavior.id, answer.by))
        else:
            x.emit(r.BehaviorRestarted(behavior.id, x.state.epoch, answer.by))
    elif answer.decision == "skip":
        token = x.state.tokens[behavior.token]
        note_remaining(x, token, behavior)
        x.emit(r.BehaviorCancelRequested(behavior.id, "", f"skipped by {answer.by}"))
        complete(x, token)
    else:
        end_run(x, RunOutcome.STOPPED, f"aborted by {answer.by}")


BRINGS_DOWN = frozenset({"return_to_launch", "land"})
"""What a vehicle with a low battery is to do, as far as it can."""


def resource_fault(x: Execution, item: i.ResourceFault) -> None:
    """End the behaviors of a faulty resource with the fault's error (`ResourceFault`).

    A low battery ends a return or a landing only where an event of the mission catches it: else the
    vehicle would be stopped in the air.
    """
    ended = False
    for holder in list(x.state.held.get(item.resource, ())):
        behavior = x.state.behaviors[holder]
        if not item.reachable and len(behavior.resources) == 1:
            _ended(x, behavior, BehaviorState.LOST, item.code, item.reason)
        elif item.code == BATTERY_LOW and _goes_on_to_come_down(x, behavior):
            x.ignore(f"{item.code} of {item.resource}, which {behavior.name} brings down")
        elif behavior.phase is not BehaviorPhase.CANCELLING:
            fail_behavior(x, behavior, item.code, item.reason, item.resource)
        else:
            continue  # it ends by its report, or when it has not answered its cancel in time
        ended = True
    if not ended:
        x.ignore(f"{item.code} of {item.resource}, which does nothing for this run")


def _goes_on_to_come_down(x: Execution, behavior: Behavior) -> bool:
    catcher = catcher_of_error(x.state.tokens[behavior.token], BATTERY_LOW)
    return behavior.name in BRINGS_DOWN and catcher is None


def fail_behavior(x: Execution, behavior: Behavior, code: str, reason: str, resource: str) -> None:
    """Cancel a behavior, so that its reachable resources stop, and throw its error, or have
    another do the rest. `resource`: the one that cannot go on."""
    token = x.state.tokens[behavior.token]
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    note_remaining(x, token, behavior)
    x.emit(r.BehaviorCancelRequested(behavior.id, code, reason))
    end_work(x, token, behavior, code, reason, (resource,))


def behavior_preempted(x: Execution, item: i.BehaviorPreempted) -> None:
    """End a behavior with PREEMPTED, and the keeping of the resource: a task with a greater
    priority gets it."""
    kept = item.resource in x.state.kept
    end_keeping(x, item.resource, item.reason)
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None or behavior.phase is not BehaviorPhase.ACTIVE:
        if kept:
            return
        x.ignore(f"{item.behavior} is not active: {item.by} need not take {item.resource} from it")
        return
    fail_behavior(x, behavior, PREEMPTED, item.reason, item.resource)


def resource_returned(x: Execution, item: i.ResourceReturned) -> None:
    """Let tasks that lost a resource have it again."""
    was_lost = item.resource in x.state.lost or any(
        token.lost_work is not None and item.resource in token.lost_work.resources
        for token in x.state.tokens.values()
    )
    if was_lost:
        x.emit(r.ResourceReturned(item.resource, item.code, item.reason))
    else:
        x.ignore(f"{item.resource} was not lost for this run")


def control_taken(x: Execution, item: i.ControlTaken) -> None:
    """End the behavior of a resource with TAKEN_OVER: an operator has taken control."""
    if item.resource in x.state.taken:
        x.ignore(f"{item.resource} is with {x.state.taken[item.resource]} already")
        return
    x.emit(r.OperatorTookControl(item.resource, item.by))
    for behavior in _commanding(x.state, item.resource):
        if behavior.phase is not BehaviorPhase.CANCELLING:  # then it is ending already
            reason = f"{item.resource} was taken by {item.by}"
            fail_behavior(x, behavior, TAKEN_OVER, reason, item.resource)


def preview_control_taken(
    state: RunState, resource: str
) -> list[tuple[Behavior, Event | None, OnLoss]]:
    """Return the behaviors that `control_taken` would end, each with the event that catches its
    error, and whether another does the rest, or an operator is asked, before it is thrown.

    None instead of an event: none catches it, so the run would fail.
    """
    return [
        (
            behavior,
            catcher_of_error(state.tokens[behavior.token], TAKEN_OVER),
            what_is_done(state.tokens[behavior.token], behavior, TAKEN_OVER, (resource,)),
        )
        for behavior in _commanding(state, resource)
    ]


def _commanding(state: RunState, resource: str) -> list[Behavior]:
    """Return the behaviors that hold a resource and are not being cancelled."""
    holders = [state.behaviors.get(each) for each in state.held.get(resource, ())]
    return [
        each for each in holders if each is not None and each.phase is not BehaviorPhase.CANCELLING
    ]


def control_returned(x: Execution, item: i.ControlReturned) -> None:
    """Let missions command the resource again, and throw the signals of its return."""
    if item.resource not in x.state.taken:
        x.ignore(f"{item.resource} is not with an operator")
        return
    x.emit(r.OperatorGaveControlBack(item.resource, item.by, item.holder, item.reason))
    for signal in x.mission.signals.values():
        if signal.returned == item.resource:
            x.emit(r.SignalThrown(signal.id, by=item.by))
            throw_signal(x, signal.id, {})


def control_requested(x: Execution, item: i.ControlRequested) -> None:
    """Note that an operator asks another one for a resource."""
    if x.state.taken.get(item.resource) != item.holder:
        x.ignore(f"{item.resource} is not with {item.holder}")
        return
    x.emit(r.ControlRequested(item.resource, item.by, item.holder))


def control_request_ended(x: Execution, item: i.ControlRequestEnded) -> None:
    """Note how a request for a resource has ended; if it is given, another operator has it."""
    asked = x.state.control_requests.get(item.resource)
    given = (
        item.outcome is RequestOutcome.GIVEN
        and x.state.taken.get(item.resource, item.requested_by) != item.requested_by
    )
    if asked is None and not given:
        x.ignore(f"no operator asks for {item.resource}")
        return
    x.emit(r.ControlRequestEnded(item.resource, item.requested_by, item.outcome, item.by))
    if given:
        x.emit(r.OperatorTookControl(item.resource, item.requested_by))
