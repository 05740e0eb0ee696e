"""Opening scopes, and ending them and what is active in them (BPMN 2.0.2, clause 13.3.2).

An interruption takes effect at once, before the next step of the scope that it ends.
"""

from collections.abc import Collection

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.keeping import end_keepings_of
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.remaining import note_remaining
from m2pem.engine.state import Scope, Token
from m2pem.mission.elements import Activity, BoundaryEvent, Container, StartEvent, SubProcess
from m2pem.mission.events import CompensateEventDefinition


def open_scope(x: Execution, token: Token) -> Scope:
    """Open the scope of the activity that a token is on."""
    node = token.node
    number = x.state.last_scope + 1
    x.emit(r.ScopeOpened(number, x.process_of(node), node.id, token.scope.id, token.id))
    return x.state.scopes[number]


ErrorPath = Collection[Token | Scope]
"""The tokens and scopes that an error passes, from where it arose outwards: these have failed. All
else that the error ends is interrupted or terminated (clause 13.3.2)."""


def error_path(token: Token) -> ErrorPath:
    """Return the tokens and scopes that an error from a token passes until it is caught."""
    place: Token | None = token
    found: set[Token | Scope] = set()
    while place is not None:
        found |= {place, place.scope}
        place = place.scope.owner
    return found


def stop_activity(
    x: Execution, token: Token, outcome: TokenOutcome, failed: ErrorPath = ()
) -> None:
    """End the work of the activity that a token is on: its behavior, the request for its resources,
    its prompt, service or scope."""
    if token.behavior:
        note_remaining(x, token, x.state.behaviors[token.behavior])
        x.emit(r.BehaviorCancelRequested(token.behavior))
    if token.allocation:
        x.emit(r.AllocationEnded(token.allocation))
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    if token.service:
        x.emit(r.ServiceWithdrawn(token.service))
    if token.inner is not None:
        end_scope(x, token.inner, outcome, failed)


def end_scope(x: Execution, scope: Scope, outcome: TokenOutcome, failed: ErrorPath = ()) -> None:
    """End a scope and all within it, innermost first."""
    end_tokens(x, scope, outcome, failed)
    close_scope(x, scope, _outcome_of(scope, outcome, failed))


def end_tokens(x: Execution, scope: Scope, outcome: TokenOutcome, failed: ErrorPath = ()) -> None:
    """End every token of a scope, and all within them, but not the scope itself."""
    doomed = [scope]
    for each in doomed:
        doomed.extend(token.inner for token in each.tokens.values() if token.inner is not None)
    for each in reversed(doomed):
        for token in list(each.tokens.values()):
            stop_activity(x, token, outcome, failed)
            x.leave(token, _outcome_of(token, outcome, failed))
        if each is not scope:
            close_scope(x, each, _outcome_of(each, outcome, failed))


def _outcome_of(item: Token | Scope, outcome: TokenOutcome, failed: ErrorPath) -> TokenOutcome:
    return TokenOutcome.FAILED if item in failed else outcome


def close_scope(x: Execution, scope: Scope, outcome: TokenOutcome) -> None:
    """Close a scope in which nothing is left."""
    kept = outcome is TokenOutcome.COMPLETED and _can_be_compensated(scope)
    if scope.owner is not None:
        node = scope.owner.node
        process, element = x.process_of(node), node.id
    else:
        process = element = scope.container.id
    end_keepings_of(x, scope)
    x.emit(r.ScopeClosed(scope.id, process, element, outcome, kept))


def _can_be_compensated(scope: Scope) -> bool:
    """Whether a completed scope can compensate its activity (clause 13.5.5).

    By its compensation event subprocess, else by compensating what was done in it. What was
    interrupted has not completed, a compensation activity is not compensated, and the activity's
    own compensation activity comes first.
    """
    owner = scope.owner
    if owner is None or owner.compensates is not None or scope.interrupted:
        return False
    node = owner.node
    assert isinstance(node, Activity)
    if node.for_compensation or node.compensation is not None or is_compensation_handler(node):
        return False
    return bool(scope.compensable) or (
        scope.loop is None and compensation_handler(scope.container) is not None
    )


def compensation_handler(container: Container) -> SubProcess | None:
    """Return the compensation event subprocess of a container."""
    for inner in container.event_subprocesses:
        if is_compensation_handler(inner):
            return inner
    return None


def is_compensation_handler(node: Activity) -> bool:
    """Whether an activity is a compensation event subprocess."""
    return (
        isinstance(node, SubProcess)
        and node.triggered_by_event
        and any(
            isinstance(definition, CompensateEventDefinition)
            for start in node.starts
            for definition in start.definitions
        )
    )


def move_to_boundary(
    x: Execution, token: Token, boundary: BoundaryEvent, failed: ErrorPath = ()
) -> Token:
    """Move a token from its activity to a boundary event of it, ending what it did there.

    The activity's other boundary events are disarmed with it (paper, section 4.4). `failed`: what
    an error has passed; all else is interrupted.
    """
    stop_activity(x, token, TokenOutcome.INTERRUPTED, failed)
    x.leave(token, TokenOutcome.FAILED if failed else TokenOutcome.INTERRUPTED)
    if token.compensates is not None:
        x.queue.append(token.scope)  # it was compensating: the next one's turn
    return x.enter(token.id, boundary, token.scope)


def start_event_subprocess(
    x: Execution, scope: Scope, start: StartEvent, failed: ErrorPath = ()
) -> Token:
    """Begin the event subprocess whose start event was triggered in `scope` (clause 13.5.4).

    An interrupting one ends all else in the scope first. `failed`: what an error has passed;
    all else is interrupted. Returns the token on its start event.
    """
    container = start.container
    assert isinstance(container, SubProcess)
    if start.interrupting:
        end_tokens(x, scope, TokenOutcome.INTERRUPTED, failed)
        if scope.owner is not None and scope.owner.prompt:
            x.emit(r.PromptWithdrawn(scope.owner.prompt))  # an ad-hoc subprocess: nothing to choose
        x.emit(r.ScopeInterrupted(scope.id, x.process_of(container), container.id))
    return x.spawn(start, open_scope(x, x.spawn(container, scope)))


def end_run(
    x: Execution, outcome: RunOutcome, detail: str = "", failed: ErrorPath | None = None
) -> None:
    """End the run and all that is active in it.

    `failed`: what the error has passed that ends the run; None: all that is active, if the
    run has failed because nothing can go on.
    """
    stuck = outcome is RunOutcome.FAILED and failed is None
    left = TokenOutcome.FAILED if stuck else TokenOutcome.TERMINATED
    for scope in [scope for scope in x.state.scopes.values() if scope.parent is None]:
        end_scope(x, scope, left, failed or ())
    x.queue.clear()
    x.entered.clear()
    x.emit(r.RunEnded(outcome, detail))
