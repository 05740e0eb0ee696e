"""The behavior `reverse`: drive straight backwards."""

import math

from m2pem.api import Segment
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    STANDSTILL,
    DesiredMotion,
    Ending,
    MotionState,
    position_of,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.steering import (
    braking_speed,
    curvature_to,
    curve_speed,
    lookahead,
    sharpest,
)
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds

ENDED_M = 0.05
BACK_AGAIN_M = 0.3


class Reverse(Motion):
    """Drive backwards over `distance`, along the line through the pose at the start."""

    name = "reverse"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._distance_m = parameters.distance_m
        self._line: Segment | None = None
        self._over = False

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        """Steer backwards to a point that is a lookahead behind the base."""
        backwards = state.pose.yaw_rad + math.pi
        if self._line is None:
            end = position_of(state.pose)
            self._line = Segment(end, math.remainder(backwards, math.tau), self._distance_m)
        along = self._line.along(position_of(state.pose))
        left = self._distance_m - along
        self._over = left <= (BACK_AGAIN_M if self._over else ENDED_M)
        if self._over:
            return Ending() if state.stands else STANDSTILL
        point = self._line.at(along + lookahead(self.bounds, state.speed_m_s))
        seen_from_behind = Pose(state.pose.east_m, state.pose.north_m, backwards)
        bound = sharpest(self.bounds)
        bend = max(-bound, min(bound, curvature_to(seen_from_behind, point)))
        speed = min(
            self.speed_m_s,
            self.bounds.reverse_m_s,
            curve_speed(self.bounds, bend),
            braking_speed(self.bounds, left),
        )
        return DesiredMotion(-speed, -bend)
