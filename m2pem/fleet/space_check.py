"""The static check of shared space: a team that needs more places than there are can never go."""

from collections.abc import Iterator, Mapping

from m2pem.findings import Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.fleet import Fleet, SharedSpace
from m2pem.fleet.space import ONE_BY_ONE
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.local_frame import LocalFrame
from m2pem.geo.polygon import region_of
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.geometry import Area, Geometry, Route

COLUMNS = frozenset({"road_following_formation"})
"""Team behaviors whose members follow one another, if no shape is given."""


def check_space(
    behavior: Behavior, fleet: Fleet, geometries: Mapping[str, Geometry], findings: TaskFindings
) -> None:
    """Check that a team has a place for each member in the shared spaces of its route or area.

    `geometries`: those of the mission.

    The way from where the vehicles are is not known before they start.
    """
    if behavior.type is not BehaviorType.TEAM or behavior.name in ONE_BY_ONE:
        return
    if not fleet.shared_space:
        return
    frame = LocalFrame(fleet.origin)
    ways = _ways(behavior, {**fleet.geometries, **geometries})
    hulls = [hull for way in ways for hull in region_of(way, None, frame).hulls()]
    for space in fleet.shared_space.values():
        needed = _needed(behavior, fleet, space)
        if needed <= space.capacity:
            continue
        region = region_of(fleet.geometries[space.name], space.width_m, frame)
        if any(region.meets(hull) for hull in hulls):
            line = f" ({fleet.file}:{space.line})" if space.line else ""
            sure = _all_enter(behavior)
            findings.add(
                "space-too-small",
                f"its team {'needs' if sure else 'may need'} {needed} places at a time in "
                f"'{space.name}'{line}, which has {space.capacity}",
                "let the vehicles go one after another (bridge_crossing), or give the space a "
                f"capacity of {needed}",
                line=behavior.line,
                severity=Severity.ERROR if sure else Severity.WARNING,
            )


def _ways(behavior: Behavior, geometries: Mapping[str, Geometry]) -> Iterator[Geometry]:
    """Yield its route, or its area, if it is known."""
    for parameter in behavior.parameters:
        if parameter.name in ("route", "area") and isinstance(parameter.value, str):
            geometry = geometries.get(parameter.value)
            if isinstance(geometry, Route if parameter.name == "route" else Area):
                yield geometry


def _needed(behavior: Behavior, fleet: Fleet, space: SharedSpace) -> int:
    """Return how many vehicles of its roles count; of a role by need, those that it needs."""
    all_count = all(each.domain in space.domains for each in fleet.vehicles.values())
    count = 0
    for role in behavior.roles:
        if role.resource:
            vehicles = (fleet.vehicles.get(each) for each in resources_of(role, fleet))
            count += sum(each is not None and each.domain in space.domains for each in vehicles)
        elif role.need is not None and not role.optional and all_count:
            count += role.need.least
    return count


def _all_enter(behavior: Behavior) -> bool:
    """Whether each member goes where the route goes, and not beside it."""
    given = {parameter.name: parameter.value for parameter in behavior.parameters}
    if "area" in given or "offsets" in given:
        return False
    return given.get("shape", "column" if behavior.name in COLUMNS else "") == "column"
