"""Which poses are believed: a vehicle does not jump, but what says where it is may."""

import math

from m2pem_plugin_ros.pilot.plane import place_of, sane_pose
from m2pem_plugin_ros.pose import Pose

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
