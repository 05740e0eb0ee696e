"""The part of the fold that is about compensation: what can be undone, and what is being undone."""

from m2pem.engine import records as r
from m2pem.engine.state import Compensation, Completion, RunState, Scope, Token
from m2pem.mission.elements import Activity


def compensation_enabled(state: RunState, record: r.CompensationEnabled) -> None:
    """An activity has completed and can be undone."""
    token = state.tokens[record.token]
    scope = token.scope
    assert isinstance(token.node, Activity)
    state.last_completion = record.completion
    if scope.done is None:
        scope.done = {}
    scope.done[record.completion] = Completion(
        record.completion, scope, token.node, record.instance, token.own, token.kept
    )
    token.kept = None


def compensation_triggered(state: RunState, record: r.CompensationTriggered) -> None:
    """What will be undone is claimed, so that nothing else undoes it too."""
    state.last_compensation = record.compensation
    if not record.completions:
        return
    scope = state.scopes[record.target]
    assert scope.done is not None
    left = [scope.done[number] for number in record.completions]
    for completion in left:
        completion.claimed = record.compensation
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
    """One of them is being undone: it cannot be undone again."""
    scope = state.scopes[record.scope]
    assert scope.done is not None
    assert scope.compensations is not None
    completion = scope.done.pop(record.completion)
    compensation = scope.compensations[record.compensation]
    compensation.left.remove(completion)
    compensation.begins = record.token, completion


def enter_to_undo(scope: Scope, token: Token) -> bool:
    """Whether a token that enters does so to undo something; then note what."""
    for compensation in scope.compensations.values() if scope.compensations is not None else ():
        if compensation.begins is not None and compensation.begins[0] == token.id:
            completion = compensation.begins[1]
            compensation.begins = None
            compensation.token = token
            token.undoes = compensation
            if completion.kept is not None:
                token.kept = completion.kept
                token.own = completion.own
            return True
    return False


def compensation_ended(state: RunState, record: r.CompensationEnded) -> None:
    """Nobody waits for it any more."""
    scope = state.scopes[record.scope]
    assert scope.compensations is not None
    compensation = scope.compensations.pop(record.compensation)
    waiter = compensation.waiter
    if waiter is not None:
        assert waiter.compensations is not None
        del waiter.compensations[compensation.id]


def scope_reopened(state: RunState, record: r.ScopeReopened) -> None:
    """The scope that a completed activity had is there again."""
    token = state.tokens[record.token]
    scope = token.kept
    assert scope is not None
    token.kept = None
    token.inner = scope
    scope.owner = token
    scope.reopened = True
    scope.interrupted = True  # it is not active again: its event subprocesses catch nothing
    state.scopes[scope.id] = scope


def drop_compensations(scope: Scope) -> None:
    """All in the scope has ended: what was to be undone and was not begun can be undone again."""
    scope.compensations = None
    for completion in scope.done.values() if scope.done is not None else ():
        completion.claimed = 0


def leave_compensation(token: Token) -> None:
    """A token has gone: it undoes nothing any more, and waits for nothing."""
    if token.undoes is not None:
        token.undoes.token = None
    if token.compensations:
        for compensation in token.compensations.values():
            compensation.waiter = None


def settle_owner(scope: Scope, record: r.ScopeClosed) -> None:
    """Note on the token whose activity a closed scope was what of it can be undone."""
    owner = scope.owner
    if owner is None:
        return
    owner.inner = None
    if record.kept:
        owner.kept = scope
        scope.owner = None
        drop_compensations(scope)
    elif scope.interrupted or record.outcome is not r.TokenOutcome.COMPLETED:
        owner.abnormal = True
