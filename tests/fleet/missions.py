"""Builds missions of bare tasks, as the parser would, for checks that look only at tasks."""

from m2pem.mission.behavior import (
    Behavior,
    BehaviorType,
    Parameter,
    Role,
    RoleKind,
    ServiceCall,
)
from m2pem.mission.elements import (
    Activity,
    Process,
    ScriptTask,
    ServiceTask,
)
from m2pem.mission.expression import Expression, template
from m2pem.mission.mission import Mission

READ_LATER = template("${mission.value}")
"""A value that is read from the data store when the task starts."""


def vehicle(resource: str, name: str = "driver", *, optional: bool = False) -> Role:
    return Role(name, RoleKind.VEHICLE, resource, line=15, optional=optional)


def payload(resource: str, name: str = "camera", *, optional: bool = False) -> Role:
    return Role(name, RoleKind.PAYLOAD, resource, line=15, optional=optional)


def team(resource: str, name: str = "section", *, optional: bool = False) -> Role:
    return Role(name, RoleKind.TEAM, resource, line=15, optional=optional)


def behavior(
    name: str,
    *roles: Role,
    type_: BehaviorType = BehaviorType.VEHICLE,
    **parameters: str | Expression,
) -> Behavior:
    given = tuple(
        Parameter(key, value, line=20 + index)
        for index, (key, value) in enumerate(parameters.items())
    )
    return Behavior(type_, name, 13, given, roles)


def drive(*roles: Role, **parameters: str | Expression) -> Behavior:
    return behavior("single_vehicle_routing", *roles, **(parameters or {"route": "alpha"}))


def mission(*tasks: Behavior | ServiceCall) -> Mission:
    """A mission with one task each: DriveRoute, Task2, Task3, ... in line 12."""
    process = Process("PATROL", "", 2)
    activities = tuple(_activity(index, task) for index, task in enumerate(tasks))
    for activity in activities:
        object.__setattr__(activity, "container", process)
        object.__setattr__(activity, "incoming", ())
        object.__setattr__(activity, "outgoing", ())
    return Mission(
        file="patrol.bpmn",
        source=b"",
        processes=(process,),
        nodes=activities,
        flows=(),
        signals={},
        messages={},
        errors={},
        escalations={},
    )


def _activity(index: int, task: Behavior | ServiceCall) -> Activity:
    id_ = f"Task{index + 1}" if index else "DriveRoute"
    if isinstance(task, ServiceCall):
        return ServiceTask(id_, "", 12, call=task)
    return ScriptTask(id_, "", 12, behavior=task)
