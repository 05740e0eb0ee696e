"""To look at something that may move, from a vehicle that may move."""

import math
from abc import abstractmethod

from m2pem.api import BehaviorState, VehiclePosition
from m2pem_plugin_ptz.behaviors.behavior import TICK_S, Behavior, BehaviorFailedError, Job
from m2pem_plugin_ptz.camera_model.frames import between
from m2pem_plugin_ptz.camera_model.limits import Turn

THERE_RAD = math.radians(0.5)
COARSE_RAD = math.radians(2.0)
"""A camera that has come to rest so near looks there as well as it can."""

RESTED_S = 2.0
LEFT_S = 10.0
"""So long may a target be out of reach before it counts as lost from view."""

STUCK_S = 10.0
"""So long may a camera come no nearer to where it is told to look."""

LONGEST_STEP_S = 0.5
"""Of a step that took longer, no more counts: this process was held up, and has not yet read what
the camera said meanwhile."""

_NEARER_RAD = math.radians(0.1)
_SLOWEST_RAD_S = 0.02
_SLACK_RAD = math.radians(5.0)


class Aiming(Behavior):
    """Has the camera told where to look, ahead of time by what it takes to get there."""

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._reachable_s = 0.0
        self._nearest_rad = math.inf
        self._looked_s = 0.0
        self._unmoved_s = 0.0

    @abstractmethod
    def wanted(self, at_us: int) -> tuple[float, float]:
        """The pan and the tilt that would be right at a time, within reach or not.

        Raises:
            BehaviorFailedError: nobody can tell.
        """

    def aim(self, slack_rad: float = 0.0) -> Turn:
        """Tell the camera where to look, so that it is right when it is there."""
        ahead_s = TICK_S + self.sight.settings.delay_s
        turn = self.sight.turn(*self.wanted(self.sight.now_us + round(ahead_s * 1e6)), slack_rad)
        reach, look = self.driver.reach, self.driver.look
        rate: float | None = None
        if look is not None:
            pan = turn.pan_rad - look.pan_rad
            if reach.endless:
                pan = math.remainder(pan, math.tau)
            needed = max(abs(pan), abs(turn.tilt_rad - look.tilt_rad)) / ahead_s
            rate = max(needed, _SLOWEST_RAD_S) if needed < reach.rate_rad_s else None
        self.driver.point(turn.pan_rad, turn.tilt_rad, rate)
        return turn

    def off(self) -> float:
        """The angle between where it looks and the nearest to the target that it can look."""
        look = self.driver.look
        if look is None:
            return math.inf
        turn = self.sight.turn(*self.wanted(self.sight.now_us), _SLACK_RAD)
        return between((look.pan_rad, look.tilt_rad), (turn.pan_rad, turn.tilt_rad))

    def check_reach(self, turn: Turn, elapsed_s: float, bound_rad: float = THERE_RAD) -> bool:
        """Whether the target is within reach; fails when it has not been for too long."""
        if turn.missing_rad <= bound_rad:
            self._reachable_s = elapsed_s
            return True
        if elapsed_s - self._reachable_s >= LEFT_S:
            raise BehaviorFailedError(f"out of reach for {LEFT_S:g} s: {turn.why}")
        return False

    def check_turning(self, off_rad: float, elapsed_s: float, enough_rad: float) -> None:
        """Fails when the camera comes no nearer to where it is told to look."""
        self._unmoved_s += min(elapsed_s - self._looked_s, LONGEST_STEP_S)
        self._looked_s = elapsed_s
        if off_rad <= enough_rad or off_rad < self._nearest_rad - _NEARER_RAD:
            self._nearest_rad = off_rad if off_rad > enough_rad else math.inf
            self._unmoved_s = 0.0
        elif self._unmoved_s >= STUCK_S:
            raise BehaviorFailedError(
                f"the camera does not get there: {math.degrees(off_rad):.1f} deg are left, and it "
                f"has come no nearer for {STUCK_S:g} s"
            )

    def unreachable(self, bound_rad: float = THERE_RAD) -> str:
        """Why the target cannot be looked at now; "" if it can."""
        try:
            turn = self.sight.turn(*self.wanted(self.sight.now_us))
        except BehaviorFailedError as error:
            return error.reason
        return turn.why if turn.missing_rad > bound_rad else ""


class _AtTarget(Aiming):
    """At the parameter `target`, or else at `bearing` and `elevation`."""

    def wanted(self, at_us: int) -> tuple[float, float]:
        """Where the target is then, from where the vehicle is then."""
        target = self.job.parameters.target
        if target is None:
            return self._direction(at_us)
        place = self.sight.place(target, at_us)
        if place is None:
            assert isinstance(target, VehiclePosition)
            raise BehaviorFailedError(f"where {target.vehicle} is, is not known")
        eye = self.sight.eye(at_us)
        if eye is None:
            raise BehaviorFailedError(self.sight.carrier.missing())
        return eye.at(place)

    def refusal(self) -> str:
        """It must be able to look there now."""
        return self.unreachable()

    def _direction(self, at_us: int) -> tuple[float, float]:
        bearing, elevation = self.job.parameters.bearing_rad, self.job.parameters.elevation_rad
        assert bearing is not None  # the catalogue asks for both where there is no target
        assert elevation is not None
        # Headings are from north, clockwise; yaw is from east, counter-clockwise.
        _, _, yaw = self.sight.carrier.turned(at_us)
        bow = math.pi / 2 - (yaw or 0.0)
        return self.sight.deck(at_us).towards(bow + bearing, elevation)


class PointAt(_AtTarget):
    """Look there, once."""

    name = "ptz_point_at"

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._moved_s = 0.0
        self._last = (math.inf, math.inf)

    async def step(self, elapsed_s: float) -> bool:
        """Done when it looks there, or rests as near as it can."""
        turn = self.aim()
        if not self.check_reach(turn, elapsed_s):
            return False
        off = self.off()
        if off <= THERE_RAD:
            return True
        look = self.driver.look
        now = (look.pan_rad, look.tilt_rad) if look else self._last
        if now != self._last:
            self._last, self._moved_s = now, elapsed_s
        if off <= COARSE_RAD and elapsed_s - self._moved_s >= RESTED_S:
            return True
        self.check_turning(off, elapsed_s, THERE_RAD)
        return False

    def recognised(self) -> BehaviorState:
        """To look there twice does no harm: what is on its way goes on."""
        return BehaviorState.SUCCEEDED if self.off() <= THERE_RAD else BehaviorState.RUNNING


class Track(_AtTarget):
    """Keep looking there."""

    name = "ptz_track"

    async def step(self, elapsed_s: float) -> bool:
        """Done after the duration."""
        duration_s = self.job.parameters.duration_s
        if duration_s is not None and elapsed_s >= duration_s:
            return True
        if self.check_reach(self.aim(_SLACK_RAD), elapsed_s, self._in_view_rad()):
            self.check_turning(self.off(), elapsed_s, self._in_view_rad())
        return False

    def recognised(self) -> BehaviorState:
        """It goes on if it has the target in view."""
        in_view = self.off() <= self._in_view_rad()
        return BehaviorState.RUNNING if in_view else BehaviorState.UNKNOWN

    def _in_view_rad(self) -> float:
        """What is farther away from the middle may be out of the picture."""
        view = self.sight.view(self.driver.look)
        return min(view.width_rad, view.height_rad) / 2


_ZOOM_ENOUGH = 0.02
"""Of the level: as near as lenses come."""

_ZOOM_AGAIN_S = 1.0
_ZOOM_STUCK_S = 20.0


class Zoom(Behavior):
    """To the parameter `level`."""

    name = "zoom"

    _told_s = -_ZOOM_AGAIN_S

    def refusal(self) -> str:
        """The lens must have such a level."""
        most = self.driver.reach.zoom_max
        level = self._level()
        return f"parameter 'level': {level:g} is above {most:g}" if level > most + 1e-9 else ""

    async def step(self, elapsed_s: float) -> bool:
        """Done when it is there."""
        if self._there():
            return True
        if elapsed_s >= _ZOOM_STUCK_S:
            raise BehaviorFailedError(
                f"the camera does not zoom to {self._level():g}: it has not within"
                f" {_ZOOM_STUCK_S:g} s"
            )
        if elapsed_s - self._told_s >= _ZOOM_AGAIN_S:
            self._told_s = elapsed_s
            self.driver.zoom(self._level())
        return False

    def recognised(self) -> BehaviorState:
        """To zoom there twice does no harm: what is on its way goes on."""
        return BehaviorState.SUCCEEDED if self._there() else BehaviorState.RUNNING

    def _level(self) -> float:
        return self.job.parameters.zoom

    def _there(self) -> bool:
        look = self.driver.look
        return look is not None and abs(look.zoom - self._level()) <= _ZOOM_ENOUGH * self._level()
