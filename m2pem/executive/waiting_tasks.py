"""Which tasks of all runs wait for vehicles and payloads, in the order in which they are served,
and which task has what they wait for."""

from collections.abc import Iterable, Mapping
from pathlib import PurePath

from m2pem.api.allocation import WaitingTask
from m2pem.api.runs import RunId
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.state import AllocationRequest, RunState
from m2pem.executive.runner import Runner
from m2pem.units import US_PER_S


def waiting_tasks(runners: Iterable[Runner], now_us: int) -> list[WaitingTask]:
    """Return the tasks that wait: the greatest priority first, then what asked first.

    `now_us`: microseconds since the Unix epoch by the executive's clock.
    """
    requests = [
        (runner.run.state, request)
        for runner in runners
        for request in runner.run.state.allocations.values()
        if request.reason
    ]
    requests.sort(key=_place)
    return [_task(state, request, now_us) for state, request in requests]


def holder_label(runners: Mapping[RunId, Runner], holder: str, *, mission: bool = False) -> str:
    """Return the task and run of a behavior, request, incident or keeping, in words; "" if it is
    not known. `mission`: also the name of the run's mission."""
    runner = runners.get(RunId(holder.partition(".")[0]))
    if runner is None:
        return ""
    state = runner.run.state
    run = f"{state.run} ({PurePath(state.mission.file).stem})" if mission else state.run
    if (behavior := state.behaviors.get(holder)) is not None:
        return f"{state.label_of(behavior.element)} of {run}"
    if (request := state.allocations.get(holder)) is not None:
        return f"{request.token.node.label} of {run}"
    if (incident := state.incidents.get(holder)) is not None:
        return f"the incident of {incident.token.node.label} of {run}"
    for keeping in state.kept.values():
        if keeping.id == holder:
            label = state.label_of(keeping.element)
            return f"{label} of {run}, which keeps it until {keeping.until.container.label} ends"
    return ""


def _place(found: tuple[RunState, AllocationRequest]) -> tuple[int, int, int, str]:
    request = found[1]
    return -_priority(request), request.at_us, len(request.id), request.id


def _priority(request: AllocationRequest) -> int:
    """Return the greatest priority of the roles that are chosen or waited for."""
    needs = (role.need for role in behavior_of(request).roles)
    return max((need.priority for need in needs if need is not None), default=0)


def _task(state: RunState, request: AllocationRequest, now_us: int) -> WaitingTask:
    node = request.token.node
    wait = state.waits.get(request.deadline)
    due_us = None if wait is None else wait.due_us
    left_us = None if due_us is None else max(0, due_us - state.mission_time_us(now_us))
    return WaitingTask(
        state.run,
        request.id,
        node.id,
        node.label,
        behavior_of(request).name,
        max(0, now_us - request.at_us) / US_PER_S,
        None if left_us is None else left_us / US_PER_S,
        _priority(request),
        request.reason,
        request.holders,
    )
