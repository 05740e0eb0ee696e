"""Behaviors whose vehicle or payload is lost: the task's error, or another one that does the rest.

A role with `onLoss="reassign"` has the rest done by another: the token stays, and asks for
resources again with the parameters of what is left. What was lost is not chosen for it again until
it has returned. When no other can do it, the error of the loss is thrown.
"""

from collections.abc import Sequence

from m2pem.engine import records as r
from m2pem.engine.elements.allocations import request_allocation
from m2pem.engine.execution import Execution
from m2pem.engine.state import Behavior, RunStatus, Token
from m2pem.engine.throwing import throw_error
from m2pem.mission.behavior import BehaviorType, OnLoss
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import ScriptTask, SendTask, ServiceTask
from m2pem.mission.losses import is_excluded, is_loss


def end_work(
    x: Execution,
    token: Token,
    behavior: Behavior,
    code: str,
    reason: str,
    resources: Sequence[str],
    state: BehaviorState | None = None,
) -> None:
    """Throw the error of a behavior that has not succeeded, or have the rest of it done by others.

    `resources`: those that may be lost. `state`: with which it was reported; None: a fault of the
    resources ends it.
    """
    if x.state.status is RunStatus.RUNNING and is_reassigned(
        token, behavior, code, resources, state
    ):
        _reassign(x, token, behavior, code, reason, resources)
    else:
        throw_error(x, token, code, reason, behavior=behavior)


def is_reassigned(
    token: Token,
    behavior: Behavior,
    code: str,
    resources: Sequence[str],
    state: BehaviorState | None = None,
) -> bool:
    """Whether another is looked for that does the rest: all roles that lost something say so."""
    node = token.node
    if not is_loss(BehaviorType(behavior.type), state, code):
        return False
    if not isinstance(node, ScriptTask | ServiceTask | SendTask) or node.behavior is None:
        return False
    lost = [
        role
        for role in node.behavior.roles
        if not set(resources).isdisjoint(behavior.roles.get(role.name, ()))
    ]
    return bool(lost) and all(role.on_loss is OnLoss.REASSIGN for role in lost)


def _reassign(
    x: Execution,
    token: Token,
    behavior: Behavior,
    code: str,
    reason: str,
    resources: Sequence[str],
) -> None:
    node = token.node
    assert isinstance(node, ScriptTask | ServiceTask | SendTask)
    assert node.behavior is not None
    parameters = {**behavior.parameters, **(behavior.remaining or {})}
    x.emit(
        r.WorkReassigned(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            behavior.id,
            code,
            reason,
            parameters,
            tuple(resources) if is_excluded(code) else (),
        )
    )
    request_allocation(x, token, node.behavior, parameters)
