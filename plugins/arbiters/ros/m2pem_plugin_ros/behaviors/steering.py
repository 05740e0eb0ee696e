"""Steering towards a point, speeds for braking and curves, and the limits of commands."""

import math

from m2pem_plugin_ros.behaviors.motion_state import (
    DesiredMotion,
    MotionState,
    Place,
    angle_between,
    direction_to,
    position_of,
)
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

LOOKAHEAD_M = 1.0
LOOKAHEAD_S = 1.0
"""The lookahead grows with speed. It is never less than the turning radius, or the base would swing
about the path."""

SPOT_RAD = math.radians(50.0)
"""A base that turns on the spot does so towards points farther to the side than this."""

ALIGNED_RAD = math.radians(8.0)
"""The turn on the spot ends at this angle."""

BRAKING_SHARE = 0.7
"""Braking uses this part of the acceleration, so that the base does not overshoot."""

APPROACH_S = 0.7
"""Near the end, the speed is the remaining distance divided by this time."""

TURN_GAIN_1_S = 1.5
NEAREST_M = 0.3


def lookahead(bounds: Bounds, speed_m_s: float) -> float:
    """Return how far ahead on the path the base steers to, in metres."""
    return max(LOOKAHEAD_M, bounds.turn_radius_m) + LOOKAHEAD_S * abs(speed_m_s)


def braking_speed(bounds: Bounds, distance_m: float, end_m_s: float = 0.0) -> float:
    """Return the speed from which the base can slow down to `end_m_s` over a distance."""
    distance = max(0.0, distance_m)
    speed = math.sqrt(end_m_s**2 + 2 * BRAKING_SHARE * bounds.acceleration_m_s2 * distance)
    return min(speed, end_m_s + distance / APPROACH_S)


def curve_speed(bounds: Bounds, curvature_1_m: float) -> float:
    """Return the speed in a curve that yaw rate and lateral acceleration allow."""
    curvature = abs(curvature_1_m)
    if curvature < 1e-9:
        return math.inf
    return min(bounds.yaw_rate_rad_s / curvature, math.sqrt(bounds.lateral_m_s2 / curvature))


def sharpest(bounds: Bounds) -> float:
    """Return the highest curvature of the base, in 1/m."""
    return 1 / bounds.turn_radius_m if bounds.turn_radius_m > 0 else math.inf


def curvature_to(pose: Pose, point: Place) -> float:
    """Return the curvature of the arc from the pose through a point; less if the point is very
    near.

    A point behind the pose is turned to as sharply as possible.
    """
    distance = math.dist(position_of(pose), point)
    aside = angle_between(pose.yaw_rad, direction_to(position_of(pose), point))
    if abs(aside) > math.pi / 2:
        return math.copysign(2 / NEAREST_M, aside)
    return 2 * math.sin(aside) / max(distance, NEAREST_M)


class Steering:
    """Steers towards a point; remembers whether the base is turning on the spot."""

    def __init__(self) -> None:
        self._turns = False

    def towards(self, state: MotionState, point: Place, speed_m_s: float) -> DesiredMotion:
        """Return the desired motion towards a point, at most at `speed_m_s`."""
        bounds = state.bounds
        aside = angle_between(state.pose.yaw_rad, direction_to(position_of(state.pose), point))
        if bounds.turn_radius_m == 0:
            self._turns = abs(aside) > (ALIGNED_RAD if self._turns else SPOT_RAD)
            if self._turns:
                return turn(bounds, aside)
        bound = sharpest(bounds)
        curvature = max(-bound, min(bound, curvature_to(state.pose, point)))
        return DesiredMotion(min(speed_m_s, curve_speed(bounds, curvature)), curvature)


def turn(bounds: Bounds, aside_rad: float) -> DesiredMotion:
    """Turn on the spot, with a yaw rate that follows the remaining angle."""
    bound = bounds.yaw_rate_rad_s
    return DesiredMotion(yaw_rate_rad_s=max(-bound, min(bound, TURN_GAIN_1_S * aside_rad)))


STANDSTILL_M_S = 1e-6


class VelocityLimiter:
    """Makes commands of desired motions, within the bounds and the acceleration of the base.
    `speed_m_s`: the last commanded speed."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self.speed_m_s = 0.0

    def halt(self) -> Twist:
        """Return the zero command at once. It is used when the state of the base is not known."""
        self.speed_m_s = 0.0
        return Twist()

    def moved_by_others(self, speed_m_s: float) -> None:
        """Set the speed of a base that is not commanded here. The next command starts from it."""
        self.speed_m_s = self._within(speed_m_s)

    def command(self, desired: DesiredMotion, dt_s: float) -> Twist:
        """Return the possible command nearest to the desired motion, `dt_s` after the last one."""
        if not math.isfinite(desired.speed_m_s + desired.curvature_1_m + desired.yaw_rate_rad_s):
            return self.halt()
        bounds = self._bounds
        change = bounds.acceleration_m_s2 * dt_s
        wanted = self._within(desired.speed_m_s) - self.speed_m_s
        self.speed_m_s = speed = self.speed_m_s + max(-change, min(change, wanted))
        if abs(speed) < STANDSTILL_M_S and desired.speed_m_s == 0.0:
            self.speed_m_s = speed = 0.0
        return Twist(forward_m_s=speed, yaw_rad_s=self._yaw_rate(desired, speed))

    def _within(self, speed_m_s: float) -> float:
        return max(-self._bounds.reverse_m_s, min(self._bounds.speed_m_s, speed_m_s))

    def _yaw_rate(self, desired: DesiredMotion, speed_m_s: float) -> float:
        bounds = self._bounds
        bound = bounds.yaw_rate_rad_s
        yaw_rate = speed_m_s * desired.curvature_1_m
        if bounds.turn_radius_m > 0:
            bound = min(bound, abs(speed_m_s) / bounds.turn_radius_m)
        else:
            yaw_rate += desired.yaw_rate_rad_s
        if abs(speed_m_s) > STANDSTILL_M_S:
            bound = min(bound, bounds.lateral_m_s2 / abs(speed_m_s))
        return max(-bound, min(bound, yaw_rate))
