"""The static check of the speeds of waypoints: which behaviors do not keep them."""

from collections.abc import Iterable, Mapping

from m2pem.findings import Severity
from m2pem.fleet.fleet import SIMULATED, Fleet
from m2pem.fleet.parameters import ResolvedValue
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route

KEEP_SPEEDS = frozenset({SIMULATED})
"""The arbiters whose `single_vehicle_routing` keeps the speeds of waypoints."""

_ROUTING = "single_vehicle_routing"
_RULE = "waypoint-speeds-ignored"


def check_speeds(
    behavior: Behavior,
    fleet: Fleet,
    resources: Iterable[ResourceId],
    values: Mapping[str, ResolvedValue],
    findings: TaskFindings,
) -> None:
    """Find routes whose waypoints have speeds that no vehicle among those that act will keep.

    `values`: of the behavior's parameters. A task's own `speed` replaces those of the waypoints,
    which its author has chosen.
    """
    with_speeds = [
        name for name, value in values.items() if isinstance(value, Route) and value.speeds_m_s
    ]
    if not with_speeds or values.get("speed") is not None:
        return
    [parameter, *_] = with_speeds
    lines = {each.name: each.line for each in behavior.parameters}
    line = lines.get(parameter, behavior.line)
    if behavior.type is BehaviorType.VEHICLE and behavior.name == _ROUTING:
        known = (fleet.vehicles.get(each) for each in resources)
        deaf = next((each for each in known if each and each.arbiter not in KEEP_SPEEDS), None)
        if deaf is None:
            return
        ignores = f"arbiter '{deaf.arbiter}' of {deaf.id} ignores"
    else:
        ignores = f"'{behavior.name}' ignores"
    findings.add(
        _RULE,
        f"parameter '{parameter}': {ignores} the speeds of the route's waypoints",
        "give the task a `speed`, or one task for each part of the route that has its own",
        line=line,
        severity=Severity.WARNING,
    )
