"""Subprocesses, call activities, ad-hoc subprocesses and transactions, and the scopes they open.

BPMN 2.0.2, clauses 10.3.5, 10.3.6 and 13.3.4 to 13.5.6. The activities of an ad-hoc subprocess are
chosen by the operators, who are asked, or by its own expression; its completion condition is
evaluated after each activity. A transaction that completes is a subprocess that completes. An error
that leaves it is not followed by compensation (a "hazard"). A cancel end event ends all in it and
compensates what was done in it; then the token leaves by its cancel boundary event.
"""

from m2pem.engine import records as r
from m2pem.engine.compensation import advance, close_undone, trigger_all
from m2pem.engine.data import flatten, reader
from m2pem.engine.data_flow import evaluate, write_values
from m2pem.engine.elements.activities import complete
from m2pem.engine.elements.loops import begin_instances
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import close, empty, end_run, open_scope, withdraw
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import arm_event_subprocesses, collect_letters
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Activity, AdHocOrdering, AdHocSubProcess, CallActivity, FlowNode
from m2pem.mission.events import CancelEventDefinition
from m2pem.mission.expression import Expression

MAX_DEPTH = 1000
"""Scopes within scopes; more is a process that calls itself without end."""


def subprocess(x: Execution, token: Token) -> None:
    """Open its scope and start what is in it."""
    if token.inner is not None:
        # An event subprocess, which its trigger has begun.
        if arm_event_subprocesses(x, token.inner):
            collect_letters(x, token.inner)
        return
    scope = open_inside(x, token)
    if scope is not None:
        begin(x, scope)


def call_activity(x: Execution, token: Token) -> None:
    """Open an instance of the called process; only what the mappings say passes in and out."""
    node = token.node
    assert isinstance(node, CallActivity)
    values = evaluate(x, token, node.mappings.inputs, reader(token))
    if values is None:
        return
    scope = open_inside(x, token)
    if scope is None:
        return
    for mapping, value in values:
        for key, item in flatten(mapping.target, value):
            x.write_into(scope, token, key, item)
    begin(x, scope)


def open_inside(x: Execution, token: Token) -> Scope | None:
    """Open the scope of an activity. None: it is too deep, and that error was thrown."""
    if token.scope.depth >= MAX_DEPTH:
        throw_error(x, token, "RECURSION", _too_deep(token))
        return None
    return open_scope(x, token)


def _too_deep(token: Token) -> str:
    node = token.node
    reason = f"{MAX_DEPTH} scopes within scopes at {node.id}"
    if not isinstance(node, CallActivity):
        return reason
    around, times = token.scope, 0
    while around.parent is not None:
        times += around.container is node.called
        around = around.parent
    what = f"process {node.called.id} is in itself {times} times: nothing ends its calls of itself"
    return f"{reason}; {what}" if times > 1 else reason


def begin(x: Execution, scope: Scope) -> None:
    """A token for each start event of the scope's container (paper, section 4.1)."""
    if scope.container.event_subprocesses and not arm_event_subprocesses(x, scope):
        return
    for entry in scope.container.entries:
        x.spawn(entry, scope)
    if not scope.tokens:
        x.queue.append(scope)
    collect_letters(x, scope)


def check_container(x: Execution, scope: Scope) -> None:
    """A scope in which a token was consumed: if it was the last one, the scope has completed."""
    if scope.loop is not None:
        begin_instances(x, scope)
    elif not scope.tokens:
        finish(x, scope)
    elif scope.container.event_subprocesses and not (scope.completing or scope.interrupted):
        _complete_handlers(x, scope)


def _complete_handlers(x: Execution, scope: Scope) -> None:
    """A scope whose own work is done waits for its event subprocesses, and begins no more of them
    (clause 13.3.2: it is completing)."""
    handlers = scope.container.event_subprocesses
    if all(token.node in handlers for token in scope.tokens.values()):
        owner = scope.owner
        element = owner.node.id if owner is not None else scope.container.id
        x.emit(r.ScopeCompleting(scope.id, scope.container.process.id, element))


def finish(x: Execution, scope: Scope, outcome: TokenOutcome = TokenOutcome.COMPLETED) -> None:
    """A scope has ended: its activity goes on, or, without one, perhaps the run is over.

    `outcome` TERMINATED: by a terminate end event in it.
    """
    token = scope.owner
    if token is None:
        close(x, scope, outcome)
        if not x.state.scopes:
            end_run(x, RunOutcome.COMPLETED)
        return
    node = token.node
    values = None
    if isinstance(node, CallActivity):
        values = evaluate(x, token, node.mappings.outputs, reader(scope))
        if values is None:
            return
    close(x, scope, outcome)
    write_values(x, token, token, values or [])
    complete(x, token, outcome)


COMPLETE = "complete"
"""The decision that nothing more is to be done."""


def ad_hoc(x: Execution, token: Token) -> None:
    """Open its scope, and have the first activities chosen."""
    node = token.node
    assert isinstance(node, AdHocSubProcess)
    scope = open_inside(x, token)
    if scope is None:
        return
    if node.event_subprocesses and not arm_event_subprocesses(x, scope):
        return
    if node.active_elements is not None:
        chosen = _evaluate_active_elements(x, token, node, node.active_elements)
        if chosen is None:
            return
        x.emit(r.ActivitiesChosen(token.id, x.process_of(node), node.id, scope.id, chosen))
    _go_on(x, token, node, scope)
    collect_letters(x, scope)


def check_ad_hoc(x: Execution, scope: Scope) -> None:
    """An activity in it has completed: perhaps all of it has."""
    token = scope.owner
    assert token is not None
    node = token.node
    assert isinstance(node, AdHocSubProcess)
    if scope.interrupted:
        if not scope.tokens:
            _finish_ad_hoc(x, token, scope)
        return
    if node.completion is not None and scope.begun:
        try:
            complete = node.completion.holds(reader(scope))
        except ExpressionError as error:
            throw_error(x, token, "EXPRESSION", f"completionCondition of {node.id}: {error}")
            return
        if complete:
            if node.cancel_remaining:
                empty(x, scope, TokenOutcome.INTERRUPTED)
            if scope.tokens:
                _withdraw_prompt(x, token)
            else:
                _finish_ad_hoc(x, token, scope)
            return
    _go_on(x, token, node, scope)


def chosen(x: Execution, token: Token, decision: str) -> None:
    """An operator has chosen what to do next."""
    node, scope = token.node, token.inner
    assert isinstance(node, AdHocSubProcess)
    assert scope is not None
    if decision == COMPLETE:
        empty(x, scope, TokenOutcome.INTERRUPTED)
        _finish_ad_hoc(x, token, scope)
        return
    x.spawn(next(each for each in node.entries if each.id == decision), scope)
    _go_on(x, token, node, scope)


def _go_on(x: Execution, token: Token, node: AdHocSubProcess, scope: Scope) -> None:
    """Begin what was chosen, or ask what to begin next."""
    one_at_a_time = node.ordering is AdHocOrdering.SEQUENTIAL
    if node.active_elements is not None:
        while scope.chosen and not (one_at_a_time and scope.tokens):
            x.spawn(scope.chosen[0], scope)
    elif node.entries:
        if not (one_at_a_time and scope.tokens):
            _ask(x, token, node, scope)
        return
    if not scope.tokens:
        _finish_ad_hoc(x, token, scope)


def _ask(x: Execution, token: Token, node: AdHocSubProcess, scope: Scope) -> None:
    """Ask the operators; what has not been done yet comes first."""
    new = [each for each in node.entries if each not in scope.begun]
    again = [each for each in node.entries if each in scope.begun]
    decisions = [_decision(each) for each in new]
    if node.completion is None and (node.cancel_remaining or not scope.tokens):
        decisions.append({"value": COMPLETE, "label": f"Complete {node.label}"})
    decisions += [_decision(each) for each in again]
    if token.prompt:
        if x.state.prompts[token.prompt].decisions == tuple(decisions):
            return
        _withdraw_prompt(x, token)
    x.emit(
        r.PromptOpened(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"p{x.state.last_prompt + 1}",
            f"{node.label}: what is to be done next?",
            tuple(decisions),
        )
    )


def _decision(node: FlowNode) -> dict[str, str]:
    return {"value": node.id, "label": node.label}


def _withdraw_prompt(x: Execution, token: Token) -> None:
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))


def _finish_ad_hoc(x: Execution, token: Token, scope: Scope) -> None:
    _withdraw_prompt(x, token)
    finish(x, scope)


def _evaluate_active_elements(
    x: Execution, token: Token, node: AdHocSubProcess, expression: Expression
) -> tuple[str, ...] | None:
    """The ids that the subprocess's own expression gives; None: its error was thrown."""
    known = {each.local_id: each.id for each in node.entries}
    try:
        value = expression.evaluate(reader(token))
    except ExpressionError as error:
        throw_error(x, token, "EXPRESSION", f"activeElements of {node.id}: {error}")
        return None
    wrong = value if not isinstance(value, list) else [v for v in value if v not in known]
    if wrong or not isinstance(value, list):
        reason = (
            f"activeElements of {node.id}: {wrong!r} is no list of the elements that can begin "
            f"there: {', '.join(known)}"
        )
        throw_error(x, token, "EXPRESSION", reason)
        return None
    return tuple(known[str(each)] for each in value)


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


def check_scope(x: Execution, scope: Scope) -> None:
    """Something in a scope has ended: the scope may have completed, or its compensation goes on."""
    if scope.compensations:
        advance(x, scope)
    elif scope.cancelled or scope.reopened:
        if not scope.tokens:
            leave = leave_cancelled if scope.cancelled else close_undone
            leave(x, scope)
    elif isinstance(scope.container, AdHocSubProcess) and scope.loop is None:
        check_ad_hoc(x, scope)
    else:
        check_container(x, scope)
