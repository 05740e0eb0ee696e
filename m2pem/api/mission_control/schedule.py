"""Operations on the schedule of missions."""

from collections.abc import Mapping
from typing import Protocol

from m2pem.api.authoring import MissionSource
from m2pem.api.runs import RunId
from m2pem.api.schedule import WHEN_FREE, EntryId, Schedule, When
from m2pem.mission.values import Value


class ScheduleControl(Protocol):
    """The operations of `MissionControl` on the schedule."""

    async def schedule(
        self,
        mission: MissionSource,
        *,
        when: When = WHEN_FREE,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        priority: int = 0,
        by: str = "",
    ) -> EntryId:
        """Have a mission started later: at a time, by cron, after a run, when a condition holds,
        or as soon as its vehicles are free. The journal has the entry, with the mission's files,
        when this returns.

        `priority`: of entries that wait for the same vehicles, that with the greatest starts first,
        then that which was due first.

        Raises:
            MissionError: with every finding, when it is not well or does not fit the fleet.
            ScheduleError: `when` makes no sense; or the fleet has real vehicles, and its file does
                not say that they may start unattended.
            OperatorError: this executive does not serve a schedule.
        """

    async def scheduled(self) -> Schedule:
        """The schedule of this executive's fleet: what starts when, and what it waits for."""

    async def unschedule(self, entry: EntryId, *, by: str = "") -> None:
        """Cancel an entry: it starts nothing any more. A run that it has started goes on."""

    async def start_scheduled(self, entry: EntryId, *, by: str = "") -> RunId:
        """Start the mission of an entry now, whatever it waits for; no operator is warned.

        It stands for the time of the entry that has come, or for its only one. Times of cron that
        are to come stay.

        Raises:
            MissionError: with every finding, when it does not fit the fleet any more.
            BusyError: runs or operators have its vehicles; it says who has what.
            OperatorError: there is no such entry, it is over, or held, or its last run goes on.
        """

    async def hold_schedule(
        self, entry: EntryId | None = None, *, by: str = "", reason: str = ""
    ) -> None:
        """Let an entry, or (None) the whole schedule, start nothing until it is released.

        It acts at once, whatever the journal does. Times that come meanwhile are missed when their
        starting deadline passes.

        Raises:
            OperatorError: there is no such entry, or the journal has not written the hold within
                1.5 s.
        """

    async def release_schedule(self, entry: EntryId | None = None, *, by: str = "") -> None:
        """Let an entry, or (None) the whole schedule, start missions again."""
