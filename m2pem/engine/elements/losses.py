"""Behaviors whose vehicle or payload is lost: the task's error, another one that does the rest, or
an operator's choice.

A role with `onLoss="reassign"` has the rest done by another: the token stays, and asks for
resources again with the parameters of what is left. What was lost is not chosen for it again until
it has returned. When no other can do it, the error of the loss is thrown. With `onLoss="ask"`, an
incident opens; to retry then means to do what is left.
"""

from collections.abc import Sequence

from m2pem.engine import records as r
from m2pem.engine.elements.allocations import request_allocation
from m2pem.engine.execution import Execution
from m2pem.engine.incidents import behavior_at, open_incident
from m2pem.engine.keeping import end_keeping
from m2pem.engine.state import Behavior, RunStatus, Token
from m2pem.engine.throwing import throw_error
from m2pem.mission.behavior import BehaviorType, OnLoss
from m2pem.mission.catalogue import BehaviorState
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
    on_loss = OnLoss.FAIL
    if x.state.status is RunStatus.RUNNING:
        on_loss = what_is_done(token, behavior, code, resources, state)
    node = token.node
    task = behavior_at(node)
    if on_loss is OnLoss.FAIL or task is None:
        throw_error(x, token, code, reason, behavior=behavior)
        return
    asks = on_loss is OnLoss.ASK
    left = behavior.left
    parameters = {**behavior.parameters, **(left or {})}
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
            tuple(resources) if is_excluded(code) and not asks else (),
            asks,
            left,
        )
    )
    if asks:
        open_incident(x, token, code, reason, behavior)
    else:
        if is_excluded(code):
            for resource in resources:
                end_keeping(x, resource, f"{code}: another does the rest")
        request_allocation(x, token, task, parameters)


def what_is_done(
    token: Token,
    behavior: Behavior,
    code: str,
    resources: Sequence[str],
    state: BehaviorState | None = None,
) -> OnLoss:
    """Return what all roles say that have lost something; FAIL: also if they say different things,
    or if the end of the behavior is no loss."""
    task = behavior_at(token.node)
    if task is None or not is_loss(BehaviorType(behavior.type), state, code):
        return OnLoss.FAIL
    said = {
        role.on_loss
        for role in task.roles
        if not set(resources).isdisjoint(behavior.roles.get(role.name, ()))
    }
    return said.pop() if len(said) == 1 else OnLoss.FAIL
