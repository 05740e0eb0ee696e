"""Requests for resources that are chosen when a task starts (docs/allocation.md).

A task whose roles say what they need, or wait, or whose vehicles may have to wait for space, asks
the allocator of its executive, which knows the telemetry and the other runs. Its choice is an
input, so that a replay and a resume have the same.
"""

from collections.abc import Mapping, Sequence

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.arming import await_event, due_after
from m2pem.engine.execution import Execution
from m2pem.engine.incidents import incident_holding, open_incident
from m2pem.engine.keeping import keep_resources, kept_for_others
from m2pem.engine.records import Trigger
from m2pem.engine.state import AllocationRequest, BehaviorPhase, Token
from m2pem.engine.throwing import throw_error
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.behavior import Behavior, OnLoss, Role
from m2pem.mission.elements import ScriptTask, SendTask, ServiceTask
from m2pem.mission.losses import UNAVAILABLE
from m2pem.mission.values import Value
from m2pem.units import US_PER_S


def request_allocation(
    x: Execution, token: Token, behavior: Behavior, parameters: dict[str, Value]
) -> None:
    """Ask for the resources of a behavior, some of which are to be chosen or waited for now."""
    node = token.node
    try:
        limits = [
            due_after(x, token, role.need.wait_limit)
            for role in behavior.roles
            if role.need is not None and role.need.wait_limit is not None
        ]
    except (ExpressionError, ExpressionSyntaxError) as error:
        throw_error(x, token, "EXPRESSION", f"wait of {node.id}: {error}")
        return
    deadline = 0
    if limits:
        await_event(x, token, node, Trigger.TIMER, due_us=min(limits))
        deadline = x.state.last_wait
    x.emit(
        r.AllocationRequested(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"{x.state.run}.a{x.state.last_allocation + 1}",
            behavior.name,
            behavior.type.value,
            parameters,
            deadline,
            x.now_us,
        )
    )


def resources_chosen(x: Execution, item: i.ResourcesChosen) -> None:
    """Request the behavior on the resources that were chosen for it."""
    request = x.state.allocations.get(item.allocation)
    if request is None:
        x.ignore(f"request {item.allocation} has ended")
        return
    token, behavior = request.token, behavior_of(request)
    resources = tuple(dict.fromkeys(each for chosen in item.roles.values() for each in chosen))
    if refusal := refusal_of(x, token, resources):
        x.emit(r.AllocationDelayed(request.id, refusal, {}, again=True))
        return
    x.emit(
        r.ResourcesAllocated(
            token.id,
            x.process_of(token.node),
            token.node.id,
            token.scope.id,
            request.id,
            item.roles,
            item.considered,
        )
    )
    store_chosen(x, token, behavior, item.roles)
    emit_behavior(x, token, behavior, resources, item.roles, request.parameters, request.id)


def store_chosen(
    x: Execution, token: Token, behavior: Behavior, roles: Mapping[str, Sequence[str]]
) -> None:
    """Write what was chosen for the roles of a behavior, under the names that they say."""
    for role in behavior.roles:
        if role.need is not None and role.need.store and role.name in roles:
            x.write(token, role.need.store, stored(role, roles[role.name]))


def stored(role: Role, resources: Sequence[str]) -> Value:
    """Return what is stored for a role: the resource, or the list of those of a role for many."""
    assert role.need is not None
    return resources[0] if role.need.most == 1 else list(resources)


def behavior_of(request: AllocationRequest) -> Behavior:
    """Return the behavior whose resources are asked for."""
    node = request.token.node
    assert isinstance(node, ScriptTask | ServiceTask | SendTask)
    assert node.behavior is not None
    return node.behavior


def refusal_of(x: Execution, token: Token, resources: Sequence[str]) -> str:
    """Return why the behavior of a task cannot have resources: an operator, an incident or another
    behavior of the run has one, or it is kept for other tasks; "" if it can."""
    for resource in resources:
        if incident := incident_holding(x.state, resource):
            return f"{resource} is held for incident {incident}"
        if resource in x.state.taken:
            return f"{resource} is with {x.state.taken[resource]}"
        if why := kept_for_others(x.state, token, resource):
            return why
        for holder in x.state.held.get(resource, ()):
            held_by = x.state.behaviors[holder]
            if held_by.phase is not BehaviorPhase.CANCELLING:
                return f"{resource} is held by {held_by.name} of {held_by.element} ({holder})"
    return ""


def emit_behavior(
    x: Execution,
    token: Token,
    behavior: Behavior,
    resources: Sequence[str],
    roles: Mapping[str, Sequence[str]],
    parameters: dict[str, Value],
    allocation: str = "",
) -> None:
    """Record that a behavior is requested; its resources have no holder that goes on."""
    node = token.node
    held = x.state.held
    preempts = dict.fromkeys(holder for each in resources for holder in held.get(each, ()))
    x.emit(
        r.BehaviorRequested(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            f"{x.state.run}.b{x.state.last_behavior + 1}",
            behavior.name,
            behavior.type.value,
            tuple(resources),
            {role: tuple(ids) for role, ids in roles.items()},
            parameters,
            tuple(preempts),
            allocation,
        )
    )
    keep_resources(x, token, behavior, roles)


def resources_not_free(x: Execution, item: i.ResourcesNotFree) -> None:
    """Let a task wait for its resources, or throw its error."""
    request = x.state.allocations.get(item.allocation)
    if request is None:
        x.ignore(f"request {item.allocation} has ended")
    elif item.code:
        _fail(x, request, item.code, item.reason)
    elif (request.reason, request.holders) == (item.reason, item.holders):
        x.ignore(f"it is known what {item.allocation} waits for")
    else:
        deadline = _limit(x, request, item.wait_s)
        x.emit(r.AllocationDelayed(request.id, item.reason, item.holders, deadline=deadline))


def _limit(x: Execution, request: AllocationRequest, wait_s: float | None) -> int:
    """Limit the wait of a request whose roles do not say how long it waits. Returns the wait of its
    timer; 0: none was armed."""
    needs = (role.need for role in behavior_of(request).roles)
    if wait_s is None or request.deadline or any(each and each.waits for each in needs):
        return 0
    due_us = x.state.mission_time_us(x.now_us) + round(wait_s * US_PER_S)
    await_event(x, request.token, request.token.node, Trigger.TIMER, due_us=due_us)
    return x.state.last_wait


def allocation_timed_out(x: Execution, token: Token) -> None:
    """Throw RESOURCE_UNAVAILABLE: the task has waited for its resources as long as it may."""
    request = x.state.allocations[token.allocation]
    waited = f"{token.node.label!r} waited for its resources as long as it may"
    reason = f"{waited}: {request.reason}" if request.reason else waited
    _fail(x, request, UNAVAILABLE, reason)


def _fail(x: Execution, request: AllocationRequest, code: str, reason: str) -> None:
    lost = request.token.lost_work
    if lost is not None and code == UNAVAILABLE:
        code = lost.loss.code
        reason = f"{lost.loss.reason}; no other does what is left: {reason}"
    x.emit(r.AllocationEnded(request.id, code, reason))
    asks = any(role.on_loss is OnLoss.ASK for role in behavior_of(request).roles)
    if lost is not None and asks:
        open_incident(x, request.token, code, reason)
    else:
        throw_error(x, request.token, code, reason)
