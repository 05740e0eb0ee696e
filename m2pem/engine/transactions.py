"""Transactions that are cancelled (BPMN 2.0.2, clauses 10.3.5, 10.5.6 and 13.5.6).

A transaction that completes is a subprocess that completes; an error that leaves it is not
followed by compensation (a "hazard"). A cancel end event ends all in it, undoes what was done in
it, and then the transaction is left by its cancel boundary event.
"""

from m2pem.engine import records as r
from m2pem.engine.compensation import trigger_all
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import empty, withdraw
from m2pem.engine.state import Scope, Token
from m2pem.mission.elements import Activity
from m2pem.mission.events import CancelEventDefinition


def cancel(x: Execution, token: Token) -> None:
    """End a transaction from the cancel end event that a token is on, and roll it back.

    Until that is done, its boundary events and event subprocesses wait for nothing; only what is
    thrown by what undoes it is still caught.
    """
    scope, node = token.scope, token.node
    x.leave(token, TokenOutcome.COMPLETED)
    empty(x, scope, TokenOutcome.TERMINATED)
    x.emit(r.TransactionCancelled(token.id, x.process_of(node), node.id, scope.id))
    trigger_all(x, token, scope)


def leave_cancelled(x: Execution, scope: Scope) -> None:
    """The rollback is done: go on at the cancel boundary event; without one, the token ends.

    An instance of a multi-instance transaction ends the others too, as boundary events do.
    """
    whole = scope.owner
    assert whole is not None
    while whole.instance is not None:
        assert whole.scope.owner is not None
        whole = whole.scope.owner
    node = whole.node
    assert isinstance(node, Activity)
    withdraw(x, whole, TokenOutcome.TERMINATED)
    x.leave(whole, TokenOutcome.TERMINATED)
    x.queue.append(whole.scope)
    for boundary in node.boundary:
        if any(isinstance(each, CancelEventDefinition) for each in boundary.definitions):
            x.enter(whole.id, boundary, whole.scope)
            return
