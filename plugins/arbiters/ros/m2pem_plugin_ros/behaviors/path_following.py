"""Driving along a path (pure pursuit), and the approach to its end."""

import math

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.motion_state import (
    STANDSTILL,
    DesiredMotion,
    Ending,
    MotionState,
    Place,
    angle_between,
    direction_to,
    position_of,
)
from m2pem_plugin_ros.behaviors.path import Path, Progress
from m2pem_plugin_ros.behaviors.steering import (
    LOOKAHEAD_S,
    SPOT_RAD,
    Steering,
    braking_speed,
    curve_speed,
    lookahead,
    sharpest,
)
from m2pem_plugin_ros.settings import Bounds

SHARP_RAD = math.radians(100.0)
"""A base with a turning radius drives to the very point of a sharper corner. A base that turns on
the spot does so at each corner of more than SPOT_RAD."""

ENDED_M = 0.1


class PathFollower:
    """Pure pursuit: steers to the point of the path that is a lookahead away."""

    def __init__(self, path: Path, bounds: Bounds) -> None:
        self.progress = Progress(path, SHARP_RAD if bounds.turn_radius_m > 0 else SPOT_RAD)
        self._steering = Steering()

    def step(self, state: MotionState, speed_m_s: float) -> DesiredMotion | None:
        """Return the desired motion; None at the end of the path."""
        ahead_m = lookahead(state.bounds, state.speed_m_s)
        self.progress.advance(position_of(state.pose), ahead_m)
        if self.progress.leg is None or self.progress.left_m <= ENDED_M:
            return None
        allowed = min(
            speed_for_corners(state.bounds, self.progress, speed_m_s),
            braking_speed(state.bounds, self.progress.left_m),
        )
        return self._steering.towards(state, self.progress.point_ahead(ahead_m), allowed)

    def found_at(self, place: Place, moved_m: float, bounds: Bounds) -> None:
        """Continue from a position that the base did not drive to, `moved_m` from its last one."""
        self.progress.find_again(place, moved_m + lookahead(bounds, 0.0))


def speed_for_corners(bounds: Bounds, progress: Progress, speed_m_s: float) -> float:
    """Return the highest speed, up to `speed_m_s`, from which the base can slow down for each
    corner."""
    reach = lookahead(bounds, speed_m_s) + _braking_distance(bounds, speed_m_s)
    allowed = speed_m_s
    for number, leg, begin, away in progress.ahead():
        corner_m = away + leg.length_m - begin
        if corner_m > reach:
            break
        turn = progress.path.turn(number)
        if progress.is_sharp(number):
            # What cannot turn on the spot drives its tightest curve from there on.
            end = curve_speed(bounds, sharpest(bounds)) if bounds.turn_radius_m > 0 else 0.0
            allowed = min(allowed, braking_speed(bounds, corner_m, min(end, speed_m_s)))
            break
        slow = _corner_speed(bounds, turn)
        begins_m = corner_m - lookahead(bounds, slow)
        if slow < allowed:
            allowed = min(allowed, braking_speed(bounds, begins_m, slow))
    return allowed


def _braking_distance(bounds: Bounds, speed_m_s: float) -> float:
    """Return the braking distance with a margin."""
    return speed_m_s**2 / bounds.acceleration_m_s2 + speed_m_s


def _corner_speed(bounds: Bounds, turn_rad: float) -> float:
    """Return the speed for a corner that is cut from one lookahead before it to one after it.

    Its curvature is at most 2 sin(turn) / lookahead, and the lookahead grows with speed. The bounds
    of yaw rate and lateral acceleration are solved for the speed.
    """
    bend = 2 * math.sin(min(turn_rad, math.pi / 2))
    if bend < 1e-6:
        return math.inf
    at_rest = lookahead(bounds, 0.0)
    yaw_rate, lateral = bounds.yaw_rate_rad_s, bounds.lateral_m_s2
    grows = bend - yaw_rate * LOOKAHEAD_S
    by_yaw_rate = yaw_rate * at_rest / grows if grows > 0 else math.inf
    half = lateral * LOOKAHEAD_S / 2
    by_lateral = (half + math.sqrt(half**2 + bend * lateral * at_rest)) / bend
    return max(min(by_yaw_rate, by_lateral), curve_speed(bounds, sharpest(bounds)))


NEAREST_M = 0.2
"""Smaller tolerances are raised to this."""

AHEAD_RAD = math.radians(60.0)
OUTSIDE, ESCAPED = 1.05, 1.3
"""Diameters of the turning circle, in parts of it. A point within the first cannot be turned to:
the base drives away from it until it lies outside of the second."""

NO_NEARER_S = 30.0
NEARER_M = 0.1
CIRCLES = 4.0


class Approach:
    """Drives to a point, which may move, and stops there. A base that misses it drives on and
    returns."""

    def __init__(self, tolerance_m: float, *, moves: bool = False) -> None:
        self.tolerance_m = max(tolerance_m, NEAREST_M)
        self._moves = moves
        self._steering = Steering()
        self._there = False
        self._escapes = False
        self._nearest_m = math.inf
        self._no_nearer_s = 0.0

    def stop_here(self) -> None:
        """Stop: the base is near enough."""
        self._there = True

    def step(self, state: MotionState, point: Place, speed_m_s: float) -> DesiredMotion | Ending:
        """Return the desired motion, or the ending: the base stands at the point, or comes no
        nearer."""
        distance = math.dist(position_of(state.pose), point)
        if self._there:
            if not state.stands:
                return STANDSTILL
            if self._moves or distance <= self.tolerance_m:
                return Ending()
            self._there = False
        aside = angle_between(state.pose.yaw_rad, direction_to(position_of(state.pose), point))
        passed = distance <= self.tolerance_m and abs(aside) > math.pi / 2
        if distance <= (self.tolerance_m if self._moves else self.tolerance_m / 2) or passed:
            self._there = True
            return STANDSTILL
        if not self._moves and self._no_nearer(state, distance, speed_m_s):
            reason = f"it comes no nearer to its target than {self._nearest_m:.1f} m"
            return Ending(BehaviorState.FAILED, "", reason)
        if state.bounds.turn_radius_m > 0:
            return self._round(state, point, distance, aside, speed_m_s)
        return self._steering.towards(
            state, point, min(speed_m_s, braking_speed(state.bounds, distance))
        )

    def _round(
        self,
        state: MotionState,
        point: Place,
        distance_m: float,
        aside_rad: float,
        speed_m_s: float,
    ) -> DesiredMotion:
        """Return the desired motion of a base with a turning radius."""
        bounds = state.bounds
        within = distance_m**2 / (2 * bounds.turn_radius_m)  # of circles: as wide as abeam
        abeam = distance_m * abs(math.sin(aside_rad))
        self._escapes = abeam * (ESCAPED if self._escapes else OUTSIDE) > within
        slow = min(speed_m_s, curve_speed(bounds, sharpest(bounds)))
        if self._escapes:
            return DesiredMotion(slow)
        if abs(aside_rad) > AHEAD_RAD:
            return self._steering.towards(state, point, slow)
        allowed = min(speed_m_s, braking_speed(bounds, distance_m))
        return self._steering.towards(state, point, allowed)

    def _no_nearer(self, state: MotionState, distance_m: float, speed_m_s: float) -> bool:
        if distance_m < self._nearest_m - NEARER_M:
            self._nearest_m, self._no_nearer_s = distance_m, 0.0
            return False
        self._no_nearer_s += state.dt_s
        circle_m = math.tau * state.bounds.turn_radius_m
        return self._no_nearer_s > NO_NEARER_S + CIRCLES * circle_m / max(speed_m_s, 0.05)
