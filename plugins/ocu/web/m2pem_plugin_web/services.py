"""What the routers of missions work with, beside the executive."""

from dataclasses import dataclass, field
from pathlib import Path

from m2pem.api import MissionControl, SimulationResult
from m2pem_plugin_web.jobs import Jobs
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.rest.verifications import Report


@dataclass(frozen=True, slots=True)
class Services:
    """The executive, the folder of missions, and the work that was ordered."""

    control: MissionControl
    folder: MissionFolder
    verifications: Jobs[Report] = field(default_factory=lambda: Jobs("verification"))
    rehearsals: Jobs[SimulationResult] = field(default_factory=lambda: Jobs("rehearsal"))

    async def close(self) -> None:
        """End the work that goes on."""
        await self.verifications.close()
        await self.rehearsals.close()


def services_of(control: MissionControl, missions: Path) -> Services:
    """Those of an executive; `missions`: the folder."""
    return Services(control, MissionFolder(missions))
