"""Opening and ending scopes, and what is active in them (BPMN 2.0.2, clause 13.3.2)."""

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Scope, Token


def open_scope(x: Execution, token: Token) -> Scope:
    """Open the scope of the activity that a token is on."""
    node = token.node
    number = x.state.last_scope + 1
    x.emit(r.ScopeOpened(number, x.process_of(node), node.id, token.scope.id, token.id))
    return x.state.scopes[number]


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
