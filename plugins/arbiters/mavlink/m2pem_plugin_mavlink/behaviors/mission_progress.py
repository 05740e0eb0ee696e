"""Which waypoints of a mission were passed, by the vehicle's messages and by where it was.

Another ground station may set the current item; the autopilot then reports the last item as
reached, and not what it left out.
"""

from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import LatLon, distance_m
from m2pem_plugin_mavlink.behaviors.arrival import arrival_radius_m, cannot_stop, position_of
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

NEAR_M = 10.0
"""A waypoint is passed so near; autopilots turn before it, and cut corners."""

DETOUR = 1.5
"""Between two positions, a vehicle may have been faster than it reported by this factor."""

STALE_S = 3.0
"""So long after a mission was started, the current item may still be of the mission before."""

JUMPS = (
    dialect.MAV_CMD_DO_JUMP,
    dialect.MAV_CMD_DO_JUMP_TAG,
    dialect.MAV_CMD_DO_LAND_START,
)
"""Commands by which a mission goes on elsewhere by itself."""


class MissionProgress:
    """Follows a vehicle along the waypoints of a mission. `look` several times a second.

    `moves`: the numbers of the items that are waypoints, numbered as the driver does; `first`: the
    item that the mission was started at.
    """

    def __init__(
        self, vehicle: Vehicle, items: Sequence[MissionItem], moves: Sequence[int], first: int = 0
    ) -> None:
        self._vehicle = vehicle
        self._ahead: dict[int, LatLon] = {
            index: items[index].latlon
            for index in moves
            if index >= first and (items[index].latitude_deg or items[index].longitude_deg)
        }
        self._first = first
        self._begins = next(iter(self._ahead), 0)
        self._last = max(moves, default=0)
        self._began_s = vehicle.link.now_s()
        self._current: int | None = None
        self._was: tuple[float, LatLon] | None = None
        self.skipped: tuple[int, ...] = ()
        self.set_back: tuple[int, int] | None = None

    def look(self) -> None:
        """Note what the vehicle has passed; set `skipped`, the items that it has left out, and
        `set_back`, from which item to which it went back."""
        self._pass()
        driver = self._vehicle.driver
        current, commanded = driver.current_item, self._vehicle.commanded
        if (reached := driver.reached_item) is not None:
            self._ahead.pop(reached, None)
        if current is None or commanded.changing or not self._vehicle.state.armed:
            return
        if self._current is None:
            late = self._vehicle.link.now_s() - self._began_s > STALE_S
            if current > self._begins + 1 and not late:
                return
        elif current < self._current and current >= self._first:
            self.set_back = self.set_back or (self._current, current)
        self._current = current
        skipped = tuple(index for index in self._ahead if index < current)
        if cannot_stop(self._vehicle):
            if current > self._last + 1:
                return  # behind its circle: the takeover monitor judges the landing there
            if len(skipped) == 1:  # its turn has cut a corner
                del self._ahead[skipped[0]]
                return
        self.skipped = skipped

    def _pass(self) -> None:
        """Remove the waypoints that the vehicle can have passed since it was seen last: messages
        may be lost on the way."""
        here, state = position_of(self._vehicle), self._vehicle.state
        if here is None:
            return
        now_s = self._vehicle.link.now_s()
        before_s, before = self._was or (now_s, here)
        self._was = now_s, here
        speed_m_s = state.speed_m_s if state.velocity_enu_m_s is not None else 0.0
        way_m = DETOUR * speed_m_s * (now_s - before_s)
        way_m += 2 * arrival_radius_m(self._vehicle, NEAR_M)
        # MISSION_CURRENT comes once in a second: a waypoint or two may be passed before that.
        for index, place in tuple(self._ahead.items())[:3]:
            if distance_m(before, place) + distance_m(place, here) <= way_m:
                del self._ahead[index]

    def problem(self, names: Mapping[int, str]) -> str:
        """Return how the order of the items was changed, and which ones were left out; "" while it
        was not. `names`: of the items."""
        if self.set_back is not None:
            before, now = (names.get(each, f"item {each + 1}") for each in self.set_back)
            return f"another ground station has set the current item back from {before} to {now}"
        if not self.skipped:
            return ""
        named = [names.get(each, f"item {each + 1}") for each in self.skipped]
        more = f" and {len(named) - 5} more" if len(named) > 5 else ""
        return (
            "another ground station has set the current item forward; not passed: "
            + ", ".join(named[:5])
            + more
        )
