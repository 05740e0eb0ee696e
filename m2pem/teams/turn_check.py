"""The static check of teams that move along a route: where their members come near each other, and
where one leaves the fleet's fence beside the route."""

from collections.abc import Iterator

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Fleet, LostMemberPolicy
from m2pem.fleet.parameters import examine_behavior
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.geometry import Route
from m2pem.mission.mission import Mission
from m2pem.teams.paths import SHAPES
from m2pem.teams.plan import PlanningContext, TeamRefusedError


def check_turns(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Yield a warning for each route that brings members of a team too near to each other, and for
    each member that would leave the fleet's fence beside a route that does not."""
    for task, behavior in mission.commands():
        if behavior.type is BehaviorType.TEAM and behavior.name in SHAPES:
            context = _context(behavior, mission, fleet)
            findings = TaskFindings(mission.file_of(task), task)
            _add_failsafes(findings, behavior, fleet)
            try:
                if context is not None:
                    _add_meeting(findings, behavior, context, fleet)
                    _add_breaches(findings, behavior, context)
            except (TeamRefusedError, KeyError):  # for another reason, or as the first finding says
                pass
            yield from findings.found


def _add_failsafes(findings: TaskFindings, behavior: Behavior, fleet: Fleet) -> None:
    teams = (fleet.teams.get(role.resource) for role in behavior.roles)
    going_on = (each for each in teams if each and each.on_lost_member is LostMemberPolicy.CONTINUE)
    members = (fleet.vehicles[member] for team in going_on for member in team.members)
    for each in members:
        if each.failsafe not in ("", "hold"):
            findings.add(
                "moves-when-lost",
                f"{each.id} ({fleet.file}:{each.line}) may meet the others, which go on without it "
                f"when its link is lost: its failsafe is '{each.failsafe}'",
                "set its failsafe to hold, or the team's `on_lost_member` to stop",
                line=behavior.line,
                severity=Severity.WARNING,
            )


def _add_meeting(
    findings: TaskFindings, behavior: Behavior, context: PlanningContext, fleet: Fleet
) -> None:
    from m2pem.teams.columns import turns  # noqa: PLC0415  # loads NumPy

    domains = (fleet.vehicles[each].domain for each in context.members)
    least_m = max((fleet.surface_separation_m.get(each, 0.0) for each in domains), default=0.0)
    said, remedy, place = turns(context, behavior.name, least_m)
    if said:
        findings.add(
            "members-meet", said, remedy, line=behavior.line, severity=Severity.WARNING, place=place
        )


def _add_breaches(findings: TaskFindings, behavior: Behavior, context: PlanningContext) -> None:
    from m2pem.teams.columns import lanes  # noqa: PLC0415  # loads NumPy

    route = context.parameters.route
    if route is None or not any(context.fences.values()):
        return
    way = [each[:2] for each in route.waypoints]
    for member, lane in lanes(context, behavior.name).items():
        fence = context.fences[member]
        if fence is None or fence.find_breach(way) is not None:
            continue
        breach = fence.find_breach(lane, None, lambda index: f"corner {index + 1} of its lane")
        if breach is not None:
            findings.add(
                "outside-fence",
                f"{member}, in its place beside the route: {breach}",
                "move the route away from there, take a smaller `spacing` or another `shape`, or "
                "widen the fleet's `fence`",
                line=behavior.line,
                severity=Severity.WARNING,  # where the members will begin is not known
                place=breach.place,
            )


def _context(behavior: Behavior, mission: Mission, fleet: Fleet) -> PlanningContext | None:
    """Return what is known of a behavior's plan before it begins; None: too little."""
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
        return None
    return PlanningContext(
        tuple(each.id for each in vehicles),
        {each.id: each.domain.value for each in vehicles},
        {each.id: {} for each in vehicles},
        BehaviorParameters(values),
        LocalFrame(route.waypoints[0][:2]),
        fences={each.id: fence_of(fleet, each.domain) for each in vehicles},
    )
