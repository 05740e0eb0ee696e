"""Opening and ending scopes, and what is active in them (BPMN 2.0.2, clause 13.3.2)."""

from collections.abc import Collection

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Scope, Token
from m2pem.mission.elements import Activity, Container, SubProcess
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
