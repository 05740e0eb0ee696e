"""Takeoff, landing, changes of altitude, return to launch, and the speed of later behaviors."""

import contextlib
import math
from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import BehaviorState, LatLon
from m2pem_plugin_mavlink.behaviors.arrival import (
    StillnessTimer,
    accepts_mode,
    arrival_radius_m,
    cannot_stop,
    distance_to_m,
    height_m,
    height_tolerance_m,
    is_still,
    moves_towards,
    on_the_ground,
    position_of,
    takeoff_required,
)
from m2pem_plugin_mavlink.behaviors.behavior import (
    ANY_MODE,
    MOVES_WITHIN_S,
    Behavior,
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
    SetBehavior,
)
from m2pem_plugin_mavlink.behaviors.goto import TOLERANCES_M
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters
from m2pem_plugin_mavlink.behaviors.target_check import TargetCheck
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, RefusedError
from m2pem_plugin_mavlink.vehicle.driver import AMSL, FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.fixed_wing import landing_start
from m2pem_plugin_mavlink.vehicle.readiness import TEXTS_WITHIN_S

_RETURNS = frozenset({FlightMode.RETURN})
TAKEOFFS = (dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_VTOL_TAKEOFF)
LEAST_TAKEOFF_M = 0.5
LEVEL_M_S = 0.5
"""Climbing or sinking by less is hovering."""

DISARMS_WITHIN_S = 10.0
"""An autopilot disarms itself within this time after a landing, or is disarmed."""

LANDS_WITHIN_M = 15.0
"""An aircraft that returns lands so near to its home, or to a rally point."""

HOVERS_AT_HOME_S = 30.0
"""An aircraft that is set up not to land at home hovers there; before landing it waits a little."""


class ChangeAltitude(Behavior):
    """Climb or descend to a height at the present position."""

    name = "change_altitude"
    modes = frozenset({FlightMode.GUIDED})
    max_still_s = MOVES_WITHIN_S

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        parameters = VehicleParameters(context)
        altitude, self._frame = parameters.altitude()
        self._altitude_m = altitude or 0.0
        self._target_check = TargetCheck(self.vehicle, self.name)

    def refusal(self) -> str:
        """Check that the vehicle flies, and that its position is known."""
        if reason := takeoff_required(self.vehicle):
            return reason
        return "" if position_of(self.vehicle) else "its position is not known yet"

    async def begin(self) -> None:
        here = position_of(self.vehicle)
        if here is None:
            raise BehaviorFailedError("its position is not known")
        await self.vehicle.driver.go_to(TargetPosition(*here, self._altitude_m, self._frame))
        self._target_check.sent(here)

    def finished(self) -> bool:
        """Return whether the vehicle is at the height and neither climbs nor descends.

        Raises:
            TakenOverError: another station has sent it somewhere else.
        """
        self._target_check.check()
        height = height_m(self.vehicle.state, self._frame)
        if height is None:
            raise BehaviorFailedError(f"its height above {self._frame} is not known")
        near_m = min(1.0, max(0.3, 0.1 * abs(self._altitude_m)))
        near_m = height_tolerance_m(self.vehicle, near_m)
        return abs(height - self._altitude_m) <= near_m and self._is_level()

    def _is_level(self) -> bool:
        velocity = self.vehicle.state.velocity_enu_m_s
        return velocity is None or abs(velocity[2]) < LEVEL_M_S

    async def reattach(self) -> BehaviorState:
        """Judge by the height, and by whether the vehicle climbs or descends towards the target."""
        if not accepts_mode(self, self.vehicle.state.mode):
            return BehaviorState.UNKNOWN
        here = position_of(self.vehicle)
        if self.finished():
            return BehaviorState.SUCCEEDED
        if here and await moves_towards(
            self.vehicle, TargetPosition(*here, self._altitude_m, self._frame)
        ):
            return BehaviorState.RUNNING
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.UNKNOWN


class Takeoff(ChangeAltitude):
    """Take off and climb; a vehicle that flies only climbs. Planes take off by a mission."""

    name = "takeoff"
    modes = frozenset({FlightMode.GUIDED, FlightMode.TAKEOFF})
    plane_modes = frozenset({FlightMode.MISSION})

    def refusal(self) -> str:
        """Check that the height is above home."""
        altitude_m = self._above_home_m()
        if altitude_m is None:
            return "the height of its home is not known yet: set a relative altitude"
        if altitude_m < LEAST_TAKEOFF_M:
            return (
                f"parameter 'altitude': {self._altitude_m:g} m {self._frame} is {altitude_m:g} m "
                f"above its home; at least {LEAST_TAKEOFF_M:g} m are needed"
            )
        return ""

    async def begin(self) -> None:
        altitude_m = self._above_home_m()
        if self.vehicle.state.landed is False and self.vehicle.state.armed:
            await super().begin()
        elif altitude_m is not None:
            await self.vehicle.driver.take_off(altitude_m)

    def finished(self) -> bool:
        """Return whether the vehicle is at the height and no longer climbs."""
        if self.vehicle.state.landed is True:
            return False
        height = self.vehicle.state.altitude_above_home_m
        requested_m = self._above_home_m()
        if height is None or requested_m is None:
            return False
        near_m = height_tolerance_m(self.vehicle, min(1.0, max(0.3, 0.1 * requested_m)))
        return height >= requested_m - near_m and self._is_level()

    def _above_home_m(self) -> float | None:
        state = self.vehicle.state
        if self._frame != AMSL:
            return self._altitude_m  # the ground below home is home's height
        if state.home is not None:
            return self._altitude_m - state.home.altitude_m
        if state.position is None or state.altitude_above_home_m is None:
            return None
        return self._altitude_m - state.position.altitude_m + state.altitude_above_home_m

    async def reattach(self) -> BehaviorState:
        """Judge as for a change of altitude, by the mode, or by a stored mission that is a
        takeoff."""
        state = await super().reattach()
        if state is not BehaviorState.UNKNOWN or not self.vehicle.state.armed:
            return state
        mode = self.vehicle.state.mode
        climbs = mode is FlightMode.TAKEOFF or (
            mode is FlightMode.MISSION
            and accepts_mode(self, mode)
            and await self._has_its_mission()
        )
        return BehaviorState.RUNNING if climbs else state

    async def _has_its_mission(self) -> bool:
        mission, requested_m = await self.vehicle.driver.downloaded(), self._above_home_m()
        if not mission or requested_m is None or mission[0].command not in TAKEOFFS:
            return False
        return abs(mission[0].altitude_m - requested_m) < LEAST_TAKEOFF_M


class Land(Behavior):
    """Land at the present position; a plane lands by the landing sequence of its mission."""

    name = "land"
    modes = frozenset({FlightMode.LAND})
    plane_modes = frozenset({FlightMode.MISSION})
    max_still_s = MOVES_WITHIN_S

    async def begin(self) -> None:
        """Land, unless the vehicle has landed already."""
        if not self._down():
            await self.vehicle.driver.land()

    async def run_in_background(self) -> None:
        """Disarm an aircraft that has landed and does not disarm itself."""
        await disarm_after_landing(self)

    def finished(self) -> bool:
        """Return whether the vehicle is on the ground and disarmed."""
        return self._down()

    def _down(self) -> bool:
        return self.vehicle.state.landed is True and self.vehicle.state.armed is False

    async def reattach(self) -> BehaviorState:
        """Judge by the mode, or by being on the ground; a mission must have come to its landing."""
        if self._down():
            return BehaviorState.SUCCEEDED
        mode = self.vehicle.state.mode
        lands = accepts_mode(self, mode)
        if lands and mode is FlightMode.MISSION:
            begins = landing_start(await self.vehicle.driver.downloaded())
            lands = begins is not None and (self.vehicle.driver.current_item or 0) >= begins
        return BehaviorState.RUNNING if lands else BehaviorState.UNKNOWN


async def disarm_after_landing(behavior: Behavior) -> None:
    """Wait for a landing and for the autopilot to disarm; if it does not, disarm."""
    vehicle = behavior.vehicle
    await vehicle.until(lambda: vehicle.state.landed is True)
    if not await vehicle.until(lambda: vehicle.state.armed is False, DISARMS_WITHIN_S):
        await vehicle.driver.disarm()


AROUND_M, LOOK_EVERY_S = 3.0, 0.2
"""A return leads so far around what the fleet's fence keeps out, if there is room."""

AROUND_STILL_S = 30.0
"""A vehicle that does not move on for so long on its way around returns on a straight line."""


class ReturnToLaunch(Behavior):
    """Return home; an aircraft lands there, unless it is set to hover or circle.

    The autopilot returns on a straight line. Where that would leave the fleet's fence, the vehicle
    is first sent around, unless it cannot stop; a return is never refused.
    """

    name = "return_to_launch"
    modes = _RETURNS | {FlightMode.LAND}
    max_still_s = 2 * MOVES_WITHIN_S  # it may wait above its home for a minute (RTL_LOIT_TIME)

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._near_m = 2 * TOLERANCES_M.get(self.vehicle.domain, 2.5)
        self._stillness = StillnessTimer(context)
        self._rally: Sequence[LatLon] = ()
        self._around: list[LatLon] = []

    def refusal(self) -> str:
        """Check that an aircraft on the ground is at home."""
        if on_the_ground(self.vehicle) and self._home_m() > self._near_m:
            return takeoff_required(self.vehicle)
        return ""

    async def begin(self) -> None:
        """Return, unless the vehicle is at home already."""
        self._stillness.forget()
        if self._is_there_already():
            self.modes = ANY_MODE
            return
        self._around, crosses = self._way_home()
        if crosses:
            self.vehicle.warn(f"returns: {crosses}")
        await self._send()

    async def _send(self) -> None:
        """Send the vehicle to the next place on its way around, or home: also if it refuses that
        place."""
        self.modes = type(self).modes | ({FlightMode.GUIDED} if self._around else set())
        if self._around:
            try:
                await self.vehicle.driver.go_to(self._next())
            except ExchangeError as error:
                await self._straight(str(error))
        else:
            await self.vehicle.driver.return_home()

    def _next(self) -> TargetPosition:
        return TargetPosition(*self._around[0], *VehicleParameters(self.context).altitude())

    async def _straight(self, why: str) -> None:
        self.vehicle.warn(f"returns on a straight line, not around what the fence keeps out: {why}")
        self._around.clear()
        await self._send()

    def _way_home(self) -> tuple[list[LatLon], str]:
        """Return the places to pass on the way home, and where that still leaves the fence."""
        fence, home, here = self.context.fence, self.vehicle.state.home, position_of(self.vehicle)
        if fence is None or home is None or here is None:
            return [], ""
        if cannot_stop(self.vehicle):
            return [], fence.breach([home.latlon], here, lambda _: "its home")
        return fence.way_home(here, home.latlon, AROUND_M)

    async def run_in_background(self) -> None:
        """Fly or drive around; then read the rally points, and disarm as `Land` does."""
        near_m = TOLERANCES_M.get(self.vehicle.domain, 2.5)
        while self._around:
            await self.vehicle.sleep(LOOK_EVERY_S)
            if distance_to_m(self.vehicle, self._around[0]) <= near_m:
                self._stillness.forget()
                del self._around[0]
                await self._send()
            elif self._stillness.seconds() >= AROUND_STILL_S:
                await self._straight("it does not move on")
        if self.vehicle.domain == "air" and self.modes is not ANY_MODE:
            with contextlib.suppress(ExchangeError):  # most have no rally points
                self._rally = await self.vehicle.driver.rally_points()
            await disarm_after_landing(self)

    def _off_m(self) -> float:
        """Return the distance from where it should land; 0 if that is unknown, or if the landing is
        a sequence of its own (a plane's, which may begin anywhere)."""
        if self.vehicle.state.loiter_radius_m is not None or position_of(self.vehicle) is None:
            return 0.0
        return min(
            self._home_m(), *(distance_to_m(self.vehicle, each) for each in self._rally), math.inf
        )

    def _home_m(self) -> float:
        home = self.vehicle.state.home
        if home is None:
            return 0.0
        return distance_to_m(self.vehicle, home.latlon)

    def result(self) -> str:
        """Return its home, which others may have moved."""
        home = self.vehicle.state.home
        if home is None:
            return ""
        return f"its home is {home.latitude_deg:.6f}, {home.longitude_deg:.6f}"

    def _is_there_already(self) -> bool:
        state = self.vehicle.state
        if self.vehicle.domain == "air":
            return state.landed is True and state.armed is False
        return state.home is not None and self._home_m() <= self._near_m and is_still(self.vehicle)

    def finished(self) -> bool:
        """Return whether the vehicle is at home: an aircraft landed and disarmed (or hovering or
        circling for long), others stopped.

        Raises:
            BehaviorFailedError: an aircraft has landed somewhere else.
        """
        if self._around:
            return False
        air = self.vehicle.domain == "air" and self.modes is not ANY_MODE
        if air:
            # A LAND far from there is not the end of this return: it is a failsafe or a takeover.
            lands = self._off_m() <= LANDS_WITHIN_M
            self.modes = _RETURNS | {FlightMode.LAND} if lands else _RETURNS
        if self._is_there_already():
            if air and self._off_m() > LANDS_WITHIN_M:
                said = "; ".join(self.vehicle.recent_texts(TEXTS_WITHIN_S))
                reason = f"it is on the ground, {self._home_m():.0f} m from its home"
                raise BehaviorFailedError(f"{reason}; it said: {said}" if said else reason)
            return True
        home, radius_m = self.vehicle.state.home, self.vehicle.state.home_loiter_radius_m
        place = home.latlon if home is not None else None
        stopped_s = self._stillness.seconds(place, radius_m)
        if self.vehicle.domain == "air":
            near_m = arrival_radius_m(self.vehicle, self._near_m, radius_m)
            at_home = self.vehicle.state.landed is False and self._home_m() <= near_m
            return at_home and stopped_s >= HOVERS_AT_HOME_S
        return self.vehicle.state.home is None and stopped_s >= DISARMS_WITHIN_S

    async def reattach(self) -> BehaviorState:
        """Judge by the mode, by being at home, or at a place on its way around or moving there."""
        places, self._around = self._around, []
        if self._is_there_already() and self._home_m() <= self._near_m:
            return BehaviorState.SUCCEEDED
        if accepts_mode(self, self.vehicle.state.mode):
            return BehaviorState.RUNNING
        self.modes = self.modes | {FlightMode.GUIDED}
        while places and accepts_mode(self, self.vehicle.state.mode):
            self._around = places
            near = distance_to_m(self.vehicle, places[0]) <= self._near_m
            if near or await moves_towards(self.vehicle, self._next()):
                return BehaviorState.RUNNING
            places = places[1:]
        return BehaviorState.UNKNOWN

    def checkpoint(self) -> CheckpointState:
        """Return the way around, as it is before it begins."""
        return {"around": [degrees for place in self._way_home()[0] for degrees in place]}

    def restore(self, checkpoint: CheckpointState) -> None:
        around = checkpoint.get("around")
        if isinstance(around, list):
            self._around = [*zip(around[::2], around[1::2], strict=True)]


class SetSpeed(SetBehavior):
    """Set the speed of the following motion; the controller keeps it for later behaviors."""

    name = "set_speed"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self.speed_m_s = VehicleParameters(context).speed_m_s or 0.0

    async def begin(self) -> None:
        """Send the speed. A mode without motion (BRAKE, HOLD) may refuse it; later behaviors send
        it again."""
        try:
            await self.vehicle.driver.set_speed(self.speed_m_s)
        except RefusedError as refused:
            if refused.result != dialect.MAV_RESULT_FAILED:
                raise
