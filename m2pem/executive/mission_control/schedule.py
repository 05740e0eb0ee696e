"""Operations on the schedule of missions."""

from collections.abc import Mapping

from m2pem.api.authoring import MissionSource
from m2pem.api.runs import RunId
from m2pem.api.schedule import WHEN_FREE, EntryId, Schedule, When
from m2pem.errors import OperatorError
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.executive.schedule_admission import planned
from m2pem.mission.values import Value


class ScheduleOperations(ControlParts):
    """See `m2pem.api.mission_control.schedule.ScheduleControl`."""

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
        if not self._schedule.served:
            if self._schedule.is_beginning:
                raise OperatorError(
                    "this executive has just begun, and takes up what was interrupted before it "
                    "schedules missions; try again in a few seconds"
                )
            raise OperatorError(
                "this executive starts no scheduled missions: `m2pem serve` is one that does"
            )
        holds, known = self._schedule.holds, self._schedule.by_id
        plan, resources = await planned(
            self._supervisor,
            self._starter,
            known,
            mission,
            when,
            process,
            bounded(data),
            priority,
            by,
        )
        return await self._schedule.schedule(plan, resources, holds)

    async def scheduled(self) -> Schedule:
        return self._schedule.view()

    async def unschedule(self, entry: EntryId, *, by: str = "") -> None:
        await self._schedule.cancel(entry, by)

    async def start_scheduled(self, entry: EntryId, *, by: str = "") -> RunId:
        return await self._scheduler.start(entry, by)

    async def hold_schedule(
        self, entry: EntryId | None = None, *, by: str = "", reason: str = ""
    ) -> None:
        await self._schedule.hold(entry, by, reason)

    async def release_schedule(self, entry: EntryId | None = None, *, by: str = "") -> None:
        await self._schedule.release(entry, by)
