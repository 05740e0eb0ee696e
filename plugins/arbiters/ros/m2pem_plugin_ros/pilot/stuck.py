"""Notices a base that is commanded to move, and does not."""

import math

from m2pem_plugin_ros.pilot.plane import place_of, turned
from m2pem_plugin_ros.pose import Pose, Twist

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
