"""Subprocesses, call activities, ad-hoc subprocesses and transactions, and the scopes they open.

BPMN 2.0.2, clauses 10.3.5, 10.3.6 and 13.3.4 to 13.5.6. The activities of an ad-hoc subprocess are
chosen by the operators, who are asked, or by its own expression; its completion condition is
evaluated after each activity. A transaction that completes is a subprocess that completes. An error
that leaves it is not followed by compensation (a "hazard"). A cancel end event ends all in it and
compensates what was done in it; then the token leaves by its cancel boundary event.
"""

from m2pem.engine import records as r
from m2pem.engine.compensation import advance_compensations, close_compensated, compensate_all
from m2pem.engine.data import flatten, reader
from m2pem.engine.data_flow import evaluate, write_values
from m2pem.engine.elements.activities import complete
from m2pem.engine.elements.loops import begin_instances
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import close_scope, end_run, end_tokens, open_scope, stop_activity
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import arm_event_subprocesses, take_kept_messages
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Activity, AdHocOrdering, AdHocSubProcess, CallActivity, FlowNode
from m2pem.mission.events import CancelEventDefinition
from m2pem.mission.expression import Expression

MAX_DEPTH = 1000
"""Nested scopes that are allowed; more is a process that calls itself without end."""


def subprocess(x: Execution, token: Token) -> None:
    """Open the scope of a subprocess and begin what is in it."""
    if token.inner is not None:
        # An event subprocess that its trigger has begun.
        if arm_event_subprocesses(x, token.inner):
            take_kept_messages(x, token.inner)
        return
    scope = open_inside(x, token)
    if scope is not None:
        begin(x, scope)


def call_activity(x: Execution, token: Token) -> None:
    """Open an instance of the called process; only its mappings pass data in and out."""
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
    """Open the scope of an activity. None: it is too deep, and error RECURSION was thrown."""
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
    """Put a token on each start event of the scope's container (paper, section 4.1)."""
    if scope.container.event_subprocesses and not arm_event_subprocesses(x, scope):
        return
    for entry in scope.container.entries:
        x.spawn(entry, scope)
    if not scope.tokens:
        x.queue.append(scope)
    take_kept_messages(x, scope)


def check_container(x: Execution, scope: Scope) -> None:
    """Complete a scope if its last token was consumed."""
    if scope.loop is not None:
        begin_instances(x, scope)
    elif not scope.tokens:
        finish(x, scope)
    elif scope.container.event_subprocesses and not (scope.completing or scope.interrupted):
        _complete_handlers(x, scope)


def _complete_handlers(x: Execution, scope: Scope) -> None:
    """Note that only event subprocesses are left in a scope: it begins no more of them (13.3.2)."""
    handlers = scope.container.event_subprocesses
    if all(token.node in handlers for token in scope.tokens.values()):
        owner = scope.owner
        element = owner.node.id if owner is not None else scope.container.id
        x.emit(r.ScopeCompleting(scope.id, scope.container.process.id, element))


def finish(x: Execution, scope: Scope, outcome: TokenOutcome = TokenOutcome.COMPLETED) -> None:
    """Close a scope that has ended: its activity completes; without one, the run may end.

    `outcome` is TERMINATED when a terminate end event in it has ended it.
    """
    token = scope.owner
    if token is None:
        close_scope(x, scope, outcome)
        if not x.state.scopes:
            end_run(x, RunOutcome.COMPLETED)
        return
    node = token.node
    values = None
    if isinstance(node, CallActivity):
        values = evaluate(x, token, node.mappings.outputs, reader(scope))
        if values is None:
            return
    close_scope(x, scope, outcome)
    write_values(x, token, token, values or [])
    complete(x, token, outcome)


COMPLETE = "complete"
"""The decision of an operator to complete the ad-hoc subprocess."""


def ad_hoc(x: Execution, token: Token) -> None:
    """Open the scope of an ad-hoc subprocess, and choose its first activities."""
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
    take_kept_messages(x, scope)


def check_ad_hoc(x: Execution, scope: Scope) -> None:
    """Check an ad-hoc subprocess in which an activity has completed."""
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
                end_tokens(x, scope, TokenOutcome.INTERRUPTED)
            if scope.tokens:
                _withdraw_prompt(x, token)
            else:
                _finish_ad_hoc(x, token, scope)
            return
    _go_on(x, token, node, scope)


def answer_ad_hoc(x: Execution, token: Token, decision: str) -> None:
    """Begin the activity that an operator has chosen, or complete the subprocess."""
    node, scope = token.node, token.inner
    assert isinstance(node, AdHocSubProcess)
    assert scope is not None
    if decision == COMPLETE:
        end_tokens(x, scope, TokenOutcome.INTERRUPTED)
        _finish_ad_hoc(x, token, scope)
        return
    x.spawn(next(each for each in node.entries if each.id == decision), scope)
    _go_on(x, token, node, scope)


def _go_on(x: Execution, token: Token, node: AdHocSubProcess, scope: Scope) -> None:
    """Begin the chosen activities, or prompt the operators for the next one."""
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
    """Open a prompt for the next activity; activities that were not begun yet come first."""
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
    x.open_prompt(token, f"{node.label}: what is to be done next?", decisions)


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
    """Return the ids that `activeElements` gives; None: error EXPRESSION was thrown."""
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
    """End a transaction at the cancel end event that a token is on, and compensate it.

    Until that is done, its boundary events and event subprocesses wait for nothing; only what is
    thrown during its compensation is still caught.
    """
    scope, node = token.scope, token.node
    x.leave(token, TokenOutcome.COMPLETED)
    end_tokens(x, scope, TokenOutcome.TERMINATED)
    x.emit(r.TransactionCancelled(token.id, x.process_of(node), node.id, scope.id))
    compensate_all(x, token, scope)


def leave_cancelled(x: Execution, scope: Scope) -> None:
    """Leave a compensated transaction by its cancel boundary event; without one, the token ends.

    An instance of a multi-instance transaction ends the others too, as boundary events do.
    """
    outer = scope.owner
    assert outer is not None
    while outer.instance is not None:
        assert outer.scope.owner is not None
        outer = outer.scope.owner
    node = outer.node
    assert isinstance(node, Activity)
    stop_activity(x, outer, TokenOutcome.TERMINATED)
    x.leave(outer, TokenOutcome.TERMINATED)
    x.queue.append(outer.scope)
    for boundary in node.boundary:
        if any(isinstance(each, CancelEventDefinition) for each in boundary.definitions):
            x.enter(outer.id, boundary, outer.scope)
            return


def check_scope(x: Execution, scope: Scope) -> None:
    """Something in a scope has ended: the scope may have completed, or its compensation goes on."""
    if scope.compensations:
        advance_compensations(x, scope)
    elif scope.cancelled or scope.reopened:
        if not scope.tokens:
            leave = leave_cancelled if scope.cancelled else close_compensated
            leave(x, scope)
    elif isinstance(scope.container, AdHocSubProcess) and scope.loop is None:
        check_ad_hoc(x, scope)
    else:
        check_container(x, scope)
