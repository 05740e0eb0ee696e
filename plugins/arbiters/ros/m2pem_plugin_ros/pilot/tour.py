"""Driving along a path to its end."""

import math

from m2pem_plugin_ros.pilot.corners import speed_for_corners
from m2pem_plugin_ros.pilot.path import Path
from m2pem_plugin_ros.pilot.plane import Place, place_of
from m2pem_plugin_ros.pilot.progress import Progress
from m2pem_plugin_ros.pilot.steering import SPOT_RAD, Steering, braking_speed, lookahead
from m2pem_plugin_ros.pilot.words import Scene, Wish
from m2pem_plugin_ros.settings import Bounds

SHARP_RAD = math.radians(100.0)
"""A corner of more than that is driven to its very point by a base that cannot turn on the spot;
it is not cut. One that can turns at every corner of more than SPOT_RAD."""

ENDED_M = 0.1


class Tour:
    """Pure pursuit: it steers to the point of the path that is a lookahead away."""

    def __init__(self, path: Path, bounds: Bounds) -> None:
        self.progress = Progress(path, SHARP_RAD if bounds.turn_radius_m > 0 else SPOT_RAD)
        self._steering = Steering()

    def step(self, scene: Scene, speed_m_s: float) -> Wish | None:
        """One step; None: the end is reached, or as good as."""
        ahead_m = lookahead(scene.bounds, scene.speed_m_s)
        self.progress.advance(place_of(scene.pose), ahead_m)
        if self.progress.leg is None or self.progress.left_m <= ENDED_M:
            return None
        allowed = min(
            speed_for_corners(scene.bounds, self.progress, speed_m_s),
            braking_speed(scene.bounds, self.progress.left_m),
        )
        return self._steering.towards(scene, self.progress.point_ahead(ahead_m), allowed)

    def found_at(self, place: Place, moved_m: float, bounds: Bounds) -> None:
        """The vehicle is at a place that it has not driven to, so far from where it was."""
        self.progress.find_again(place, moved_m + lookahead(bounds, 0.0))
