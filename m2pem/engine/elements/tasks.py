"""Tasks: what each kind does (BPMN 2.0.2, clause 10.3.3; paper, sections 4.1 and 4.2)."""

from m2pem.engine import records as r
from m2pem.engine.arming import arm_events, await_event, due_after
from m2pem.engine.data import reader
from m2pem.engine.elements.activities import complete
from m2pem.engine.elements.behaviors import request_behavior
from m2pem.engine.execution import Execution
from m2pem.engine.records import Trigger
from m2pem.engine.state import Token
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import send, take_kept_messages
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.mission.behavior import Assignment, ServiceCall
from m2pem.mission.elements import (
    ReceiveTask,
    ScriptTask,
    SendTask,
    ServiceTask,
    UserTask,
)
from m2pem.mission.expression import Expression
from m2pem.mission.values import Value


def pass_through(x: Execution, token: Token) -> None:
    """Complete a task that has no work of its own, or none that m2pem knows."""
    complete(x, token)


def user_task(x: Execution, token: Token) -> None:
    """Open the prompt of a user task; an answer completes it (paper, section 4.1)."""
    node = token.node
    assert isinstance(node, UserTask)
    assert node.prompt is not None
    prompt = node.prompt
    if prompt.timeout is not None:
        try:
            due_us = due_after(x, token, prompt.timeout)
        except (ExpressionError, ExpressionSyntaxError) as error:
            throw_error(x, token, "EXPRESSION", f"timeout of {node.id}: {error}")
            return
        await_event(x, token, node, Trigger.TIMER, due_us=due_us)
    decisions = ({"value": each.value, "label": each.label} for each in prompt.decisions)
    x.open_prompt(token, prompt.text, decisions, prompt.role)


def prompt_timed_out(x: Execution, token: Token) -> None:
    """Throw error PROMPT_TIMEOUT: no operator answered in time."""
    throw_error(x, token, "PROMPT_TIMEOUT", f"no answer to {token.node.label!r} in time")


def answer_user_task(x: Execution, token: Token, decision: str) -> None:
    """Store an operator's decision and complete the task."""
    node = token.node
    assert isinstance(node, UserTask)
    assert node.prompt is not None
    x.write(token, node.prompt.store, decision)
    complete(x, token)


def script_task(x: Execution, token: Token) -> None:
    """Request a behavior (paper, section 4.2), or run the assignments of a script."""
    node = token.node
    assert isinstance(node, ScriptTask)
    if node.behavior is not None:
        request_behavior(x, token, node.behavior)
    else:
        _run_script(x, token, node)


def _run_script(x: Execution, token: Token, node: ScriptTask) -> None:
    for number, statement in enumerate(node.script.statements if node.script is not None else ()):
        if isinstance(statement, Assignment):
            try:
                value = statement.expression.evaluate(reader(token), new_limit=number == 0)
            except ExpressionError as error:
                throw_error(x, token, "EXPRESSION", f"line {statement.line}: {error}")
                return
            x.write(token, statement.key, value)
        else:
            throw_error(x, token, statement.code, f"thrown at line {statement.line}")
            return
    complete(x, token)


def service_task(x: Execution, token: Token) -> None:
    """Run a registered service (paper, section 4.1), or request a behavior."""
    node = token.node
    assert isinstance(node, ServiceTask)
    if node.behavior is not None:
        request_behavior(x, token, node.behavior)
    elif node.call is not None:
        _request_service(x, token, node.call)
    else:
        complete(x, token)


def _request_service(x: Execution, token: Token, call: ServiceCall) -> None:
    node = token.node
    properties: dict[str, Value] = {}
    read = reader(token)
    for item in call.properties:
        if isinstance(item.value, Expression):
            try:
                properties[item.name] = item.value.evaluate(read)
            except ExpressionError as error:
                throw_error(x, token, "EXPRESSION", f"property {item.name}: {error}")
                return
        else:
            properties[item.name] = item.value
    try:
        allocation = allocate(call, x.fleet)
    except AllocationError as error:
        throw_error(x, token, "RESOURCE_UNAVAILABLE", str(error))
        return
    x.emit(
        r.ServiceRequested(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"s{x.state.last_service + 1}",
            call.service,
            {role: tuple(ids) for role, ids in allocation.roles.items()},
            properties,
        )
    )


def send_task(x: Execution, token: Token) -> None:
    """Throw a message, or request a behavior."""
    node = token.node
    assert isinstance(node, SendTask)
    if node.behavior is not None:
        request_behavior(x, token, node.behavior)
        return
    if node.message is not None:
        send(x, token, node.message.id)
        if not x.is_active(token):
            return
    complete(x, token)


def receive_task(x: Execution, token: Token) -> None:
    """Wait for a message; a receive task without one completes at once."""
    node = token.node
    assert isinstance(node, ReceiveTask)
    if node.message is None:
        complete(x, token)
        return
    arm_events(x, token, [node])
    take_kept_messages(x, token)
