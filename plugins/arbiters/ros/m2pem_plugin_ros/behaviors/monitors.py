"""Which poses are believed: a vehicle does not jump, but what says where it is may."""

import math
from collections.abc import Callable

from m2pem_plugin_ros.behaviors.motion_state import Place, place_of, sane_pose, turned
from m2pem_plugin_ros.pose import Pose, Twist

IGNORED = 3
"""So many poses in a row that cannot be are ignored; the next one is believed."""

JITTER_M = 0.5
MARGIN = 1.5
"""A pose may be so far from the one before, beside so many times what the top speed allows."""

SAME_S = 1e-4


class PoseGate:
    """Hands on the poses that can be."""

    def __init__(self, top_speed_m_s: float) -> None:
        self._top_speed_m_s = top_speed_m_s
        self._believed: Pose | None = None
        self._heard_s = -math.inf
        self._believed_s = -math.inf
        self._ignored = 0

    @property
    def doubts(self) -> bool:
        """Whether the pose to go by is an old one, since the last cannot be."""
        return self._ignored > 0

    def pose(self, pose: Pose | None, heard_s: float, *, strict: bool = True) -> Pose | None:
        """The pose to go by, given the one that was heard at `heard_s`; None: there is none.

        Not `strict`: nothing depends on it, and whatever is a pose is believed.
        """
        pose = sane_pose(pose)
        if pose is None:
            return None
        if heard_s - self._heard_s < SAME_S and self._believed is not None:
            return self._believed
        self._heard_s = heard_s
        if strict and self._jumps(pose, heard_s) and self._ignored < IGNORED:
            self._ignored += 1
            return self._believed
        self._believed, self._believed_s, self._ignored = pose, heard_s, 0
        return pose

    def _jumps(self, pose: Pose, heard_s: float) -> bool:
        if self._believed is None:
            return False
        far = math.dist(place_of(self._believed), place_of(pose))
        passed_s = heard_s - self._believed_s
        return far > JITTER_M + MARGIN * self._top_speed_m_s * passed_s


STRAY_M = 1.0
"""So far outside is not left yet: a way may run along the fence, and a base swings out a little."""


class FenceWatch:
    """During one motion. Who was outside when that began may come back.

    `outside_m`: how far a place is from where one may be; 0 inside.
    """

    def __init__(self, outside_m: Callable[[Place], float]) -> None:
        self._outside_m = outside_m
        self._was_inside = False

    def forget(self) -> None:
        """Another motion begins."""
        self._was_inside = False

    def left_by_m(self, place: Place) -> float:
        """How far outside who is at a place has gone; 0 if it has not."""
        by_m = self._outside_m(place)
        if by_m <= STRAY_M:
            self._was_inside = True
            return 0.0
        return by_m if self._was_inside else 0.0


STUCK_S = 15.0
MOVED_M = 0.3
TURNED_RAD = 0.3
SHARE = 0.5
"""Of what was commanded: who creeps by order need not have come as far as MOVED_M."""


class StuckWatch:
    """Looks at each step; counts only the time in which a motion is commanded."""

    def __init__(self) -> None:
        self._from: Pose | None = None
        self._commanded_s = 0.0
        self._commanded_m = 0.0
        self._commanded_rad = 0.0

    def forget(self) -> None:
        """It begins anew."""
        self._from = None

    def stuck(self, pose: Pose, twist: Twist, dt_s: float) -> bool:
        """Whether there was no movement for so long. `twist` is what was commanded."""
        if self._from is None or self._moved(self._from, pose):
            self._from = pose
            self._commanded_s = self._commanded_m = self._commanded_rad = 0.0
        if twist.forward_m_s != 0.0 or twist.yaw_rad_s != 0.0:
            self._commanded_s += dt_s
            self._commanded_m += abs(twist.forward_m_s) * dt_s
            self._commanded_rad += abs(twist.yaw_rad_s) * dt_s
        return self._commanded_s >= STUCK_S

    def _moved(self, before: Pose, pose: Pose) -> bool:
        """As far as it was told, or as far as matters; turning counts if that is what it does."""
        far = math.dist(place_of(before), place_of(pose))
        if self._commanded_m > 0.0 and far >= min(MOVED_M, SHARE * self._commanded_m):
            return True
        turns = self._commanded_rad > 0.0 and self._commanded_m < MOVED_M
        aside = abs(turned(before.yaw_rad, pose.yaw_rad))
        return turns and aside >= min(TURNED_RAD, SHARE * self._commanded_rad)
