"""Ending things before their time: interruptions, errors and escalations.

An interruption takes effect at once, before the next step of the scope that it ends.
"""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.state import Scope, Token
from m2pem.model.elements import Activity, BoundaryEvent
from m2pem.model.events import (
    ErrorEventDefinition,
    Escalation,
    EscalationEventDefinition,
)


def withdraw(x: Execution, token: Token, outcome: TokenOutcome, code: str = "") -> None:
    """End what the activity under a token does: its behavior, prompt, service or inside."""
    if token.behavior:
        x.emit(r.BehaviorCancelRequested(token.behavior, code))
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    if token.service:
        x.emit(r.ServiceWithdrawn(token.service))
    if token.inner is not None:
        kill(x, token.inner, outcome)


def kill(x: Execution, scope: Scope, outcome: TokenOutcome) -> None:
    """End a scope and all within it, innermost first."""
    empty(x, scope, outcome)
    close(x, scope, outcome)


def empty(x: Execution, scope: Scope, outcome: TokenOutcome) -> None:
    """End every token of a scope, and all within it, but not the scope itself."""
    doomed = [scope]
    for each in doomed:
        doomed.extend(token.inner for token in each.tokens.values() if token.inner is not None)
    for each in reversed(doomed):
        for token in list(each.tokens.values()):
            withdraw(x, token, outcome)
            x.leave(token, outcome)
        if each is not scope:
            close(x, each, outcome)


def close(x: Execution, scope: Scope, outcome: TokenOutcome) -> None:
    """State that a scope has ended. Nothing may be left in it."""
    if scope.owner is not None:
        node = scope.owner.node
        process, element = x.process_of(node), node.id
    else:
        process = element = scope.container.id
    x.emit(r.ScopeClosed(scope.id, process, element, outcome))


def divert(x: Execution, token: Token, boundary: BoundaryEvent, outcome: TokenOutcome) -> Token:
    """Move a token from its activity to a boundary event of it, ending what it did there.

    The activity's other boundary events are disarmed with it (paper, section 4.4).
    """
    withdraw(x, token, outcome)
    x.leave(token, outcome)
    return x.enter(token.id, boundary, token.scope)


def end_run(x: Execution, outcome: RunOutcome, detail: str = "") -> None:
    """End the run and all that is active in it."""
    left = TokenOutcome.FAILED if outcome is RunOutcome.FAILED else TokenOutcome.TERMINATED
    for scope in [scope for scope in x.state.scopes.values() if scope.parent is None]:
        kill(x, scope, left)
    x.queue.clear()
    x.emit(r.RunEnded(outcome, detail))


# --- errors -------------------------------------------------------------------------------------


def throw_error(
    x: Execution, token: Token, code: str, reason: str = "", *, leaving: bool = False
) -> None:
    """Throw an error where a token is; it goes up scope by scope (BPMN 2.0.2, clause 10.5.7).

    An activity's own boundary events are asked first, then those of the activity around it, and so
    on. What catches it ends the activity. Uncaught, the run fails. `leaving`: the token has done
    its part with this (an error end event).
    """
    node = token.node
    caught = _error_catcher(token, code)
    x.emit(
        r.ErrorThrown(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            code,
            reason,
            caught[1].id if caught is not None else "",
        )
    )
    if leaving:
        x.leave(token, TokenOutcome.COMPLETED)
    if caught is None:
        because = f": {reason}" if reason else ""
        end_run(
            x, RunOutcome.FAILED, f"error {code} from {node.id} was caught by no boundary{because}"
        )
    else:
        divert(x, caught[0], caught[1], TokenOutcome.FAILED)


def _error_catcher(token: Token, code: str) -> tuple[Token, BoundaryEvent] | None:
    """Nearest boundary event that catches the code; one that names it before one that takes all."""
    current: Token | None = token
    while current is not None:
        if isinstance(current.node, Activity):
            for_all = None
            for boundary in current.node.boundary:
                for definition in boundary.definitions:
                    if isinstance(definition, ErrorEventDefinition):
                        if definition.error is None:
                            for_all = for_all or boundary
                        elif definition.error.code == code:
                            return current, boundary
            if for_all is not None:
                return current, for_all
        current = current.scope.owner
    return None


# --- escalations --------------------------------------------------------------------------------


def throw_escalation(
    x: Execution, token: Token, escalation: Escalation, *, leaving: bool = False
) -> bool:
    """Throw an escalation from the event under a token; the nearest outer activity catches it.

    Returns whether the scope goes on: an interrupting catch ends it. `leaving`: the token has done
    its part with this (an escalation end event).
    """
    node = token.node
    caught = _escalation_catcher(token, escalation)
    x.emit(
        r.EscalationThrown(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            escalation.id,
            escalation.code,
            caught[1].id if caught is not None else "",
        )
    )
    if leaving:
        x.leave(token, TokenOutcome.COMPLETED)
    if caught is None:
        return True
    host, boundary = caught
    if not boundary.interrupting:
        x.spawn(boundary, host.scope)
        return True
    divert(x, host, boundary, TokenOutcome.INTERRUPTED)
    return False


def _escalation_catcher(token: Token, escalation: Escalation) -> tuple[Token, BoundaryEvent] | None:
    host = token.scope.owner
    while host is not None:
        if isinstance(host.node, Activity):
            for_all = None
            for boundary in host.node.boundary:
                for definition in boundary.definitions:
                    if isinstance(definition, EscalationEventDefinition):
                        if definition.escalation is None:
                            for_all = for_all or boundary
                        elif definition.escalation.code == escalation.code:
                            return host, boundary
            if for_all is not None:
                return host, for_all
        host = host.scope.owner
    return None
