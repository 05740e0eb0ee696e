"""The behavior `follow`: keep a relative position to another vehicle of the fleet, of any
arbiter."""

import math

from m2pem.api import BehaviorState, LatLon, LinkState, VehicleState, distance_m, offset
from m2pem_plugin_mavlink.behaviors.arrival import accepts_mode, position_of, takeoff_required
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorContext, BehaviorFailedError
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters, state_of
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

OFFSET_M = 15.0
BEHIND_RAD = math.pi
REPEAT_S = 0.5
STALE_S = 3.0
MOVED_M = 0.5
LEAD_S = 2.0
"""The vehicle is sent to where the position will be then: it slows down before each target, and
so lags behind by about this time."""

COURSE_ABOVE_M_S = 1.0
"""Who moves faster points where it moves; its bow counts only if that is not known."""


class Follow(Behavior):
    """Keep a position relative to another vehicle: at `offset` metres, at `bearing` from its
    heading."""

    name = "follow"
    modes = frozenset({FlightMode.GUIDED})

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._parameters = VehicleParameters(context)
        self._target = self._parameters.target_vehicle or ""
        distance, bearing = self._parameters.offset_m, self._parameters.bearing_rad
        self._offset_m = OFFSET_M if distance is None else distance
        self._bearing_rad = BEHIND_RAD if bearing is None else bearing
        self._told: LatLon | None = None
        self._course_rad: float | None = None

    def refusal(self) -> str:
        """Check that the target is another vehicle, and that the relative position is inside the
        fence."""
        if reason := takeoff_required(self.vehicle):
            return reason
        if self._target in ("", self.vehicle.resource):
            return "parameter 'target': another vehicle is expected"
        return "" if self._state() is None else self._breach(self._station())

    async def begin(self) -> None:
        await self._parameters.wait_for_target()
        self._told = None
        await self._tell()

    async def resume(self) -> None:
        await self.begin()

    async def run_in_background(self) -> None:
        """Send the vehicle to its relative position twice a second."""
        while True:
            await self.vehicle.sleep(REPEAT_S)
            await self._tell()

    def finished(self) -> bool:
        """Return False: the behavior continues until it is interrupted."""
        return False

    async def _tell(self) -> None:
        if self._state() is None:
            await self._stop(f"{self._target} has not been heard for {STALE_S:g} s")
        station = self._station()
        if reason := self._breach(station):
            await self._stop(reason)
        if self._told is None or distance_m(self._told, station) > MOVED_M:
            self._told = station
            place = TargetPosition(*station, *self._parameters.altitude())
            await self.vehicle.driver.go_to(place, self._parameters.speed_m_s)

    async def _stop(self, reason: str) -> None:
        await self.vehicle.driver.stop()
        raise BehaviorFailedError(reason)

    def _breach(self, station: LatLon) -> str:
        if self.context.fence is None:
            return ""
        name = f"its station at {self._target}"
        return self.context.fence.breach([station], position_of(self.vehicle), lambda _: name)

    def _state(self) -> VehicleState | None:
        """Return the target's last state; None if there is none that is recent."""
        state = state_of(self.context, self._target)
        if state is None or state.position is None or state.link is LinkState.LOST:
            return None
        return state if self.context.now_s() - state.time_us / 1e6 <= STALE_S else None

    def _station(self) -> LatLon:
        state = self._state()
        if state is None or state.position is None:
            raise BehaviorFailedError(f"{self._target} has not been heard")
        east, north, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        if state.yaw_rad is not None:
            self._course_rad = state.yaw_rad
        elif math.hypot(east, north) > COURSE_ABOVE_M_S:
            self._course_rad = math.atan2(north, east)
        yaw = (self._course_rad or 0.0) - self._bearing_rad
        return offset(
            (state.position.latitude_deg, state.position.longitude_deg),
            east * LEAD_S + self._offset_m * math.cos(yaw),
            north * LEAD_S + self._offset_m * math.sin(yaw),
        )

    async def reattach(self) -> BehaviorState:
        """Return RUNNING if the vehicle flies in the mode in which it accepts positions."""
        state = self.vehicle.state
        follows = (
            state.armed and accepts_mode(self, state.mode) and not takeoff_required(self.vehicle)
        )
        return BehaviorState.RUNNING if follows else BehaviorState.UNKNOWN
