"""The static check of tasks that name one vehicle or payload and may be active at the same time.

A vehicle follows one behavior at once. The payloads that it carries have names of their own, so a
behavior of a payload goes on beside one of its vehicle.
"""

from collections.abc import Mapping
from functools import partial

from m2pem.findings import Finding, Severity
from m2pem.fleet.shortage import UNAVAILABLE, Demand
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.concurrency import ConcurrentTasks, instances_at_once
from m2pem.mission.elements import Activity
from m2pem.mission.mission import Mission

RULE = "same-vehicle"

REMEDY = "put them one after the other, name another vehicle, or say wait= in the role"


def check_same_vehicle(mission: Mission, demands: Mapping[Activity, Demand]) -> list[Finding]:
    """Find tasks that command the same at the same time. `demands`: of the tasks of the mission."""
    users: dict[ResourceId, list[Activity]] = {}
    for task, demand in demands.items():
        # One that waits begins when the other has ended.
        for resource in () if demand.waits else sorted(demand.named):
            users.setdefault(resource, []).append(task)
    shared = {each: tasks for each, tasks in users.items() if _may_meet(tasks)}
    if not shared:
        return []
    named = {task for tasks in shared.values() for task in tasks}
    concurrent = ConcurrentTasks(mission, named.__contains__)
    found: list[Finding] = []
    reported: set[frozenset[Activity]] = set()
    for resource, tasks in shared.items():
        for group in concurrent.heaviest(partial(_counted, frozenset(tasks))):
            together = list(dict.fromkeys(each.task for each in group.tasks))
            pair = frozenset(together[:2])
            if group.weight > 1 and pair not in reported:
                reported.add(pair)
                found.append(_finding(mission, demands, resource, together))
    return found


def _counted(tasks: frozenset[Activity], task: Activity) -> int:
    return int(task in tasks)


def _may_meet(tasks: list[Activity]) -> bool:
    return len(tasks) > 1 or instances_at_once(tasks[0]) > 1


def _finding(
    mission: Mission,
    demands: Mapping[Activity, Demand],
    resource: ResourceId,
    together: list[Activity],
) -> Finding:
    late = together[-1]
    others = " and ".join(each.label for each in together[:-1]) or "another instance of it"
    return TaskFindings(mission.file_of(late), late).add(
        RULE,
        f"{resource} may still do {others} at that time: it does one of them, and the other ends "
        f"with {UNAVAILABLE}",
        REMEDY,
        line=demands[late].behavior.line,
        severity=Severity.WARNING,
    )
