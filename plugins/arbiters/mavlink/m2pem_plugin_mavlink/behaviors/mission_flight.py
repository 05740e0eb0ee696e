"""A way that is flown or driven as an uploaded mission."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import BehaviorState, LatLon
from m2pem_plugin_mavlink.behaviors.behavior import (
    MOVES_WITHIN_S,
    Behavior,
    BehaviorFailedError,
    Job,
    Memory,
)
from m2pem_plugin_mavlink.behaviors.fingerprint import Fingerprint, fingerprint
from m2pem_plugin_mavlink.behaviors.going import TOLERANCES_M
from m2pem_plugin_mavlink.behaviors.looking import (
    Standing,
    away_m,
    reach_m,
    unless_airborne,
    where,
)
from m2pem_plugin_mavlink.behaviors.wishes import AMSL, RELATIVE, TERRAIN, Wishes
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.landing import without_landing

FRAMES = {
    RELATIVE: dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    AMSL: dialect.MAV_FRAME_GLOBAL,
    TERRAIN: dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}
GROUND_SPEED = 1.0
AS_IT_IS = -1.0

STANDS_AT_END_S = 2.0
"""The message that the last item was reached comes once, and may be lost."""


def waypoint(place: LatLon, altitude_m: float, frame: str) -> MissionItem:
    """Go there, and on."""
    nan = float("nan")
    return MissionItem(
        dialect.MAV_CMD_NAV_WAYPOINT, FRAMES[frame], (0.0, 0.0, 0.0, nan), *place, altitude_m
    )


def circle_for_ever(last: MissionItem) -> MissionItem:
    """Stay at the place of another item, for what cannot stand still there: an ArduPlane would go
    home at the end of its mission, and go on into a landing that stands behind it."""
    return replace(last, command=dialect.MAV_CMD_NAV_LOITER_UNLIM)


def speed_item(speed_m_s: float) -> MissionItem:
    """From here on, so fast over ground."""
    params = (GROUND_SPEED, speed_m_s, AS_IT_IS, 0.0)
    return MissionItem(dialect.MAV_CMD_DO_CHANGE_SPEED, dialect.MAV_FRAME_MISSION, params)


class MissionFlight(Behavior):
    """Uploads a way and has it flown; `loop`: over and over. A subclass says the `items`."""

    modes = frozenset({FlightMode.MISSION})
    still_s = MOVES_WITHIN_S

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self.wishes = Wishes(job)
        self.loop = False
        self._items: tuple[MissionItem, ...] | None = None
        self._kept: Fingerprint | None = None
        self._end: tuple[int, LatLon] | None = None
        self._standing = Standing(job)

    @abstractmethod
    def way(self) -> Sequence[MissionItem]:
        """The waypoints.

        Raises:
            BehaviorFailedError: there can be none; the reason says why.
        """

    def named(self, index: int) -> str:
        """What people call a waypoint."""
        return f"waypoint {index + 1}"

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """What is uploaded: the speed, if one was asked for, then the waypoints; for a plane also
        a circle at the last of them."""
        if self._items is None:
            way = tuple(self.way())
            speed = self.wishes.speed_m_s
            items = way if speed is None else (speed_item(speed), *way)
            last = items[-1]
            self._end = (len(items) - 1, (last.latitude_deg, last.longitude_deg))
            circles = self.vehicle.heard.circle_m is not None
            self._items = (*items, circle_for_ever(last)) if circles else items
            self._kept = fingerprint(self._items)
        return self._items

    def refusal(self) -> str:
        """What flies must be in the air, and the way within the fence; a loop's way back, too."""
        if reason := unless_airborne(self.vehicle):
            return reason
        speeds = 0 if self.wishes.speed_m_s is None else 1
        items = self.items
        if self.job.fence is None or self._end is None:
            return ""
        way = [(item.latitude_deg, item.longitude_deg) for item in items[speeds : self._end[0] + 1]]
        start = where(self.vehicle)
        if reason := self.job.fence.breach(way, start, self.named):
            return reason
        if not self.loop:
            return ""
        last = len(way) - 1
        return self.job.fence.breach(
            [way[-1], way[0]], None, lambda index: self.named(0 if index else last)
        )

    async def begin(self) -> None:
        """Upload the items and start the mission."""
        self._standing.forget()
        await self.vehicle.driver.upload(self.items)
        await self.vehicle.driver.start_mission(0)

    async def go_on(self) -> None:
        """From the item that it was moving to."""
        self._standing.forget()
        last = self._end[0] if self._end else 0
        current = self.vehicle.driver.current_item or 0
        await self.vehicle.driver.start_mission(min(current, last))
        if (speed := self.wishes.speed_m_s) is not None:
            await self.vehicle.driver.set_speed(speed)

    def adjust(self, speed_m_s: float) -> bool:
        """It can; what was uploaded stays as it is."""
        self.wishes.adjusted_m_s = speed_m_s
        return True

    async def steps(self) -> None:
        """Begin again at the end of a loop."""
        while self.loop:
            await self.vehicle.until(self.at_the_end)
            self._standing.forget()
            await self.vehicle.driver.start_mission(0)
            if self.wishes.adjusted_m_s is not None:  # the mission begins with the speed before
                await self.vehicle.driver.set_speed(self.wishes.adjusted_m_s)
            await self.vehicle.until(lambda: not self.at_the_end())

    def at_the_end(self) -> bool:
        """Whether the last waypoint was reached, by the vehicle's word or its place."""
        if self._end is None:
            return False
        last, place = self._end
        driver = self.vehicle.driver
        reached, current = driver.reached_item, driver.current_item
        if reached is not None and reached >= last:
            return True
        if current is None or current < last:
            return False
        near_m = 2 * TOLERANCES_M.get(self.vehicle.domain, 2.5)
        if away_m(self.vehicle, place) > reach_m(self.vehicle, near_m):
            return False
        over = self.vehicle.heard.mode is FlightMode.HOLD  # PX4 holds at the end of a mission
        return over or self._standing.seconds(place) >= STANDS_AT_END_S

    def finished(self) -> bool:
        """At the last waypoint; a loop never is."""
        return not self.loop and self.at_the_end()

    async def recognised(self) -> BehaviorState:
        """By the mission that it has stored, its mode, its item and its place."""
        if self._kept is None or self._end is None:
            return BehaviorState.UNKNOWN
        stored = await self.vehicle.driver.downloaded()
        if not fingerprint(without_landing(stored)).fits(self._kept):
            return BehaviorState.UNKNOWN
        if self.finished() or await self._stands_at_the_end():
            return BehaviorState.SUCCEEDED
        flies = self.vehicle.heard.mode is FlightMode.MISSION and self.vehicle.heard.armed
        return BehaviorState.RUNNING if flies else BehaviorState.UNKNOWN

    async def _stands_at_the_end(self) -> bool:
        current = self.vehicle.driver.current_item
        if self.loop or self._end is None or current is None or current < self._end[0]:
            return False
        return await self.vehicle.until(self.at_the_end, STANDS_AT_END_S + 0.5)

    def memory(self) -> Memory:
        """The mission's fingerprint, its last item and where that is."""
        if not self.items or self._kept is None or self._end is None:
            raise BehaviorFailedError("there is no way to move")
        last, place = self._end
        kept = self._kept
        return {
            "mission": [float(kept.count), float(kept.places), round(kept.height_m, 3)],
            "end": [float(last), *place],
        }

    def recall(self, memory: Memory) -> None:
        """The same."""
        mission, end = memory.get("mission"), memory.get("end")
        if isinstance(mission, list) and isinstance(end, list):
            self._kept = Fingerprint(int(mission[0]), int(mission[1]), mission[2])
            self._end = (int(end[0]), (end[1], end[2]))
