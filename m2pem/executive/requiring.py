"""What is wrong with the requirements in a mission's own file, as findings of a check.

They are warnings: `m2pem verify` refuses such a mission, but it can be run.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from m2pem.executive.arbiters import FleetArbiters
from m2pem.findings import Finding, Severity
from m2pem.fleet.madeup import fleet_for
from m2pem.mission.mission import Mission

if TYPE_CHECKING:
    from m2pem.plugins import PluginManager

_ELEMENT = b"requirement"


def requirement_findings(
    mission: Mission,
    arbiters: FleetArbiters | None,
    plugins: "PluginManager",
    data: Iterable[str] = (),
) -> list[Finding]:
    """All of them. `data`: names given at start; `arbiters` None: a fleet is made up."""
    if _ELEMENT not in mission.source:
        return []  # most have none, and what reads them takes time to load
    from m2pem.verify.requirements import Names, gather  # noqa: PLC0415
    from m2pem.verify.requirements.requirement import RequirementsError  # noqa: PLC0415

    writes = plugins.service_writes()
    fleet = arbiters.fleet if arbiters is not None else fleet_for(mission)
    try:
        gather(Names(mission, fleet, writes, data))
    except RequirementsError as error:
        return [replace(finding, severity=Severity.WARNING) for finding in error.findings]
    return []
