"""How fast one may be for the corners that lie ahead."""

import math

from m2pem_plugin_ros.pilot.progress import Progress
from m2pem_plugin_ros.pilot.steering import (
    LOOKAHEAD_S,
    braking_speed,
    curve_speed,
    lookahead,
    sharpest,
)
from m2pem_plugin_ros.settings import Bounds


def speed_for_corners(bounds: Bounds, progress: Progress, speed_m_s: float) -> float:
    """The highest speed, up to `speed_m_s`, from which one can still slow down for each corner."""
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
    """From a speed to a stand, and some more."""
    return speed_m_s**2 / bounds.acceleration_m_s2 + speed_m_s


def _corner_speed(bounds: Bounds, turn_rad: float) -> float:
    """For a corner that is cut from a lookahead before it to one after it.

    The curvature of that is 2 sin(turn) / lookahead at most, and the lookahead is longer at speed:
    both bounds, solved for the speed.
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
