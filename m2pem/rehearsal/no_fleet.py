"""Rehearsing without a fleet: a mission that commands nothing needs none."""

from collections.abc import Iterator

from m2pem.errors import MissionError
from m2pem.findings import Finding, Severity
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import Behavior, ServiceCall
from m2pem.mission.elements import (
    Activity,
    ScriptTask,
    SendTask,
    ServiceTask,
)
from m2pem.mission.mission import Mission

NO_FLEET = Fleet("", "no fleet", {})


def refuse_commands(mission: Mission) -> None:
    """Refuse a mission that commands resources.

    Raises:
        MissionError: with a finding for each task that does.
    """
    findings = [
        Finding(
            Severity.ERROR,
            mission.file_of(task),
            work.line,
            task.id,
            "needs-fleet",
            f"{what} needs a fleet",
            "name one with --fleet; '--fleet sim' makes one up",
        )
        for task, work, what in _commands(mission)
    ]
    if findings:
        raise MissionError(f"{mission.file} commands resources, and there is no fleet", findings)


def _commands(mission: Mission) -> Iterator[tuple[Activity, Behavior | ServiceCall, str]]:
    for task in mission.activities():
        if isinstance(task, ScriptTask | ServiceTask | SendTask) and task.behavior:
            # A hold of nobody is a wait.
            if task.behavior.roles or task.behavior.name != "hold":
                yield task, task.behavior, f"behavior {task.behavior.name}"
        elif isinstance(task, ServiceTask) and task.call and task.call.roles:
            yield task, task.call, f"service {task.call.service}"
