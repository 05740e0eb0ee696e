"""What records about scopes do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply import compensation as undoing
from m2pem.engine.apply.appliers import Appliers
from m2pem.engine.apply.events import end_wait
from m2pem.engine.state import (
    Loop,
    RunState,
    Scope,
)
from m2pem.mission.elements import (
    Activity,
    CallActivity,
    Container,
    Process,
    SubProcess,
)


def _scope_opened(state: RunState, record: r.ScopeOpened) -> None:
    parent = state.scopes[record.parent] if record.parent is not None else None
    owner = state.tokens[record.token] if record.token is not None else None
    container: Container
    element = state.mission.elements[record.element]
    if record.instances is not None:
        assert isinstance(element, Activity)
        container = element.container
    elif isinstance(element, CallActivity):
        container = element.called
    else:
        assert isinstance(element, (Process, SubProcess))
        container = element
    depth = parent.depth + 1 if parent is not None else 0
    scope = Scope(record.scope, container, parent, owner, depth, state.shared)
    if record.instances is not None:
        scope.loop = Loop(record.instances, record.items)
        scope.depth -= 1  # its activity is one level, not two
    state.scopes[record.scope] = scope
    state.last_scope = record.scope
    if owner is not None:
        owner.inner = scope
    if state.root is None:
        state.root = scope


def _scope_closed(state: RunState, record: r.ScopeClosed) -> None:
    scope = state.scopes.pop(record.scope)
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        end_wait(state, wait)
    undoing.settle_owner(scope, record)


def _scope_interrupted(state: RunState, record: r.ScopeInterrupted) -> None:
    scope = state.scopes[record.scope]
    scope.interrupted = True
    scope.activated.clear()  # no token comes any more for which a complex gateway would wait
    undoing.drop_compensations(scope)
    _disarm_event_subprocesses(state, scope)


def _scope_completing(state: RunState, record: r.ScopeCompleting) -> None:
    scope = state.scopes[record.scope]
    scope.completing = True
    _disarm_event_subprocesses(state, scope)


def _disarm_event_subprocesses(state: RunState, scope: Scope) -> None:
    for wait in list(scope.waits.values()) if scope.waits is not None else ():
        if isinstance(wait.node.container, SubProcess):
            end_wait(state, wait)


def _transaction_cancelled(state: RunState, record: r.TransactionCancelled) -> None:
    """The transaction is not active any more: nothing but its rollback can happen to it."""
    scope = state.scopes[record.scope]
    scope.cancelled = scope.interrupted = True
    scope.activated.clear()
    undoing.drop_compensations(scope)
    for holder in (scope, scope.owner):
        if holder is not None and holder.waits is not None:
            for wait in list(holder.waits.values()):
                end_wait(state, wait)


APPLIERS: Appliers = {
    r.ScopeOpened: _scope_opened,
    r.ScopeClosed: _scope_closed,
    r.ScopeInterrupted: _scope_interrupted,
    r.ScopeCompleting: _scope_completing,
    r.TransactionCancelled: _transaction_cancelled,
}
