"""Straight backwards."""

import math

from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import STAND, Ending, Scene, Wish, place_of
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path import Leg
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
    """Over `distance`, along the line that it stands on when it begins."""

    name = "reverse"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._distance_m = parameters.distance_m
        self._line: Leg | None = None
        self._over = False

    def step(self, scene: Scene) -> Wish | Ending:
        """Backwards as one drives forwards along a path: by a point that is some way ahead."""
        backwards = scene.pose.yaw_rad + math.pi
        if self._line is None:
            end = place_of(scene.pose)
            self._line = Leg(end, math.remainder(backwards, math.tau), self._distance_m)
        along = self._line.along(place_of(scene.pose))
        left = self._distance_m - along
        self._over = left <= (BACK_AGAIN_M if self._over else ENDED_M)
        if self._over:
            return Ending() if scene.stands else STAND
        point = self._line.at(along + lookahead(self.bounds, scene.speed_m_s))
        seen_from_behind = Pose(scene.pose.east_m, scene.pose.north_m, backwards)
        bound = sharpest(self.bounds)
        bend = max(-bound, min(bound, curvature_to(seen_from_behind, point)))
        speed = min(
            self.speed_m_s,
            self.bounds.reverse_m_s,
            curve_speed(self.bounds, bend),
            braking_speed(self.bounds, left),
        )
        return Wish(-speed, -bend)
