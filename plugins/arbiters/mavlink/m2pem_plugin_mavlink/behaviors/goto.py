"""The behaviors `goto`, `hold`, `drive_stop` and `teleop`."""

import math
from dataclasses import replace
from typing import ClassVar

from m2pem.api import BehaviorState, LatLon, distance_m
from m2pem_plugin_mavlink.behaviors.arrival import (
    HEIGHT_TOLERANCE_M,
    StillnessTimer,
    accepts_mode,
    arrival_radius_m,
    cannot_stop,
    distance_to_m,
    height_error_m,
    height_tolerance_m,
    moves_towards,
    on_the_ground,
    position_of,
    stays_at,
    takeoff_required,
)
from m2pem_plugin_mavlink.behaviors.behavior import (
    MOVES_WITHIN_S,
    Behavior,
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
)
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters
from m2pem_plugin_mavlink.behaviors.target_check import TargetCheck
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

TOLERANCES_M = {"air": 2.0, "ground": 2.5, "surface": 5.0, "subsurface": 3.0}
"""The default tolerances by domain: the usual waypoint radii of autopilots."""

NEAREST_M = 0.5
"""Smallest tolerance: satellite receivers are no more precise."""

SETTLED_S = 10.0
"""A vehicle that has stopped near its target for this long counts as arrived."""

SETTLED_WITHIN_M = 10.0
TURNED_RAD = math.radians(10.0)
TURN_S = 10.0
"""A vehicle at its target has turned by then."""

MOVED_M = 1.0
"""A target that has moved by this distance is sent to the vehicle again."""

REPEAT_S = 0.5


class Goto(Behavior):
    """Go to a point, or to another vehicle while that moves."""

    name = "goto"
    modes = frozenset({FlightMode.GUIDED})
    max_still_s: ClassVar[float | None] = MOVES_WITHIN_S

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self.parameters = VehicleParameters(context)
        self._place: TargetPosition | None = None
        self._stillness = StillnessTimer(context)
        self._target_check = TargetCheck(self.vehicle, self.name)
        tolerance = self.parameters.tolerance_m
        self._said = tolerance is not None
        usual_m = TOLERANCES_M.get(self.vehicle.domain, 2.5)
        self._tolerance_m = usual_m if tolerance is None else max(tolerance, NEAREST_M)

    def target(self) -> TargetPosition:
        """Return where to go now."""
        return replace(self.parameters.target_position(), heading_rad=self.parameters.heading_rad)

    def refusal(self) -> str:
        """Check that an aircraft is in the air, and that the path is inside the fence."""
        if reason := takeoff_required(self.vehicle):
            return reason
        if self.parameters.target_is_unknown:
            return ""
        return self.breach(self.target().latlon, "the target")

    async def begin(self) -> None:
        self._stillness.forget()
        if self.parameters.target_is_unknown:
            await self.parameters.wait_for_target()
            if reason := self.breach(self.target().latlon, "the target"):
                raise BehaviorFailedError(reason)
        await self._go_to(self.target())

    async def _go_to(self, place: TargetPosition) -> None:
        self._place = place
        self._target_check.sent(None)
        await self.vehicle.driver.go_to(place, self.parameters.speed_m_s)
        self._target_check.sent(place.latlon)

    def adjust(self, speed_m_s: float) -> bool:
        self.parameters.adjusted_m_s = speed_m_s
        return True

    async def run_in_background(self) -> None:
        """Send the vehicle again when its target has moved."""
        while self.parameters.target_vehicle is not None:
            await self.vehicle.sleep(REPEAT_S)
            new, old = self.target(), self._place
            if old is None or distance_m(new.latlon, old.latlon) > MOVED_M:
                fence = self.context.fence
                if fence is not None and fence.outside_m(new.latlon) > 0:
                    await self.vehicle.driver.stop()
                    raise BehaviorFailedError(
                        f"{self.parameters.target_vehicle} has left the fleet's fence"
                    )
                await self._go_to(new)

    def finished(self) -> bool:
        """Return whether the vehicle is within the tolerance and has turned, or has stopped as near
        as its autopilot goes. A vehicle that cannot stop has arrived when it circles the place.

        Raises:
            BehaviorFailedError: it has stopped outside of a requested tolerance.
            TakenOverError: another station has sent it somewhere else.
        """
        self._target_check.check()
        place = self._place or self.target()
        away = distance_to_m(self.vehicle, place.latlon)
        height_m = height_tolerance_m(self.vehicle, max(self._tolerance_m, HEIGHT_TOLERANCE_M))
        high = height_error_m(self.vehicle, place) <= height_m
        if away <= arrival_radius_m(self.vehicle, self._tolerance_m) and high:
            return self._turned(place)
        if self._stillness.seconds() < SETTLED_S or away > SETTLED_WITHIN_M or not high:
            return False
        if self._said:
            raise BehaviorFailedError(
                f"it has stopped {away:.1f} m from its target, and the tolerance is "
                f"{self._tolerance_m:g} m: its autopilot counts that as arrived"
            )
        return True

    def _turned(self, place: TargetPosition) -> bool:
        yaw = self.vehicle.state.yaw_rad
        if place.heading_rad is None or self.vehicle.domain != "air" or yaw is None:
            return True
        if cannot_stop(self.vehicle):
            return True
        off = math.remainder(math.pi / 2 - place.heading_rad - yaw, math.tau)
        return abs(off) <= TURNED_RAD or self._stillness.seconds() >= TURN_S

    async def reattach(self) -> BehaviorState:
        """Judge by the position, and by whether the vehicle moves towards the target."""
        self._place = place = self.target()
        if not accepts_mode(self, self.vehicle.state.mode):
            return BehaviorState.UNKNOWN
        if self.finished():
            return BehaviorState.SUCCEEDED
        if await moves_towards(self.vehicle, place):
            return BehaviorState.RUNNING
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.UNKNOWN


class Hold(Behavior):
    """Stop for a duration; without one, until the vehicle has stopped. What cannot stop circles."""

    name = "hold"
    modes = frozenset({FlightMode.HOLD})

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._left_s = VehicleParameters(context).duration_s or 0.0
        self._since_s: float | None = None
        self._at: LatLon | None = None

    async def begin(self) -> None:
        """Stop the vehicle; one that is not armed has stopped."""
        self._at = position_of(self.vehicle)
        if on_the_ground(self.vehicle) or self.vehicle.state.armed is False:
            self.modes = frozenset(FlightMode)  # a disarmed vehicle has stopped in every mode
        else:
            await self.vehicle.driver.stop()
        self._since_s = self.context.now_s()

    def paused(self) -> None:
        """Exclude the pause from the duration."""
        if self._since_s is not None:
            self._left_s -= self.context.now_s() - self._since_s
            self._since_s = None

    def finished(self) -> bool:
        """Return whether the vehicle has stopped and the duration is over."""
        now_s = self.context.now_s()
        over = self._since_s is not None and now_s - self._since_s >= self._left_s
        return over and stays_at(self.vehicle, self._at)

    async def reattach(self) -> BehaviorState:
        """Judge by the mode."""
        if self.vehicle.state.armed and not accepts_mode(self, self.vehicle.state.mode):
            return BehaviorState.UNKNOWN
        self._at = position_of(self.vehicle)
        self._since_s = self.context.now_s()
        if self.vehicle.state.armed is False:
            self.modes = frozenset(FlightMode)
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.RUNNING

    def checkpoint(self) -> CheckpointState:
        """Return when the duration ends."""
        return {"until_s": self.context.now_s() + self._left_s}

    def restore(self, checkpoint: CheckpointState) -> None:
        until_s = checkpoint.get("until_s")
        if isinstance(until_s, int | float):
            self._left_s = max(0.0, until_s - self.context.now_s())


class DriveStop(Hold):
    name = "drive_stop"


class Teleop(Behavior):
    """Stop, and let a person drive, by remote control or another ground station, until cancelled or
    for `timeout`. The person chooses the mode: m2pem commands none in which a person steers. RTL
    ends the behavior: a failsafe or another ground station began it."""

    name = "teleop"
    modes = frozenset({FlightMode.HOLD, FlightMode.MANUAL, FlightMode.GUIDED})

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._left_s = VehicleParameters(context).timeout_s
        self._since_s = context.now_s()
        self._over = False

    async def begin(self) -> None:
        await self.vehicle.driver.stop()
        self._since_s = self.context.now_s()

    def paused(self) -> None:
        """Exclude the pause from the timeout."""
        self._left_s = self._remaining_s()

    async def resume(self) -> None:
        """Wait for the person to drive on: a hold has stopped the vehicle."""
        self._since_s = self.context.now_s()

    async def run_in_background(self) -> None:
        """Stop the vehicle after the timeout."""
        if (left_s := self._remaining_s()) is not None:
            await self.vehicle.sleep(left_s)
            await self.vehicle.driver.stop()
            self._over = True

    def finished(self) -> bool:
        """Return whether the timeout is over. The person's mode counts as commanded."""
        state, commanded = self.vehicle.state, self.vehicle.commanded
        if state.mode in self.modes and not commanded.changing:
            commanded.custom_mode = state.custom_mode
        return self._over

    async def reattach(self) -> BehaviorState:
        """Return RUNNING: the person goes on, or has not begun."""
        driven = self.vehicle.state.mode in self.modes
        return BehaviorState.RUNNING if driven else BehaviorState.UNKNOWN

    def checkpoint(self) -> CheckpointState:
        """Return when the timeout is over."""
        left_s = self._remaining_s()
        return {} if left_s is None else {"until_s": self.context.now_s() + left_s}

    def restore(self, checkpoint: CheckpointState) -> None:
        until_s = checkpoint.get("until_s")
        if isinstance(until_s, int | float):
            self._left_s = max(0.0, until_s - self.context.now_s())

    def _remaining_s(self) -> float | None:
        if self._left_s is None:
            return None
        return max(0.0, self._left_s - (self.context.now_s() - self._since_s))
