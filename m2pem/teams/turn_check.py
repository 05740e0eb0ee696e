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
from m2pem.teams.columns import turns
from m2pem.teams.paths import SHAPES, SPACING_M
from m2pem.teams.plan import PlanningContext, TeamRefusedError


def check_turns(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Yield a warning for each route that brings members of a team too near to each other."""
    for task in mission.activities():
        if not isinstance(task, ScriptTask | ServiceTask | SendTask) or task.behavior is None:
            continue
        behavior = task.behavior
        if behavior.type is BehaviorType.TEAM and behavior.name in SHAPES:
            findings = TaskFindings(mission.file_of(task), task)
            said, remedy = _turns(behavior, mission, fleet)
            if said:
                findings.add(
                    "members-meet", said, remedy, line=behavior.line, severity=Severity.WARNING
                )
            yield from findings.found


def _turns(behavior: Behavior, mission: Mission, fleet: Fleet) -> tuple[str, str]:
    given = {each.name: each.value for each in behavior.parameters}
    spec = SHARED[behavior.name, BehaviorType.TEAM]
    geometry = {**fleet.geometries, **mission.geometries}.get
    values, problems = examine_behavior(behavior, spec, geometry, fleet)
    route = values.get("route")
    shaping = ("shape", "spacing", "offsets")
    known = all(isinstance(given.get(name, ""), str) for name in shaping)
    if problems or not known or not isinstance(route, Route):
        return "", ""
    members = tuple(
        each
        for role in behavior.roles
        if role.resource
        for each in resources_of(role, fleet)
        if each in fleet.vehicles
    )
    context = PlanningContext(
        members,
        {each: fleet.vehicles[each].domain.value for each in members},
        {each: {} for each in members},
        BehaviorParameters(values),
        LocalFrame(route.waypoints[0][:2]),
    )
    apart_m = max(
        (fleet.surface_separation_m.get(fleet.vehicles[m].domain, 0.0) for m in members),
        default=0.0,
    )
    spacing_m = context.parameters.spacing_m or SPACING_M
    if "offsets" not in given and len(members) > 1 and 0.8 * spacing_m < apart_m:
        said = f"parameter 'spacing': members come within {0.8 * spacing_m:g} m of each other"
        return f"{said}, below the fleet's separation of {apart_m:g} m", "set a larger spacing"
    try:
        return turns(context, behavior.name)
    except (TeamRefusedError, KeyError):  # it is refused for another reason
        return "", ""
