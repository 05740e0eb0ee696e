"""Throwing errors and escalations: scope by scope outwards, to the event that catches them."""

from collections.abc import Callable
from dataclasses import dataclass

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.incidents import open_incident, opens_incident
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import (
    ErrorPath,
    end_run,
    error_path,
    move_to_boundary,
    start_event_subprocess,
)
from m2pem.engine.state import Behavior, Scope, Token
from m2pem.mission.elements import Activity, BoundaryEvent, Event, StartEvent, catches
from m2pem.mission.events import (
    Escalation,
    EventDefinition,
    caught_data,
    error_code,
    escalation_code,
)

# --- errors -------------------------------------------------------------------------------------


def throw_error(
    x: Execution,
    token: Token,
    code: str,
    reason: str = "",
    *,
    leaving: bool = False,
    behavior: Behavior | None = None,
    arming: bool = False,
) -> None:
    """Throw an error where a token is; it goes outwards scope by scope (BPMN 2.0.2, clause 10.5.7).

    An activity's own boundary events are checked first, then the event subprocesses of its scope,
    then the boundary events of the activity around it, and so on. What catches it ends the
    activity or scope. Uncaught, the run fails, or an incident opens (`m2pem.engine.incidents`): the
    token is then still there. `leaving`: the token is consumed (an error end event). `behavior`:
    the one that failed. `arming`: an event at the element could not be armed.
    """
    node = token.node
    caught = _find_catcher(token, code, error_code)
    x.emit(
        r.ErrorThrown(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            code,
            reason,
            caught.event.id if caught is not None else "",
        )
    )
    if caught is None and opens_incident(x, token):
        if not token.incident:
            open_incident(x, token, code, reason, behavior, rearm=arming)
        return
    failed = error_path(token)
    if leaving:
        x.leave(token, TokenOutcome.COMPLETED)
    if caught is None:
        fail_run(x, token, code, reason, failed)
    else:
        _catch(x, caught, code, reason, failed)


def fail_run(x: Execution, token: Token, code: str, reason: str, failed: ErrorPath) -> None:
    """End the run with an error from the element of a token; `failed`: what it has passed."""
    because = f": {reason}" if reason else ""
    detail = f"error {code} from {token.node.id}, which no event catches{because}"
    end_run(x, RunOutcome.FAILED, detail, failed)


def throw_expression_error(x: Execution, scope: Scope, reason: str) -> None:
    """Throw the error of an expression that a scope as a whole evaluates, from its activity.

    A process that was not called has no element that could be retried: its error ends the run.
    """
    code = "EXPRESSION"
    if scope.owner is not None:
        throw_error(x, scope.owner, code, reason)
        return
    element = scope.container.id
    x.emit(r.ErrorThrown(0, element, element, scope.id, code, reason))
    end_run(x, RunOutcome.FAILED, f"error {code} from {element}: {reason}", {scope})


def throw_error_in_process(x: Execution, code: str, reason: str) -> None:
    """Throw an error in the process that the run began with, from no element of it.

    An event subprocess of it catches that; uncaught, the run fails.
    """
    scope = x.state.root
    assert scope is not None, "a run that goes on has begun"
    starts: list[StartEvent] = []
    if scope.id in x.state.scopes and not (scope.interrupted or scope.completing):
        starts = [start for each in scope.container.event_subprocesses for start in each.starts]
    caught = catches(starts, code, error_code)
    element = scope.container.id
    caught_by = caught.id if caught is not None else ""
    x.emit(r.ErrorThrown(0, element, element, scope.id, code, reason, caught_by))
    if caught is None:
        detail = f"error {code}, which no event catches: {reason}"
        end_run(x, RunOutcome.FAILED, detail, {scope})
    else:
        begun = start_event_subprocess(x, scope, caught, {scope})
        x.write_all(begun, dict(caught_data(caught.definitions, code, reason)))


# --- escalations --------------------------------------------------------------------------------


def throw_escalation(
    x: Execution, token: Token, escalation: Escalation, *, leaving: bool = False
) -> bool:
    """Throw an escalation from the event under a token; the nearest outer scope catches it.

    Returns whether the scope goes on: an interrupting catch ends it. `leaving`: the token is
    consumed (an escalation end event).
    """
    node = token.node
    caught = _find_catcher(token, escalation.code, escalation_code)
    x.emit(
        r.EscalationThrown(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            escalation.id,
            escalation.code,
            caught.event.id if caught is not None else "",
        )
    )
    if leaving:
        x.leave(token, TokenOutcome.COMPLETED)
    if caught is None:
        return True
    if not caught.event.interrupting:
        if isinstance(caught, _AtBoundary):
            begun = x.spawn(caught.event, caught.place.scope)
        else:
            begun = start_event_subprocess(x, caught.place, caught.event)
        x.write_all(begun, dict(caught_data(caught.event.definitions, escalation.code)))
        return True
    _catch(x, caught, escalation.code)
    return False


# --- catchers --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _AtBoundary:
    place: Token
    event: BoundaryEvent


@dataclass(frozen=True, slots=True)
class _InScope:
    place: Scope
    event: StartEvent


def _catch(
    x: Execution,
    caught: _AtBoundary | _InScope,
    code: str,
    reason: str = "",
    failed: ErrorPath = (),
) -> None:
    if isinstance(caught, _AtBoundary):
        begun = move_to_boundary(x, caught.place, caught.event, failed)
    else:
        begun = start_event_subprocess(x, caught.place, caught.event, failed)
    x.write_all(begun, dict(caught_data(caught.event.definitions, code, reason)))


def _find_catcher(
    thrower: Token, code: str, code_of: Callable[[EventDefinition], str | None]
) -> _AtBoundary | _InScope | None:
    """Return the nearest event that catches a code; one that names it comes before a catch-all.

    An event subprocess does not catch what is thrown in itself, and none begins in a scope that
    one has interrupted, or in which only they are left. The boundary events of a loop or
    multi-instance activity belong to the outer instance; those of an activity that
    is being compensated are over.
    """
    token: Token | None = thrower
    while token is not None:
        node, scope = token.node, token.scope
        if isinstance(node, Activity) and token.instance is None and not token.is_reopened:
            boundary = catches(node.boundary, code, code_of)
            if boundary is not None:
                return _AtBoundary(token, boundary)
        if scope.loop is None and not (scope.interrupted or scope.completing):
            handlers = scope.container.event_subprocesses
            starts = [start for each in handlers if each is not node for start in each.starts]
            start = catches(starts, code, code_of)
            if start is not None:
                return _InScope(scope, start)
        token = scope.owner
    return None


def catcher_of_error(thrower: Token, code: str) -> Event | None:
    """Return the event that would catch an error thrown at a token; None: the run would fail."""
    caught = _find_catcher(thrower, code, error_code)
    return caught.event if caught is not None else None
