"""Ending things before their time.

An interruption takes effect at once, before the next step of the scope that it ends.
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import empty, kill, open_scope, withdraw
from m2pem.engine.state import Scope, Token
from m2pem.model.elements import BoundaryEvent, StartEvent, SubProcess


def divert(x: Execution, token: Token, boundary: BoundaryEvent, outcome: TokenOutcome) -> Token:
    """Move a token from its activity to a boundary event of it, ending what it did there.

    The activity's other boundary events are disarmed with it (paper, section 4.4).
    """
    withdraw(x, token, outcome)
    x.leave(token, outcome)
    if token.undoes is not None:
        x.queue.append(token.scope)  # it has undone as much as it could: the next one's turn
    return x.enter(token.id, boundary, token.scope)


def begin_event_subprocess(
    x: Execution,
    scope: Scope,
    start: StartEvent,
    outcome: TokenOutcome = TokenOutcome.INTERRUPTED,
) -> Token:
    """Begin the event subprocess whose start event was triggered in `scope` (clause 13.5.4).

    An interrupting one ends all else in the scope first, with `outcome`. Returns the token on its
    start event.
    """
    container = start.container
    assert isinstance(container, SubProcess)
    if start.interrupting:
        empty(x, scope, outcome)
        if scope.owner is not None and scope.owner.prompt:
            x.emit(r.PromptWithdrawn(scope.owner.prompt))  # an ad-hoc subprocess: nothing to choose
        x.emit(r.ScopeInterrupted(scope.id, x.process_of(container), container.id))
    return x.spawn(start, open_scope(x, x.spawn(container, scope)))


def end_run(x: Execution, outcome: RunOutcome, detail: str = "") -> None:
    """End the run and all that is active in it."""
    left = TokenOutcome.FAILED if outcome is RunOutcome.FAILED else TokenOutcome.TERMINATED
    for scope in [scope for scope in x.state.scopes.values() if scope.parent is None]:
        kill(x, scope, left)
    x.queue.clear()
    x.entered.clear()
    x.emit(r.RunEnded(outcome, detail))
