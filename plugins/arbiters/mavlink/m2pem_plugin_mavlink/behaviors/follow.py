"""The behavior `follow`: keep a relative position to another vehicle of the fleet, of any
arbiter."""

import math

from m2pem.api import BehaviorState, LatLon, LinkState, VehicleState, distance_m, offset
from m2pem_plugin_mavlink.behaviors.arrival import accepts_mode, takeoff_required
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorContext, BehaviorFailedError
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters, state_of
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

OFFSET_M = 15.0
BEHIND_RAD = math.pi
REPEAT_S = 0.5
STALE_S = 3.0
MOVED_M = 0.5
LEAD_S = 2.0
"""The vehicle is sent to the predicted position at this time: it slows down before each target, and
so lags behind by about this time."""

COURSE_ABOVE_M_S = 1.0
"""Without a yaw, the course of a target that moves faster than this counts as its heading."""


class Follow(Behavior):
    """Keep a position relative to another vehicle: at `offset` metres, at `bearing` from its
    heading."""

    name = "follow"
    modes = frozenset({FlightMode.GUIDED})

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._parameters = VehicleParameters(context)
        self._target = self._parameters.target_vehicle or ""
        self._place = f"its position relative to {self._target}"
        distance, bearing = self._parameters.offset_m, self._parameters.bearing_rad
        self._offset_m = OFFSET_M if distance is None else distance
        self._bearing_rad = BEHIND_RAD if bearing is None else bearing
        self._sent: LatLon | None = None
        self._course_rad: float | None = None

    def refusal(self) -> str:
        """Check that the target is another vehicle, and that the relative position is inside the
        fence."""
        if reason := takeoff_required(self.vehicle):
            return reason
        if self._target in ("", self.vehicle.resource):
            return "parameter 'target': another vehicle is expected"
        return "" if self._state() is None else self.breach(self._relative_position(), self._place)

    async def begin(self) -> None:
        await self._parameters.wait_for_target()
        self._sent = None
        await self._send()

    async def run_in_background(self) -> None:
        """Send the vehicle to its relative position twice a second."""
        while True:
            await self.vehicle.sleep(REPEAT_S)
            await self._send()

    def finished(self) -> bool:
        """Return False: the behavior continues until it is interrupted."""
        return False

    async def _send(self) -> None:
        if self._state() is None:
            await self._stop(f"{self._target} has sent no position for {STALE_S:g} s")
        position = self._relative_position()
        if reason := self.breach(position, self._place):
            await self._stop(reason)
        if self._sent is None or distance_m(self._sent, position) > MOVED_M:
            self._sent = position
            place = TargetPosition(*position, *self._parameters.altitude())
            await self.vehicle.driver.go_to(place, self._parameters.speed_m_s)

    async def _stop(self, reason: str) -> None:
        await self.vehicle.driver.stop()
        raise BehaviorFailedError(reason)

    def _state(self) -> VehicleState | None:
        """Return the target's last state; None if there is none that is recent."""
        state = state_of(self.context, self._target)
        if state is None or state.position is None or state.link is LinkState.LOST:
            return None
        return state if self.context.now_s() - state.time_us / 1e6 <= STALE_S else None

    def _relative_position(self) -> LatLon:
        state = self._state()
        if state is None or state.position is None:
            raise BehaviorFailedError(f"{self._target} has sent no position")
        east, north, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        if state.yaw_rad is not None:
            self._course_rad = state.yaw_rad
        elif math.hypot(east, north) > COURSE_ABOVE_M_S:
            self._course_rad = math.atan2(north, east)
        yaw = (self._course_rad or 0.0) - self._bearing_rad
        return offset(
            state.position.latlon,
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
