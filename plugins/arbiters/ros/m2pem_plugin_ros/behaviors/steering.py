"""How to steer towards a point, and how fast one may be for it."""

import math

from m2pem_plugin_ros.behaviors.motion_state import (
    Place,
    Scene,
    Wish,
    place_of,
    turned,
    yaw_towards,
)
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

LOOKAHEAD_M = 1.0
LOOKAHEAD_S = 1.0
"""How far ahead along a path one steers: this, and more with speed. It is never less than a turning
radius, since a base that cannot turn so soon would swing about the path."""

SPOT_RAD = math.radians(50.0)
"""A base that can turns on the spot towards what is farther to the side than this."""

ALIGNED_RAD = math.radians(8.0)
"""It has turned when it points so well."""

BRAKING_SHARE = 0.7
"""Of the acceleration that the base has: who brakes later than that comes to stand too far."""

APPROACH_S = 0.7
"""The last metres are driven ever more slowly: the speed is the distance left, over this."""

TURN_GAIN_1_S = 1.5
NEAREST_M = 0.3


def lookahead(bounds: Bounds, speed_m_s: float) -> float:
    """How far ahead along a path to steer, in metres."""
    return max(LOOKAHEAD_M, bounds.turn_radius_m) + LOOKAHEAD_S * abs(speed_m_s)


def braking_speed(bounds: Bounds, distance_m: float, end_m_s: float = 0.0) -> float:
    """The speed from which one can slow down to `end_m_s` over a distance."""
    distance = max(0.0, distance_m)
    speed = math.sqrt(end_m_s**2 + 2 * BRAKING_SHARE * bounds.acceleration_m_s2 * distance)
    return min(speed, end_m_s + distance / APPROACH_S)


def curve_speed(bounds: Bounds, curvature_1_m: float) -> float:
    """The speed that a curve allows, by yaw rate and lateral acceleration."""
    curvature = abs(curvature_1_m)
    if curvature < 1e-9:
        return math.inf
    return min(bounds.yaw_rate_rad_s / curvature, math.sqrt(bounds.lateral_m_s2 / curvature))


def sharpest(bounds: Bounds) -> float:
    """The curvature that the base can drive, 1/m."""
    return 1 / bounds.turn_radius_m if bounds.turn_radius_m > 0 else math.inf


def curvature_to(pose: Pose, point: Place, nearest_m: float = NEAREST_M) -> float:
    """Of the arc that leaves along the bow and leads through a point; less if it is very near.

    What lies behind is turned to as sharply as can be: that arc would be ever wider.
    """
    distance = math.dist(place_of(pose), point)
    aside = turned(pose.yaw_rad, yaw_towards(place_of(pose), point))
    if abs(aside) > math.pi / 2:
        return math.copysign(2 / nearest_m, aside)
    return 2 * math.sin(aside) / max(distance, nearest_m)


class Steering:
    """Towards a point, at most at `speed_m_s`; it knows whether it is turning on the spot."""

    def __init__(self) -> None:
        self._turns = False

    def towards(self, scene: Scene, point: Place, speed_m_s: float) -> Wish:
        """One step of it."""
        bounds = scene.bounds
        aside = turned(scene.pose.yaw_rad, yaw_towards(place_of(scene.pose), point))
        if bounds.turn_radius_m == 0:
            self._turns = abs(aside) > (ALIGNED_RAD if self._turns else SPOT_RAD)
            if self._turns:
                return turn(bounds, aside)
        bound = sharpest(bounds)
        curvature = max(-bound, min(bound, curvature_to(scene.pose, point)))
        return Wish(min(speed_m_s, curve_speed(bounds, curvature)), curvature)


def turn(bounds: Bounds, aside_rad: float) -> Wish:
    """On the spot, by what is left to turn."""
    bound = bounds.yaw_rate_rad_s
    return Wish(yaw_rate_rad_s=max(-bound, min(bound, TURN_GAIN_1_S * aside_rad)))


STANDSTILL_M_S = 1e-6


class Governor:
    """Turns wishes into commands, each of which is near the one before."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._speed_m_s = 0.0

    @property
    def speed_m_s(self) -> float:
        """What was commanded last."""
        return self._speed_m_s

    def halt(self) -> Twist:
        """Zero, at once: what is not known must not be driven on."""
        self._speed_m_s = 0.0
        return Twist()

    def moved_by_others(self, speed_m_s: float) -> None:
        """Nobody here commands it: the next command begins at what it does now."""
        self._speed_m_s = self._within(speed_m_s)

    def command(self, wish: Wish, dt_s: float) -> Twist:
        """The command that is nearest to the wish, `dt_s` after the last one."""
        if not math.isfinite(wish.speed_m_s + wish.curvature_1_m + wish.yaw_rate_rad_s):
            return self.halt()
        bounds = self._bounds
        change = bounds.acceleration_m_s2 * dt_s
        wanted = self._within(wish.speed_m_s) - self._speed_m_s
        self._speed_m_s = speed = self._speed_m_s + max(-change, min(change, wanted))
        if abs(speed) < STANDSTILL_M_S and wish.speed_m_s == 0.0:
            self._speed_m_s = speed = 0.0
        return Twist(forward_m_s=speed, yaw_rad_s=self._yaw_rate(wish, speed))

    def _within(self, speed_m_s: float) -> float:
        return max(-self._bounds.reverse_m_s, min(self._bounds.speed_m_s, speed_m_s))

    def _yaw_rate(self, wish: Wish, speed_m_s: float) -> float:
        bounds = self._bounds
        bound = bounds.yaw_rate_rad_s
        yaw_rate = speed_m_s * wish.curvature_1_m
        if bounds.turn_radius_m > 0:
            bound = min(bound, abs(speed_m_s) / bounds.turn_radius_m)
        else:
            yaw_rate += wish.yaw_rate_rad_s
        if abs(speed_m_s) > STANDSTILL_M_S:
            bound = min(bound, bounds.lateral_m_s2 / abs(speed_m_s))
        return max(-bound, min(bound, yaw_rate))
