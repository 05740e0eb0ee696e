"""Ad-hoc subprocesses (BPMN 2.0.2, clauses 10.3.5 and 13.3.5).

What is done in one, how often and in which order, is a matter of choice: of the operators, who are
asked, or of the subprocess's own expression. Its completion condition is asked after each activity.
"""

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.elements.containers import finish, open_inside
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.scopes import empty
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import arm_event_subprocesses, collect_letters
from m2pem.errors import ExpressionError
from m2pem.mission.elements import AdHocOrdering, AdHocSubProcess, FlowNode
from m2pem.mission.expression import Expression

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
        chosen = _evaluate(x, token, node, node.active_elements)
        if chosen is None:
            return
        x.emit(r.ActivitiesChosen(token.id, x.process_of(node), node.id, scope.id, chosen))
    _go_on(x, token, node, scope)
    collect_letters(x, scope)


def look_at(x: Execution, scope: Scope) -> None:
    """An activity in it has completed: perhaps all of it has."""
    token = scope.owner
    assert token is not None
    node = token.node
    assert isinstance(node, AdHocSubProcess)
    if scope.interrupted:
        if not scope.tokens:
            _finish(x, token, scope)
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
                _finish(x, token, scope)
            return
    _go_on(x, token, node, scope)


def chosen(x: Execution, token: Token, decision: str) -> None:
    """An operator has chosen what to do next."""
    node, scope = token.node, token.inner
    assert isinstance(node, AdHocSubProcess)
    assert scope is not None
    if decision == COMPLETE:
        empty(x, scope, TokenOutcome.INTERRUPTED)
        _finish(x, token, scope)
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
        _finish(x, token, scope)


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


def _finish(x: Execution, token: Token, scope: Scope) -> None:
    _withdraw_prompt(x, token)
    finish(x, scope)


def _evaluate(
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
