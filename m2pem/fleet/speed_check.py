"""The static check of the speeds of waypoints: which behaviors do not keep them."""

from collections.abc import Mapping

from m2pem.findings import Severity
from m2pem.fleet.parameters import ResolvedValue
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import BehaviorSpec
from m2pem.mission.geometry import Route


def check_speeds(
    behavior: Behavior,
    spec: BehaviorSpec,
    place: str,
    values: Mapping[str, ResolvedValue],
    findings: TaskFindings,
) -> None:
    """Find a route whose waypoints have speeds that a behavior will not keep.

    `spec`: as a resource offers it; `place`: that resource, for the message. `values`: of the
    behavior's parameters. A task's own `speed` replaces those of the waypoints, which its author
    has chosen.
    """
    if spec.keeps_speeds or values.get("speed") is not None:
        return
    for parameter, value in values.items():
        if isinstance(value, Route) and value.speeds_m_s:
            lines = {each.name: each.line for each in behavior.parameters}
            findings.add(
                "waypoint-speeds-ignored",
                f"{place}parameter '{parameter}': '{behavior.name}' ignores the speeds of the "
                "route's waypoints here",
                "give the task a `speed`, or one task for each part of the route that has its own",
                line=lines.get(parameter, behavior.line),
                severity=Severity.WARNING,
            )
