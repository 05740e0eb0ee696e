"""What an executive says of itself and its fleet, and how another one takes over from it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet


class ExecutiveControl(Protocol):
    """The operations of `MissionControl` on the executive itself."""

    async def switch_over(self, *, by: str = "") -> ExecutiveAddress:
        """Leave every run, as it is, to the standby executive, and end; returns which one.

        Vehicles go on with what they do. The standby takes the runs up as those of an executive
        that was killed.

        Raises:
            OperatorError: there is no standby executive. Nothing has changed then.
            JournalError: the journal cannot say which one does.
        """

    async def standbys(self) -> Sequence[ExecutiveAddress]:
        """The executives that stand by for the fleet of this one.

        Raises:
            JournalError: the journal cannot say it.
        """

    def fleet(self) -> "Fleet":
        """The fleet in use."""

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """Return the behaviors of every resource."""

    def simulated(self) -> bool:
        """Whether nothing real moves: all vehicles are simulated, or software in the loop."""

    def speed(self) -> float:
        """Seconds of mission time in a real second."""

    async def health(self) -> Sequence[HealthCheck]:
        """Whether this executive can do its work now: `journal`, `arbiters`, `event loop`.

        It answers within two seconds, whatever hangs. Vehicles do not count: their links are in
        the telemetry.
        """

    async def statistics(self) -> ExecutiveStatistics:
        """What this executive has counted since it began, and how long its queues are now."""

    def journal_file(self) -> Path | None:
        """The journal's file; None: the journal is in memory."""
