"""The objects that routers share."""

from dataclasses import dataclass
from pathlib import Path

from m2pem.api import MissionControl, SimulationResult
from m2pem_plugin_web.jobs import Jobs
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.missions.names import PathNames
from m2pem_plugin_web.rest.verifications import Report


@dataclass(frozen=True, slots=True)
class Services:
    """The executive, the folder of missions, and the jobs."""

    control: MissionControl
    folder: MissionFolder
    verifications: Jobs[Report]
    rehearsals: Jobs[SimulationResult]

    async def close(self) -> None:
        """Cancel all jobs."""
        await self.verifications.close()
        await self.rehearsals.close()


def services_of(control: MissionControl, missions: Path) -> Services:
    """Return the services of an executive. `missions`: the folder."""
    called = PathNames(missions)
    return Services(
        control, MissionFolder(missions), Jobs("verification", called), Jobs("rehearsal", called)
    )
