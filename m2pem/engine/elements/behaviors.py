"""Behaviors of vehicles, payloads and teams (paper, section 4.2)."""

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.execution import Execution
from m2pem.engine.records import Trigger
from m2pem.engine.state import BehaviorPhase, Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.waiting import await_event
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.units import Dimension, UnitError, quantity
from m2pem.mission.behavior import Behavior
from m2pem.mission.duration import duration_us
from m2pem.mission.expression import Expression
from m2pem.mission.values import Value

YEAR_10000_US = 253_402_300_800_000_000
"""The end of the calendar, in microseconds since the Unix epoch: no timer runs longer."""


def request_behavior(x: Execution, token: Token, behavior: Behavior) -> None:
    """Have the arbiters start a behavior; their terminal report completes the task.

    A resource that another behavior holds, and is not giving up, is RESOURCE_UNAVAILABLE at once.
    """
    node = token.node
    parameters = _evaluate(x, token, behavior)
    if parameters is None:
        return
    if not behavior.roles and behavior.name == "hold":
        _wait(x, token, parameters.get("duration"))
        return
    try:
        allocation = allocate(behavior, x.fleet)
    except AllocationError as error:
        throw_error(x, token, "RESOURCE_UNAVAILABLE", str(error))
        return
    if not allocation.resources:
        reason = f"no resource is allocated to {behavior.name}"
        throw_error(x, token, "RESOURCE_UNAVAILABLE", reason)
        return
    preempts: dict[str, None] = {}
    for resource in allocation.resources:
        if resource in x.state.taken:
            reason = f"{resource} is with {x.state.taken[resource]}"
            throw_error(x, token, "RESOURCE_UNAVAILABLE", reason)
            return
        for holder in x.state.held.get(resource, ()):
            held_by = x.state.behaviors[holder]
            if held_by.phase is not BehaviorPhase.CANCELLING:
                reason = f"{resource} is held by {held_by.name} of {held_by.element} ({holder})"
                throw_error(x, token, "RESOURCE_UNAVAILABLE", reason)
                return
            preempts[holder] = None
    x.emit(
        r.BehaviorRequested(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"{x.state.run}.b{x.state.last_behavior + 1}",
            behavior.name,
            behavior.type.value,
            tuple(allocation.resources),
            {role: tuple(ids) for role, ids in allocation.roles.items()},
            parameters,
            tuple(preempts),
        )
    )


def _evaluate(x: Execution, token: Token, behavior: Behavior) -> dict[str, Value] | None:
    """Values of the parameters now; None: an error was thrown instead."""
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


def _wait(x: Execution, token: Token, duration: Value) -> None:
    """A `hold` without any role commands nothing: it is a wait of its duration."""
    due_us = x.state.mission_time_us(x.now_us)
    if duration is not None:
        try:
            due_us += wait_us(duration, x.now_us)
        except (UnitError, ExpressionSyntaxError) as error:
            throw_error(x, token, "REJECTED", f"parameter duration: {error}")
            return
    await_event(x, token, token.node, Trigger.TIMER, due_us=due_us)


def wait_us(duration: Value, at_us: int) -> int:
    """A `hold`'s duration in microseconds: "30 s", a number of seconds, or ISO 8601.

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
