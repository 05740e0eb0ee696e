"""The static check of teams that move along a route: where their members come near each other."""

from collections.abc import Iterator

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import examine_behavior
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.elements import ScriptTask, SendTask, ServiceTask
from m2pem.mission.geometry import Route
from m2pem.mission.mission import Mission
from m2pem.teams.paths import SHAPES
from m2pem.teams.plan import NO_MEETING, Meeting, PlanningContext, TeamRefusedError


def check_turns(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Yield a warning for each route that brings members of a team too near to each other."""
    for task in mission.activities():
        behavior = task.behavior if isinstance(task, ScriptTask | ServiceTask | SendTask) else None
        if behavior is not None and behavior.type is BehaviorType.TEAM and behavior.name in SHAPES:
            said, remedy, place = _turns(behavior, mission, fleet)
            if said:
                yield TaskFindings(mission.file_of(task), task).add(
                    "members-meet",
                    said,
                    remedy,
                    line=behavior.line,
                    severity=Severity.WARNING,
                    place=place,
                )


def _turns(behavior: Behavior, mission: Mission, fleet: Fleet) -> Meeting:
    from m2pem.teams.columns import turns  # noqa: PLC0415  # loads NumPy

    given = {each.name: each.value for each in behavior.parameters}
    spec = SHARED[behavior.name, BehaviorType.TEAM]
    geometry = {**fleet.geometries, **mission.geometries}.get
    values, problems = examine_behavior(behavior, spec, geometry, fleet)
    route = values.get("route")
    shaping = ("shape", "spacing", "offsets")
    known = all(isinstance(given.get(name, ""), str) for name in shaping)
    roles = [role for role in behavior.roles if role.resource]
    members = [fleet.vehicles.get(each) for role in roles for each in resources_of(role, fleet)]
    vehicles = [each for each in members if each is not None]
    if problems or not known or not isinstance(route, Route):
        return NO_MEETING
    context = PlanningContext(
        tuple(each.id for each in vehicles),
        {each.id: each.domain.value for each in vehicles},
        {each.id: {} for each in vehicles},
        BehaviorParameters(values),
        LocalFrame(route.waypoints[0][:2]),
    )
    least_m = (fleet.surface_separation_m.get(each.domain, 0.0) for each in vehicles)
    try:
        return turns(context, behavior.name, max(least_m, default=0.0))
    except (TeamRefusedError, KeyError):  # it is refused for another reason
        return NO_MEETING
