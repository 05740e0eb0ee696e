"""Compensation: undoing activities that have completed (BPMN 2.0.2, clauses 10.7 and 13.5.5).

An activity that completes well, and that something can undo, leaves a `Completion` in its scope.
What can undo it is its compensation activity; without one, its own scope, which is kept: by the
compensation event subprocess in it, else by undoing what was done in it, latest first.

A throw makes a `Compensation`, which undoes one activity after the other: a token enters what
undoes it, and when that token is done, the scope is looked at again (`advance`).
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import close, compensates_around, compensator, open_scope
from m2pem.engine.state import Compensation, Completion, Scope, Token
from m2pem.mission.elements import Activity, Element, SubProcess
from m2pem.mission.events import CompensateEventDefinition

# --- what can be undone -------------------------------------------------------------------------


def enable(x: Execution, token: Token) -> None:
    """An activity, or an instance of one, has completed: from here on it can be undone.

    What was ended early has not completed (figure 13.2), and what undoes is not undone. A
    compensation activity undoes a loop or multi-instance activity as a whole.
    """
    node = token.node
    assert isinstance(node, Activity)
    if token.abnormal or node.for_compensation or compensates_around(node):
        return
    if token.kept is None and (node.compensation is None or token.instance is not None):
        return
    number = x.state.last_completion + 1
    x.emit(
        r.CompensationEnabled(
            token.id, x.process_of(node), node.id, token.scope.id, number, token.instance
        )
    )


# --- triggering ---------------------------------------------------------------------------------


def throw_compensation(x: Execution, token: Token, definition: CompensateEventDefinition) -> None:
    """Undo the activity that an event names, or all that was done in its scope.

    Afterwards the token has `compensations` when it has to wait. Thrown in an event subprocess, it
    is about the scope around that (tables 10.88 and 10.89). A named activity is looked for outwards
    from there; the activity that the event itself is in stands for all that was done in it.
    """
    qualifier = token.node.qualifier
    name = f"{qualifier}:{definition.activity}" if qualifier else definition.activity
    named = x.mission.elements.get(name) if definition.activity else None
    scope = _target(token.scope, named)
    found = [
        completion
        for completion in _undoable(scope)
        if named is None or named is scope.container or completion.node is named
    ]
    trigger_compensation(x, token, scope, found, waits=definition.wait and bool(found))


def _target(thrown_in: Scope, named: Element | None) -> Scope:
    """The scope in which something is to be undone."""
    scope = thrown_in
    if named is None:
        container = scope.container
        if isinstance(container, SubProcess) and container.triggered_by_event:
            assert scope.owner is not None
            scope = scope.owner.scope
            while scope.loop is not None and scope.owner is not None:
                scope = scope.owner.scope
        return scope
    home = named.container if isinstance(named, Activity) else None
    while scope.loop is not None or scope.container not in (home, named):
        if scope.owner is None:
            return thrown_in
        scope = scope.owner.scope
    return scope


def _undoable(scope: Scope) -> list[Completion]:
    """What can be undone in a scope and is not being undone already, latest first."""
    done = scope.done.values() if scope.done is not None else ()
    return [completion for completion in reversed(done) if not completion.claimed]


def trigger_all(x: Execution, token: Token, scope: Scope) -> None:
    """Undo all that was done in a scope; nobody waits but the scope itself."""
    trigger_compensation(x, token, scope, _undoable(scope), waits=False)


def trigger_compensation(
    x: Execution, token: Token, scope: Scope, found: list[Completion], *, waits: bool
) -> None:
    """State what will be undone in a scope, in this order, and have it begun."""
    x.emit(
        r.CompensationTriggered(
            token.id,
            x.process_of(token.node),
            token.node.id,
            token.scope.id,
            x.state.last_compensation + 1,
            scope.id,
            tuple(completion.id for completion in found),
            waits,
        )
    )
    x.queue.append(scope)


# --- undoing ------------------------------------------------------------------------------------


def advance(x: Execution, scope: Scope) -> None:
    """Begin to undo what comes next in each compensation of a scope, or end it."""
    for compensation in list((scope.compensations or {}).values()):
        if compensation.id not in (scope.compensations or {}) or compensation.token is not None:
            continue
        if compensation.left:
            _begin(x, scope, compensation)
        else:
            _end(x, scope, compensation)


def _begin(x: Execution, scope: Scope, compensation: Compensation) -> None:
    completion = compensation.left[0]
    activity = completion.node
    number = x.state.last_token + 1
    node = activity
    if completion.kept is None:
        assert activity.compensation is not None
        node = activity.compensation
    x.emit(
        r.CompensationBegan(
            number,
            x.process_of(node),
            node.id,
            scope.id,
            compensation.id,
            completion.id,
            activity.id,
        )
    )
    if completion.kept is None:
        x.enter(number, node, scope)
    else:  # it does not begin again, but has its scope reopened
        process = x.process_of(node)
        x.emit(r.TokenEntered(number, process, node.id, scope.id, instance=completion.instance))
        _reopen(x, x.state.tokens[number], completion.kept)


def _reopen(x: Execution, token: Token, scope: Scope) -> None:
    """Undo an activity by what is in its own scope."""
    node = token.node
    x.emit(r.ScopeReopened(scope.id, x.process_of(node), node.id, token.id))
    handler = compensator(scope.container) if scope.loop is None else None
    if handler is None:
        trigger_all(x, token, scope)
        return
    inner = open_scope(x, x.spawn(handler, scope))
    for start in handler.starts:
        x.spawn(start, inner)


def undone(x: Execution, token: Token) -> None:
    """What undid an activity is done; its compensation goes on with the next."""
    x.leave(token, TokenOutcome.COMPLETED)
    x.queue.append(token.scope)


def close_undone(x: Execution, scope: Scope) -> None:
    """A reopened scope in which everything is undone."""
    owner = scope.owner
    assert owner is not None
    close(x, scope, TokenOutcome.COMPLETED)
    undone(x, owner)


def _end(x: Execution, scope: Scope, compensation: Compensation) -> None:
    waiter = compensation.waiter
    x.emit(r.CompensationEnded(compensation.id, scope.id))
    x.queue.append(scope)
    if waiter is not None and not waiter.compensations:
        x.handlers[type(waiter.node)].complete(x, waiter)
