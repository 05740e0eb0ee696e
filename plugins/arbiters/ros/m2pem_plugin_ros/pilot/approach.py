"""Driving to a point, and standing there."""

import math

from m2pem.api import BehaviorState
from m2pem_plugin_ros.pilot.plane import Place, place_of, turned, yaw_towards
from m2pem_plugin_ros.pilot.steering import Steering, braking_speed, curve_speed, sharpest
from m2pem_plugin_ros.pilot.words import STAND, Ending, Scene, Wish

NEAREST_M = 0.2
"""A tolerance below this is taken for this."""

AHEAD_RAD = math.radians(60.0)
OUTSIDE, ESCAPED = 1.05, 1.3
"""Turning circles, in radii: what lies within the first cannot be turned to, and is driven away
from until it lies outside of the second."""

NO_NEARER_S = 30.0
NEARER_M = 0.1
CIRCLES = 4.0


class Approach:
    """To a point, which may move. A base that cannot turn so soon drives on, and comes back."""

    def __init__(self, tolerance_m: float, *, moves: bool = False) -> None:
        self.tolerance_m = max(tolerance_m, NEAREST_M)
        self._moves = moves
        self._steering = Steering()
        self._there = False
        self._escapes = False
        self._nearest_m = math.inf
        self._no_nearer_s = 0.0

    def stop_here(self) -> None:
        """It is there: nothing is to be gained by coming nearer."""
        self._there = True

    def step(self, scene: Scene, point: Place, speed_m_s: float) -> Wish | Ending:
        """One step; an ending when it is there and stands, or comes no nearer."""
        distance = math.dist(place_of(scene.pose), point)
        if self._there:
            if not scene.stands:
                return STAND
            if self._moves or distance <= self.tolerance_m:
                return Ending()
            self._there = False
        aside = turned(scene.pose.yaw_rad, yaw_towards(place_of(scene.pose), point))
        passed = distance <= self.tolerance_m and abs(aside) > math.pi / 2
        if distance <= (self.tolerance_m if self._moves else self.tolerance_m / 2) or passed:
            self._there = True
            return STAND
        if not self._moves and self._no_nearer(scene, distance, speed_m_s):
            reason = f"it comes no nearer to its target than {self._nearest_m:.1f} m"
            return Ending(BehaviorState.FAILED, "", reason)
        if scene.bounds.turn_radius_m > 0:
            return self._round(scene, point, distance, aside, speed_m_s)
        return self._steering.towards(
            scene, point, min(speed_m_s, braking_speed(scene.bounds, distance))
        )

    def _round(
        self, scene: Scene, point: Place, distance_m: float, aside_rad: float, speed_m_s: float
    ) -> Wish:
        """As a base does that has a turning circle."""
        bounds = scene.bounds
        within = distance_m**2 / (2 * bounds.turn_radius_m)  # of circles: as wide as abeam
        abeam = distance_m * abs(math.sin(aside_rad))
        self._escapes = abeam * (ESCAPED if self._escapes else OUTSIDE) > within
        slow = min(speed_m_s, curve_speed(bounds, sharpest(bounds)))
        if self._escapes:
            return Wish(slow)
        if abs(aside_rad) > AHEAD_RAD:
            return self._steering.towards(scene, point, slow)
        allowed = min(speed_m_s, braking_speed(bounds, distance_m))
        return self._steering.towards(scene, point, allowed)

    def _no_nearer(self, scene: Scene, distance_m: float, speed_m_s: float) -> bool:
        if distance_m < self._nearest_m - NEARER_M:
            self._nearest_m, self._no_nearer_s = distance_m, 0.0
            return False
        self._no_nearer_s += scene.dt_s
        circle_m = math.tau * scene.bounds.turn_radius_m
        return self._no_nearer_s > NO_NEARER_S + CIRCLES * circle_m / max(speed_m_s, 0.05)
