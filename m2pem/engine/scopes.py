"""Opening scopes, and ending them and what is active in them (BPMN 2.0.2, clause 13.3.2).

An interruption takes effect at once, before the next step of the scope that it ends.
"""

from collections.abc import Collection

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.state import Scope, Token
from m2pem.mission.elements import Activity, BoundaryEvent, Container, StartEvent, SubProcess
from m2pem.mission.events import CompensateEventDefinition


def open_scope(x: Execution, token: Token) -> Scope:
    """Open the scope of the activity that a token is on."""
    node = token.node
    number = x.state.last_scope + 1
    x.emit(r.ScopeOpened(number, x.process_of(node), node.id, token.scope.id, token.id))
    return x.state.scopes[number]


Failing = Collection[Token | Scope]
"""What an error goes through, from where it arose outwards: that has failed. All else that it ends
is interrupted or terminated (clause 13.3.2)."""


def failing(token: Token) -> Failing:
    """What an error from a token goes through, until it is caught."""
    place: Token | None = token
    found: set[Token | Scope] = set()
    while place is not None:
        found |= {place, place.scope}
        place = place.scope.owner
    return found


def withdraw(x: Execution, token: Token, outcome: TokenOutcome, failed: Failing = ()) -> None:
    """End what the activity under a token does: its behavior, prompt, service or inside."""
    if token.behavior:
        x.emit(r.BehaviorCancelRequested(token.behavior))
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    if token.service:
        x.emit(r.ServiceWithdrawn(token.service))
    if token.inner is not None:
        kill(x, token.inner, outcome, failed)


def kill(x: Execution, scope: Scope, outcome: TokenOutcome, failed: Failing = ()) -> None:
    """End a scope and all within it, innermost first."""
    empty(x, scope, outcome, failed)
    close(x, scope, _how(scope, outcome, failed))


def empty(x: Execution, scope: Scope, outcome: TokenOutcome, failed: Failing = ()) -> None:
    """End every token of a scope, and all within it, but not the scope itself."""
    doomed = [scope]
    for each in doomed:
        doomed.extend(token.inner for token in each.tokens.values() if token.inner is not None)
    for each in reversed(doomed):
        for token in list(each.tokens.values()):
            withdraw(x, token, outcome, failed)
            x.leave(token, _how(token, outcome, failed))
        if each is not scope:
            close(x, each, _how(each, outcome, failed))


def _how(item: Token | Scope, outcome: TokenOutcome, failed: Failing) -> TokenOutcome:
    return TokenOutcome.FAILED if item in failed else outcome


def close(x: Execution, scope: Scope, outcome: TokenOutcome) -> None:
    """State that a scope has ended. Nothing may be left in it."""
    kept = outcome is TokenOutcome.COMPLETED and _can_be_undone(scope)
    if scope.owner is not None:
        node = scope.owner.node
        process, element = x.process_of(node), node.id
    else:
        process = element = scope.container.id
    x.emit(r.ScopeClosed(scope.id, process, element, outcome, kept))


def _can_be_undone(scope: Scope) -> bool:
    """Whether what is in a scope that has completed can undo its activity (clause 13.5.5).

    By its compensation event subprocess, else by undoing what was done in it. What was interrupted
    has not completed; a compensation activity is not undone; one of its own goes first.
    """
    owner = scope.owner
    if owner is None or owner.undoes is not None or scope.interrupted:
        return False
    node = owner.node
    assert isinstance(node, Activity)
    if node.for_compensation or node.compensation is not None or compensates_around(node):
        return False
    return bool(scope.done) or (scope.loop is None and compensator(scope.container) is not None)


def compensator(container: Container) -> SubProcess | None:
    """The compensation event subprocess of a container."""
    for inner in container.event_subprocesses:
        if compensates_around(inner):
            return inner
    return None


def compensates_around(node: Activity) -> bool:
    """Whether it is a compensation event subprocess."""
    return (
        isinstance(node, SubProcess)
        and node.triggered_by_event
        and any(
            isinstance(definition, CompensateEventDefinition)
            for start in node.starts
            for definition in start.definitions
        )
    )


def divert(x: Execution, token: Token, boundary: BoundaryEvent, failed: Failing = ()) -> Token:
    """Move a token from its activity to a boundary event of it, ending what it did there.

    The activity's other boundary events are disarmed with it (paper, section 4.4). `failed`: what
    an error has gone through; all else is interrupted.
    """
    withdraw(x, token, TokenOutcome.INTERRUPTED, failed)
    x.leave(token, TokenOutcome.FAILED if failed else TokenOutcome.INTERRUPTED)
    if token.undoes is not None:
        x.queue.append(token.scope)  # it has undone as much as it could: the next one's turn
    return x.enter(token.id, boundary, token.scope)


def begin_event_subprocess(
    x: Execution, scope: Scope, start: StartEvent, failed: Failing = ()
) -> Token:
    """Begin the event subprocess whose start event was triggered in `scope` (clause 13.5.4).

    An interrupting one ends all else in the scope first. `failed`: what an error has gone through;
    all else is interrupted. Returns the token on its start event.
    """
    container = start.container
    assert isinstance(container, SubProcess)
    if start.interrupting:
        empty(x, scope, TokenOutcome.INTERRUPTED, failed)
        if scope.owner is not None and scope.owner.prompt:
            x.emit(r.PromptWithdrawn(scope.owner.prompt))  # an ad-hoc subprocess: nothing to choose
        x.emit(r.ScopeInterrupted(scope.id, x.process_of(container), container.id))
    return x.spawn(start, open_scope(x, x.spawn(container, scope)))


def end_run(
    x: Execution, outcome: RunOutcome, detail: str = "", failed: Failing | None = None
) -> None:
    """End the run and all that is active in it.

    `failed`: what the error has gone through that ends the run; None: all that is active, if the
    run has failed because nothing can go on.
    """
    stuck = outcome is RunOutcome.FAILED and failed is None
    left = TokenOutcome.FAILED if stuck else TokenOutcome.TERMINATED
    for scope in [scope for scope in x.state.scopes.values() if scope.parent is None]:
        kill(x, scope, left, failed or ())
    x.queue.clear()
    x.entered.clear()
    x.emit(r.RunEnded(outcome, detail))
