"""The behaviors `ptz_point_at`, `ptz_track` and `zoom`."""

import math
from abc import abstractmethod

from m2pem.api import BehaviorState, VehiclePosition
from m2pem_plugin_ptz.behaviors.behavior import (
    TICK_S,
    Behavior,
    BehaviorContext,
    BehaviorFailedError,
)
from m2pem_plugin_ptz.camera_model.frames import angle_between
from m2pem_plugin_ptz.camera_model.limits import Reachable

THERE_RAD = math.radians(0.5)
COARSE_RAD = math.radians(2.0)
"""A camera that rests this near to its target has reached it."""

RESTED_S = 2.0
LEFT_S = 10.0
"""A target that is out of reach for this time is lost."""

STUCK_S = 10.0
"""A camera that comes no nearer to its target for this time is stuck."""

STOPS_WITHIN_S = 30.0
"""A camera that moves for this time at its target may report a direction that it does not have."""

LONGEST_STEP_S = 0.5
"""Longest time that one step counts. After a longer one the process was suspended, and has not read
the messages of the camera."""

_NEARER_RAD = math.radians(0.1)
_SLOWEST_RAD_S = 0.02
_SLACK_RAD = math.radians(5.0)


class Pointing(Behavior):
    """Points the camera at a target. It commands the direction that will be right after the
    delay."""

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._reachable_s = 0.0
        self._nearest_rad = math.inf
        self._looked_s = 0.0
        self._unmoved_s = 0.0

    @abstractmethod
    def target_angles(self, at_us: int) -> tuple[float, float]:
        """Return pan and tilt that point at the target at a time, within reach or not.

        Raises:
            BehaviorFailedError: a position, a heading or an attitude is not known.
        """

    def point_ahead(self, slack_rad: float = 0.0) -> Reachable:
        """Point the camera at where the target will be when the camera is there."""
        ahead_s = TICK_S + self.model.settings.delay_s
        reachable = self.model.nearest_reachable(
            *self.target_angles(self.model.now_us + round(ahead_s * 1e6)), slack_rad
        )
        reach, ptz = self.driver.reach, self.driver.ptz
        rate: float | None = None
        if ptz is not None:
            pan = reachable.pan_rad - ptz.pan_rad
            if reach.endless:
                pan = math.remainder(pan, math.tau)
            needed = max(abs(pan), abs(reachable.tilt_rad - ptz.tilt_rad)) / ahead_s
            rate = max(needed, _SLOWEST_RAD_S) if needed < reach.rate_rad_s else None
        self.driver.point(reachable.pan_rad, reachable.tilt_rad, rate)
        return reachable

    def pointing_error_rad(self) -> float:
        """Return the angle between the direction of the camera and the nearest reachable one to the
        target."""
        ptz = self.driver.ptz
        if ptz is None:
            return math.inf
        reachable = self.model.nearest_reachable(*self.target_angles(self.model.now_us), _SLACK_RAD)
        return angle_between((ptz.pan_rad, ptz.tilt_rad), (reachable.pan_rad, reachable.tilt_rad))

    def check_reach(
        self, reachable: Reachable, elapsed_s: float, bound_rad: float = THERE_RAD
    ) -> bool:
        """Return whether the target is within reach. Raise an error if it has not been for too
        long."""
        if reachable.missing_rad <= bound_rad:
            self._reachable_s = elapsed_s
            return True
        if elapsed_s - self._reachable_s >= LEFT_S:
            raise BehaviorFailedError(f"out of reach for {LEFT_S:g} s: {reachable.why}")
        return False

    def check_progress(self, off_rad: float, elapsed_s: float, enough_rad: float) -> None:
        """Raise an error if the camera has come no nearer to its target for too long."""
        self._unmoved_s += min(elapsed_s - self._looked_s, LONGEST_STEP_S)
        self._looked_s = elapsed_s
        if off_rad <= enough_rad or off_rad < self._nearest_rad - _NEARER_RAD:
            self._nearest_rad = off_rad if off_rad > enough_rad else math.inf
            self._unmoved_s = 0.0
        elif self._unmoved_s >= STUCK_S:
            raise BehaviorFailedError(
                f"the camera does not turn to its target: {math.degrees(off_rad):.1f} deg are "
                f"left, and it has come no nearer for {STUCK_S:g} s"
            )

    def unreachable(self, bound_rad: float = THERE_RAD) -> str:
        """Return why the target cannot be pointed at now; "" if it can."""
        try:
            reachable = self.model.nearest_reachable(*self.target_angles(self.model.now_us))
        except BehaviorFailedError as error:
            return error.reason
        return reachable.why if reachable.missing_rad > bound_rad else ""


class _PointingAtTarget(Pointing):
    """Points at the parameter `target`, or in the direction `bearing` and `elevation`."""

    def target_angles(self, at_us: int) -> tuple[float, float]:
        """Return the angles from the predicted pose of the vehicle to the predicted target."""
        target = self.context.parameters.target
        if target is None:
            return self._direction(at_us)
        place = self.model.place(target, at_us)
        if place is None:
            assert isinstance(target, VehiclePosition)
            raise BehaviorFailedError(f"the position of {target.vehicle} is not known")
        camera_pose = self.model.camera_pose(at_us)
        if camera_pose is None:
            raise BehaviorFailedError(self.model.vehicle_pose.missing())
        return camera_pose.at(place)

    def refusal(self) -> str:
        """Return why the target is not within reach now."""
        return self.unreachable()

    def _direction(self, at_us: int) -> tuple[float, float]:
        bearing, elevation = (
            self.context.parameters.bearing_rad,
            self.context.parameters.elevation_rad,
        )
        assert bearing is not None  # the catalogue asks for both where there is no target
        assert elevation is not None
        # Headings are from north, clockwise; yaw is from east, counter-clockwise.
        _, _, yaw = self.model.vehicle_pose.attitude(at_us)
        heading = math.pi / 2 - (yaw or 0.0)
        return self.model.mount_frame(at_us).towards(heading + bearing, elevation)


class PointAt(_PointingAtTarget):
    """Point at the target once."""

    name = "ptz_point_at"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._moved_s = self._there_s = 0.0
        self._last = (math.inf, math.inf)

    async def step(self, elapsed_s: float) -> bool:
        """Return whether the camera points at the target, or rests near it."""
        reachable = self.point_ahead()
        if not self.check_reach(reachable, elapsed_s):
            return False
        pointing_error_rad, ptz = self.pointing_error_rad(), self.driver.ptz
        moving = ptz is not None and ptz.moving
        if pointing_error_rad > COARSE_RAD:
            self._there_s = elapsed_s
        elif moving:
            if elapsed_s - self._there_s >= STOPS_WITHIN_S:
                raise BehaviorFailedError(
                    "the camera reports the direction of its target, and for "
                    f"{STOPS_WITHIN_S:g} s that it still moves"
                )
            return False
        if pointing_error_rad <= THERE_RAD:
            return True
        now = (ptz.pan_rad, ptz.tilt_rad) if ptz else self._last
        if now != self._last:
            self._last, self._moved_s = now, elapsed_s
        if pointing_error_rad <= COARSE_RAD and elapsed_s - self._moved_s >= RESTED_S:
            return True
        self.check_progress(pointing_error_rad, elapsed_s, THERE_RAD)
        return False

    def state_after_restart(self) -> BehaviorState:
        """Return SUCCEEDED if the camera points there, else RUNNING: a repetition does no harm."""
        ptz = self.driver.ptz
        rests = ptz is not None and not ptz.moving
        is_there = rests and self.pointing_error_rad() <= THERE_RAD
        return BehaviorState.SUCCEEDED if is_there else BehaviorState.RUNNING


class Track(_PointingAtTarget):
    """Point at the target continuously."""

    name = "ptz_track"

    async def step(self, elapsed_s: float) -> bool:
        """Return whether `duration` is over."""
        duration_s = self.context.parameters.duration_s
        if duration_s is not None and elapsed_s >= duration_s:
            return True
        if self.check_reach(self.point_ahead(_SLACK_RAD), elapsed_s, self._in_view_rad()):
            self.check_progress(self.pointing_error_rad(), elapsed_s, self._in_view_rad())
        return False

    def state_after_restart(self) -> BehaviorState:
        """Return RUNNING if the target is in view; otherwise UNKNOWN."""
        in_view = self.pointing_error_rad() <= self._in_view_rad()
        return BehaviorState.RUNNING if in_view else BehaviorState.UNKNOWN

    def _in_view_rad(self) -> float:
        """Return the angle from the center within which a target is certainly in view."""
        field_of_view = self.model.field_of_view(self.driver.ptz)
        return min(field_of_view.width_rad, field_of_view.height_rad) / 2


_ZOOM_ENOUGH = 0.02
"""Relative tolerance of the zoom level."""

_ZOOM_AGAIN_S = 1.0
_ZOOM_STUCK_S = 20.0


class Zoom(Behavior):
    """Zoom to `level`."""

    name = "zoom"

    _commanded_s = -_ZOOM_AGAIN_S

    def refusal(self) -> str:
        most = self.driver.reach.zoom_max
        level = self._level()
        return f"parameter 'level': {level:g} is above {most:g}" if level > most + 1e-9 else ""

    async def step(self, elapsed_s: float) -> bool:
        """Return whether the zoom level is reached."""
        if self._is_there():
            return True
        if elapsed_s >= _ZOOM_STUCK_S:
            raise BehaviorFailedError(
                f"the camera does not zoom to {self._level():g} within {_ZOOM_STUCK_S:g} s"
            )
        if elapsed_s - self._commanded_s >= _ZOOM_AGAIN_S:
            self._commanded_s = elapsed_s
            self.driver.zoom(self._level())
        return False

    def state_after_restart(self) -> BehaviorState:
        """Return SUCCEEDED at the level; otherwise RUNNING: zooming again does no harm."""
        return BehaviorState.SUCCEEDED if self._is_there() else BehaviorState.RUNNING

    def _level(self) -> float:
        return self.context.parameters.zoom

    def _is_there(self) -> bool:
        ptz = self.driver.ptz
        if ptz is None or ptz.moving:
            return False
        return abs(ptz.zoom - self._level()) <= _ZOOM_ENOUGH * self._level()
