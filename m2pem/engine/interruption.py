"""Ending things before their time.

An interruption takes effect at once, before the next step of the scope that it ends.
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import Failing, empty, kill, open_scope, withdraw
from m2pem.engine.state import Scope, Token
from m2pem.mission.elements import BoundaryEvent, StartEvent, SubProcess


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
