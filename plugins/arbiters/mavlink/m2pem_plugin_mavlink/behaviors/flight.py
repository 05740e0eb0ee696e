"""Up, down and home."""


from m2pem.api import BehaviorState
from m2pem_plugin_mavlink.behaviors.behavior import ANY_MODE, Behavior, BehaviorFailedError, Job
from m2pem_plugin_mavlink.behaviors.going import TOLERANCES_M
from m2pem_plugin_mavlink.behaviors.looking import (
    Standing,
    accepts,
    away_m,
    heads_for,
    height_m,
    on_the_ground,
    stands,
    unless_airborne,
    where,
)
from m2pem_plugin_mavlink.behaviors.wishes import AMSL, Wishes
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, Place

LEAST_TAKEOFF_M = 0.5
LEVEL_M_S = 0.5
"""Climbing or sinking by less is hovering."""

DISARMS_WITHIN_S = 10.0
"""An autopilot disarms by itself so soon after landing; one that doesn't is told to."""

HOVERS_AT_HOME_S = 30.0
"""An aircraft that is set up not to land at home hovers there; before landing it waits a little."""


class ChangeAltitude(Behavior):
    """Climb or sink to a height, over where it is."""

    name = "change_altitude"
    modes = frozenset({FlightMode.GUIDED})

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        wishes = Wishes(job)
        altitude, self._frame = wishes.altitude()
        self._altitude_m = altitude or 0.0

    def refusal(self) -> str:
        if reason := unless_airborne(self.vehicle):
            return reason
        return "" if where(self.vehicle) else "its position is not known yet"

    async def begin(self) -> None:
        here = where(self.vehicle)
        if here is None:
            raise BehaviorFailedError("its position is not known")
        await self.vehicle.driver.go_to(Place(*here, self._altitude_m, self._frame))

    async def go_on(self) -> None:
        await self.begin()

    def finished(self) -> bool:
        height = height_m(self.vehicle.heard, self._frame)
        if height is None:
            raise BehaviorFailedError(f"its height above {self._frame} is not known")
        near_m = min(1.0, max(0.3, 0.1 * abs(self._altitude_m)))
        return abs(height - self._altitude_m) <= near_m and self._is_level()

    def _is_level(self) -> bool:
        velocity = self.vehicle.heard.velocity_enu_m_s
        return velocity is None or abs(velocity[2]) < LEVEL_M_S

    async def recognised(self) -> BehaviorState:
        if not accepts(self, self.vehicle.heard.mode):
            return BehaviorState.UNKNOWN
        here = where(self.vehicle)
        if self.finished():
            return BehaviorState.SUCCEEDED
        if here and await heads_for(self.vehicle, Place(*here, self._altitude_m, self._frame)):
            return BehaviorState.RUNNING
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.UNKNOWN


class Takeoff(ChangeAltitude):
    """Take off and climb; one that flies already only climbs."""

    name = "takeoff"
    modes = frozenset({FlightMode.GUIDED, FlightMode.TAKEOFF})

    def refusal(self) -> str:
        altitude_m = self._above_home_m()
        if altitude_m is None:
            return "the height of its home is not known yet: say a relative altitude"
        if altitude_m < LEAST_TAKEOFF_M:
            return (
                f"parameter 'altitude': {self._altitude_m:g} m {self._frame} is {altitude_m:g} m "
                f"above its home; at least {LEAST_TAKEOFF_M:g} m are needed"
            )
        return ""

    async def begin(self) -> None:
        altitude_m = self._above_home_m()
        if self.vehicle.heard.landed is False and self.vehicle.heard.armed:
            await super().begin()
        elif altitude_m is not None:
            await self.vehicle.driver.take_off(altitude_m)

    def finished(self) -> bool:
        if self.vehicle.heard.landed is True:
            return False
        height = self.vehicle.heard.altitude_above_home_m
        wished = self._above_home_m()
        if height is None or wished is None:
            return False
        return height >= wished - min(1.0, max(0.3, 0.1 * wished)) and self._is_level()

    def _above_home_m(self) -> float | None:
        heard = self.vehicle.heard
        if self._frame != AMSL:
            return self._altitude_m  # the ground below home is home's height
        if heard.home is not None:
            return self._altitude_m - heard.home.altitude_m
        if heard.position is None or heard.altitude_above_home_m is None:
            return None
        return self._altitude_m - heard.position.altitude_m + heard.altitude_above_home_m

    async def recognised(self) -> BehaviorState:
        state = await super().recognised()
        mode = self.vehicle.heard.mode
        climbs = self.vehicle.heard.armed and mode is FlightMode.TAKEOFF
        return BehaviorState.RUNNING if state is BehaviorState.UNKNOWN and climbs else state


class Land(Behavior):
    """Land where it is."""

    name = "land"
    modes = frozenset({FlightMode.LAND})

    async def begin(self) -> None:
        if not self._down():
            await self.vehicle.driver.land()

    async def go_on(self) -> None:
        await self.begin()

    async def steps(self) -> None:
        """Disarm an aircraft that has landed and does not do that itself."""
        await disarm_when_down(self)

    def finished(self) -> bool:
        return self._down()

    def _down(self) -> bool:
        return self.vehicle.heard.landed is True and self.vehicle.heard.armed is False

    async def recognised(self) -> BehaviorState:
        if self._down():
            return BehaviorState.SUCCEEDED
        lands = accepts(self, self.vehicle.heard.mode)
        return BehaviorState.RUNNING if lands else BehaviorState.UNKNOWN


async def disarm_when_down(behavior: Behavior) -> None:
    """Wait for a landing, and for the autopilot to disarm; if it does not, disarm."""
    vehicle = behavior.vehicle
    await vehicle.until(lambda: vehicle.heard.landed is True)
    if not await vehicle.until(lambda: vehicle.heard.armed is False, DISARMS_WITHIN_S):
        await vehicle.driver.disarm()


class ReturnToLaunch(Behavior):
    """Go home; an aircraft lands there, unless it is set up to hover."""

    name = "return_to_launch"
    modes = frozenset({FlightMode.RETURN, FlightMode.LAND})

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._near_m = 2 * TOLERANCES_M.get(self.vehicle.domain, 2.5)
        self._standing = Standing(job)

    def refusal(self) -> str:
        if on_the_ground(self.vehicle) and self._home_m() > self._near_m:
            return unless_airborne(self.vehicle)
        return ""

    async def begin(self) -> None:
        self._standing.forget()
        if self._is_there_already():
            self.modes = ANY_MODE
            return
        await self.vehicle.driver.return_home()

    async def go_on(self) -> None:
        await self.begin()

    async def steps(self) -> None:
        """As `Land`."""
        if self.vehicle.domain == "air" and self.modes is not ANY_MODE:
            await disarm_when_down(self)

    def _home_m(self) -> float:
        home = self.vehicle.heard.home
        if home is None:
            return 0.0
        return away_m(self.vehicle, (home.latitude_deg, home.longitude_deg))

    def _is_there_already(self) -> bool:
        heard = self.vehicle.heard
        if self.vehicle.domain == "air":
            return heard.landed is True and heard.armed is False
        return heard.home is not None and self._home_m() <= self._near_m and stands(self.vehicle)

    def finished(self) -> bool:
        if self._is_there_already():
            return True
        standing_s = self._standing.seconds()
        if self.vehicle.domain == "air":
            at_home = self.vehicle.heard.landed is False and self._home_m() <= self._near_m
            return at_home and standing_s >= HOVERS_AT_HOME_S
        return self.vehicle.heard.home is None and standing_s >= DISARMS_WITHIN_S

    async def recognised(self) -> BehaviorState:
        if self._is_there_already() and self._home_m() <= self._near_m:
            return BehaviorState.SUCCEEDED
        returns = accepts(self, self.vehicle.heard.mode)
        return BehaviorState.RUNNING if returns else BehaviorState.UNKNOWN


class SetSpeed(Behavior):
    """Change the speed of what follows; the arbiter keeps it for the behaviors after this one."""

    name = "set_speed"
    modes = ANY_MODE
    steers = False

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self.speed_m_s = Wishes(job).number("speed") or 0.0

    async def begin(self) -> None:
        await self.vehicle.driver.set_speed(self.speed_m_s)

    async def go_on(self) -> None:
        await self.begin()

    def finished(self) -> bool:
        return True

    async def recognised(self) -> BehaviorState:
        return BehaviorState.UNKNOWN
