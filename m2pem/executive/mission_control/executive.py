"""What an executive says of itself and its fleet, and how another one takes over from it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.executive.mission_control.parts import ControlParts
from m2pem.fleet.fleet import Fleet
from m2pem.journal.standbys import standbys_of
from m2pem.mission.catalogue import BehaviorSpec, ResourceId


class ExecutiveOperations(ControlParts):
    """See `m2pem.api.mission_control.executive.ExecutiveControl`."""

    async def switch_over(self, *, by: str = "") -> ExecutiveAddress:
        return await self._switchover.ask(by)

    async def standbys(self) -> Sequence[ExecutiveAddress]:
        found = await standbys_of(self._supervisor.journal, self._supervisor.fleet.name)
        return [ExecutiveAddress(each.host, each.pid, each.page) for each in found]

    def fleet(self) -> Fleet:
        return self._supervisor.fleet

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        return self._supervisor.arbiters.catalogue()

    def simulated(self) -> bool:
        return self._supervisor.arbiters.nothing_is_real

    def speed(self) -> float:
        return self._supervisor.settings.speed

    async def health(self) -> Sequence[HealthCheck]:
        return await self._health.checks()

    async def statistics(self) -> ExecutiveStatistics:
        return self._statistics.read()

    def journal_file(self) -> Path | None:
        return self._supervisor.journal.file
