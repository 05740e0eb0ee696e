"""The mission that a vehicle has stored already."""

from m2pem.api import BehaviorState
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorFailedError, Job
from m2pem_plugin_mavlink.behaviors.fingerprint import is_navigation
from m2pem_plugin_mavlink.behaviors.wishes import Wishes
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.driver import FlightMode


class RunOnboardMission(Behavior):
    """Carry it out from an item on; done when its last waypoint was reached, or it has landed."""

    name = "run_onboard_mission"
    modes = frozenset({FlightMode.MISSION})

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._first = int(Wishes(job).number("first") or 0)
        self._last: int | None = None
        self._flew = False

    async def begin(self) -> None:
        items = await self.vehicle.driver.downloaded()
        if not items:
            raise BehaviorFailedError("it has no mission stored")
        if self._first >= len(items):
            raise BehaviorFailedError(
                f"parameter 'first': there is no item {self._first}; its mission has {len(items)}"
            )
        self._see(items)
        await self.vehicle.driver.start_mission(self._first)

    async def go_on(self) -> None:
        await self.vehicle.driver.start_mission(self.vehicle.driver.current_item or self._first)

    def finished(self) -> bool:
        heard = self.vehicle.heard
        self._flew = self._flew or heard.landed is False
        reached = self.vehicle.driver.reached_item
        if self._last is not None and reached is not None and reached >= self._last:
            return True
        return self._flew and heard.landed is True and heard.armed is False

    def _see(self, items: tuple[MissionItem, ...]) -> None:
        moves = [index for index, item in enumerate(items) if is_navigation(item)]
        if not moves:
            raise BehaviorFailedError("the mission that it has stored has no waypoint")
        self._last = moves[-1]
        if self.job.fence is not None:
            placed = [items[i] for i in moves if items[i].latitude_deg or items[i].longitude_deg]
            way = [(item.latitude_deg, item.longitude_deg) for item in placed]
            if reason := self.job.fence.breach(way):
                raise BehaviorFailedError(reason)

    async def recognised(self) -> BehaviorState:
        if self.vehicle.heard.mode is not FlightMode.MISSION or not self.vehicle.heard.armed:
            return BehaviorState.UNKNOWN
        items = await self.vehicle.driver.downloaded()
        if not items:
            return BehaviorState.UNKNOWN
        self._see(items)
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.RUNNING
