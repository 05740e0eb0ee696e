"""Compensation: undoing activities that have completed (BPMN 2.0.2, clauses 10.7 and 13.5.5).

An activity that completes, and that can be compensated, leaves a `CompletedActivity` in its scope.
Its compensation activity compensates it; without one, its own scope, which is kept, does so: by the
compensation event subprocess in it, else by compensating what was done in it, latest first.

A compensation event makes a `Compensation`, which handles one activity after the other. A token
enters the compensation activity; when that is done, the scope is checked again
(`advance_compensations`).
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import (
    close_scope,
    compensation_handler,
    is_compensation_handler,
    open_scope,
)
from m2pem.engine.state import Compensation, CompletedActivity, Scope, Token
from m2pem.mission.elements import Activity, Element, SubProcess
from m2pem.mission.events import CompensateEventDefinition

# --- completed activities -----------------------------------------------------------------------


def enable_compensation(x: Execution, token: Token) -> None:
    """Note that an activity, or an instance of one, has completed and can be compensated.

    What was ended early has not completed (figure 13.2), and a compensation activity is not
    compensated. It compensates a loop or multi-instance activity as a whole.
    """
    node = token.node
    assert isinstance(node, Activity)
    if token.ended_early or node.for_compensation or is_compensation_handler(node):
        return
    if token.kept_scope is None and (node.compensation is None or token.instance is not None):
        return
    number = x.state.last_completion + 1
    x.emit(
        r.CompensationEnabled(
            token.id, x.process_of(node), node.id, token.scope.id, number, token.instance
        )
    )


# --- triggering ---------------------------------------------------------------------------------


def throw_compensation(x: Execution, token: Token, definition: CompensateEventDefinition) -> None:
    """Compensate the activity that an event names, or all that was done in its scope.

    Afterwards the token has `compensations` if it must wait. An event in an event subprocess means
    the scope around that (tables 10.88 and 10.89). A named activity is searched from there
    outwards; the activity that the event itself is in means all that was done in it.
    """
    qualifier = token.node.qualifier
    name = f"{qualifier}:{definition.activity}" if qualifier else definition.activity
    named = x.mission.elements.get(name) if definition.activity else None
    scope = _target(token.scope, named)
    found = [
        completion
        for completion in _compensable(scope)
        if named is None or named is scope.container or completion.node is named
    ]
    trigger_compensation(x, token, scope, found, waits=definition.wait and bool(found))


def _target(thrown_in: Scope, named: Element | None) -> Scope:
    """Return the scope in which activities are to be compensated."""
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


def _compensable(scope: Scope) -> list[CompletedActivity]:
    """Return what can be compensated in a scope and is not being compensated, latest first."""
    done = scope.compensable.values() if scope.compensable is not None else ()
    return [completion for completion in reversed(done) if not completion.claimed_by]


def compensate_all(x: Execution, token: Token, scope: Scope) -> None:
    """Compensate all that was done in a scope; no event waits for it, only the scope."""
    trigger_compensation(x, token, scope, _compensable(scope), waits=False)


def trigger_compensation(
    x: Execution, token: Token, scope: Scope, found: list[CompletedActivity], *, waits: bool
) -> None:
    """Record what will be compensated in a scope, in this order, and begin."""
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


# --- compensating -------------------------------------------------------------------------------


def advance_compensations(x: Execution, scope: Scope) -> None:
    """Begin the next activity of each compensation of a scope, or end the compensation."""
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
    if completion.kept_scope is None:
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
    if completion.kept_scope is None:
        x.enter(number, node, scope)
    else:  # the activity does not begin again: its scope is reopened
        process = x.process_of(node)
        x.emit(r.TokenEntered(number, process, node.id, scope.id, instance=completion.instance))
        _reopen(x, x.state.tokens[number], completion.kept_scope)


def _reopen(x: Execution, token: Token, scope: Scope) -> None:
    """Compensate an activity by its own scope."""
    node = token.node
    x.emit(r.ScopeReopened(scope.id, x.process_of(node), node.id, token.id))
    handler = compensation_handler(scope.container) if scope.loop is None else None
    if handler is None:
        compensate_all(x, token, scope)
        return
    inner = open_scope(x, x.spawn(handler, scope))
    for start in handler.starts:
        x.spawn(start, inner)


def compensated(x: Execution, token: Token) -> None:
    """End the token that has compensated an activity; its compensation goes on with the next."""
    x.leave(token, TokenOutcome.COMPLETED)
    x.queue.append(token.scope)


def close_compensated(x: Execution, scope: Scope) -> None:
    """Close a reopened scope in which everything is compensated."""
    owner = scope.owner
    assert owner is not None
    close_scope(x, scope, TokenOutcome.COMPLETED)
    compensated(x, owner)


def _end(x: Execution, scope: Scope, compensation: Compensation) -> None:
    waiter = compensation.waiter
    x.emit(r.CompensationEnded(compensation.id, scope.id))
    x.queue.append(scope)
    if waiter is not None and not waiter.compensations:
        x.handlers[type(waiter.node)].complete(x, waiter)
