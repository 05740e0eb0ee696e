"""Monitors of a base while it drives: implausible poses, leaving the fence, being stuck."""

import math
from collections.abc import Callable

from m2pem_plugin_ros.behaviors.motion_state import Place, angle_between, position_of, sane_pose
from m2pem_plugin_ros.pose import Pose, Twist

IGNORED = 3
"""The filter drops at most this many implausible poses in a row, and accepts the next one."""

JITTER_M = 0.5
MARGIN = 1.5
"""A pose may be this much farther from the last one than the top speed allows, besides JITTER_M."""

SAME_S = 1e-4


class PoseFilter:
    """Drops poses to which the vehicle cannot have moved since the last one."""

    def __init__(self, top_speed_m_s: float) -> None:
        self._top_speed_m_s = top_speed_m_s
        self._believed: Pose | None = None
        self._received_s = -math.inf
        self._believed_s = -math.inf
        self._ignored = 0

    @property
    def doubts(self) -> bool:
        """Whether the last pose was dropped, so that `pose` returned an older one."""
        return self._ignored > 0

    def pose(self, pose: Pose | None, received_s: float, *, strict: bool = True) -> Pose | None:
        """Return the pose to use, given the one received at `received_s`; None if there is none.

        With `strict` False, no behavior depends on it, and any finite pose is accepted.
        """
        pose = sane_pose(pose)
        if pose is None:
            return None
        if received_s - self._received_s < SAME_S and self._believed is not None:
            return self._believed
        self._received_s = received_s
        if strict and self._jumps(pose, received_s) and self._ignored < IGNORED:
            self._ignored += 1
            return self._believed
        self._believed, self._believed_s, self._ignored = pose, received_s, 0
        return pose

    def _jumps(self, pose: Pose, received_s: float) -> bool:
        if self._believed is None:
            return False
        far = math.dist(position_of(self._believed), position_of(pose))
        passed_s = received_s - self._believed_s
        return far > JITTER_M + MARGIN * self._top_speed_m_s * passed_s


STRAY_M = 1.0
"""This far outside still counts as inside: routes may run along the fence, and a base swings
out."""


class FenceMonitor:
    """Detects that the base leaves the fence during a motion. A base that began outside may come
    back.

    `outside_m` returns the distance of a position from the permitted area; 0 inside.
    """

    def __init__(self, outside_m: Callable[[Place], float]) -> None:
        self._outside_m = outside_m
        self._was_inside = False

    def reset(self) -> None:
        """Start a new motion."""
        self._was_inside = False

    def left_by_m(self, place: Place) -> float:
        """Return how far outside the base is, if it has left the fence; otherwise 0."""
        by_m = self._outside_m(place)
        if by_m <= STRAY_M:
            self._was_inside = True
            return 0.0
        return by_m if self._was_inside else 0.0


STUCK_S = 15.0
MOVED_M = 0.3
ASTRAY_M = 2.0
TURNED_RAD = 0.3
SHARE = 0.5
"""A base that is commanded slowly has moved if it covered this part of the commanded distance."""


class StuckMonitor:
    """Detects a base that is commanded to move and does not, or that moves backwards or sideways
    instead. Time without a command does not count."""

    def __init__(self) -> None:
        self._from: Pose | None = None
        self._commanded_s = 0.0
        self._commanded_m = 0.0
        self._commanded_rad = 0.0

    def reset(self) -> None:
        """Start again."""
        self._from = None

    def stuck(self, pose: Pose, twist: Twist, dt_s: float) -> str:
        """Return how the base does not move as commanded: not for `STUCK_S`, or elsewhere by
        `ASTRAY_M`; "" if it does. `twist` is the last command."""
        if self._from is None or self._moved(self._from, pose, twist):
            self._from = pose
            self._commanded_s = self._commanded_m = self._commanded_rad = 0.0
        if twist.forward_m_s != 0.0 or twist.yaw_rad_s != 0.0:
            self._commanded_s += dt_s
            self._commanded_m += abs(twist.forward_m_s) * dt_s
            self._commanded_rad += abs(twist.yaw_rad_s) * dt_s
        if self._commanded_m and math.dist(position_of(self._from), position_of(pose)) > ASTRAY_M:
            way = "ahead" if twist.forward_m_s >= 0.0 else "back"
            return f"it was commanded {way}, and has moved {ASTRAY_M:g} m elsewhere"
        late = self._commanded_s >= STUCK_S
        return f"it was commanded to move for {STUCK_S:g} s, and has not moved" if late else ""

    def _moved(self, before: Pose, pose: Pose, twist: Twist) -> bool:
        """Whether the base moved as far as commanded, or by MOVED_M, in the commanded direction.
        Turning counts if it only turns."""
        course_rad = before.yaw_rad + angle_between(before.yaw_rad, pose.yaw_rad) / 2
        east_m, north_m = pose.east_m - before.east_m, pose.north_m - before.north_m
        along_m = east_m * math.cos(course_rad) + north_m * math.sin(course_rad)
        along_m *= math.copysign(1.0, twist.forward_m_s)
        if self._commanded_m > 0.0 and along_m >= min(MOVED_M, SHARE * self._commanded_m):
            return True
        turns = self._commanded_rad > 0.0 and self._commanded_m < MOVED_M
        aside = abs(angle_between(before.yaw_rad, pose.yaw_rad))
        return turns and aside >= min(TURNED_RAD, SHARE * self._commanded_rad)
