"""Subprocesses and call activities (BPMN 2.0.2, clauses 10.3.5, 10.3.6 and 13.3.4)."""

from m2pem.engine import records as r
from m2pem.engine.data import flatten, reader
from m2pem.engine.data_flow import evaluate, write_values
from m2pem.engine.elements.completion import complete
from m2pem.engine.elements.loops import begin_instances
from m2pem.engine.execution import Execution
from m2pem.engine.interruption import end_run
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import close, open_scope
from m2pem.engine.state import Scope, Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import arm_event_subprocesses, collect_letters
from m2pem.mission.elements import CallActivity

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


def look_at(x: Execution, scope: Scope) -> None:
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
