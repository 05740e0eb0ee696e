"""What records about compensation do to the state."""

from m2pem.engine import records as r
from m2pem.engine.state import Compensation, CompletedActivity, RunState, Scope, Token
from m2pem.mission.elements import Activity


def compensation_enabled(state: RunState, record: r.CompensationEnabled) -> None:
    """Note a completed activity that can be compensated."""
    token = state.tokens[record.token]
    scope = token.scope
    assert isinstance(token.node, Activity)
    state.last_completion = record.completion
    if scope.compensable is None:
        scope.compensable = {}
    scope.compensable[record.completion] = CompletedActivity(
        record.completion, scope, token.node, record.instance, token.own, token.kept_scope
    )
    token.kept_scope = None


def compensation_triggered(state: RunState, record: r.CompensationTriggered) -> None:
    """Claim the activities of a compensation, so that no other one compensates them."""
    state.last_compensation = record.compensation
    if not record.completions:
        return
    scope = state.scopes[record.target]
    assert scope.compensable is not None
    left = [scope.compensable[number] for number in record.completions]
    for completion in left:
        completion.claimed_by = record.compensation
    compensation = Compensation(record.compensation, scope, left)
    if scope.compensations is None:
        scope.compensations = {}
    scope.compensations[compensation.id] = compensation
    if record.waits:
        waiter = compensation.waiter = state.tokens[record.token]
        if waiter.compensations is None:
            waiter.compensations = {}
        waiter.compensations[compensation.id] = compensation


def compensation_began(state: RunState, record: r.CompensationBegan) -> None:
    """Begin to compensate an activity: it cannot be compensated again."""
    scope = state.scopes[record.scope]
    assert scope.compensable is not None
    assert scope.compensations is not None
    completion = scope.compensable.pop(record.completion)
    compensation = scope.compensations[record.compensation]
    compensation.left.remove(completion)
    compensation.begins = record.token, completion


def enter_compensation(scope: Scope, token: Token) -> bool:
    """Whether a token enters to compensate an activity; if so, note which."""
    for compensation in scope.compensations.values() if scope.compensations is not None else ():
        if compensation.begins is not None and compensation.begins[0] == token.id:
            completion = compensation.begins[1]
            compensation.begins = None
            compensation.token = token
            token.compensates = compensation
            if completion.kept_scope is not None:
                token.kept_scope = completion.kept_scope
                token.own = completion.own
            return True
    return False


def compensation_ended(state: RunState, record: r.CompensationEnded) -> None:
    """End a compensation and the wait for it."""
    scope = state.scopes[record.scope]
    assert scope.compensations is not None
    compensation = scope.compensations.pop(record.compensation)
    waiter = compensation.waiter
    if waiter is not None:
        assert waiter.compensations is not None
        del waiter.compensations[compensation.id]


def scope_reopened(state: RunState, record: r.ScopeReopened) -> None:
    """Open the kept scope of a completed activity again."""
    token = state.tokens[record.token]
    scope = token.kept_scope
    assert scope is not None
    token.kept_scope = None
    token.inner = scope
    scope.owner = token
    scope.reopened = True
    scope.interrupted = True  # it is not active again: its event subprocesses catch nothing
    state.scopes[scope.id] = scope


def drop_compensations(scope: Scope) -> None:
    """Drop the compensations of a scope whose content has ended; what they had not begun can be
    compensated again."""
    scope.compensations = None
    for completion in scope.compensable.values() if scope.compensable is not None else ():
        completion.claimed_by = 0


def leave_compensation(token: Token) -> None:
    """Remove a token that has left from its compensation, and from those that it waits for."""
    if token.compensates is not None:
        token.compensates.token = None
    if token.compensations:
        for compensation in token.compensations.values():
            compensation.waiter = None


def note_on_owner(scope: Scope, record: r.ScopeClosed) -> None:
    """Note on the token of a closed scope's activity whether the scope can be compensated."""
    owner = scope.owner
    if owner is None:
        return
    owner.inner = None
    if record.kept:
        owner.kept_scope = scope
        scope.owner = None
        drop_compensations(scope)
    elif scope.interrupted or record.outcome is not r.TokenOutcome.COMPLETED:
        owner.ended_early = True
