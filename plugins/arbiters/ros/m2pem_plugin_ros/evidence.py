"""Whether odometry agrees with how a behavior has ended.

A node, an action server or a driver reports an end in a message; odometry shows what the vehicle
did. Where they contradict each other, odometry counts.
"""

import math

from m2pem.api import BehaviorParameters, BehaviorRequest, BehaviorState, GeoPosition, Point
from m2pem_plugin_ros.frames import Origin, to_local
from m2pem_plugin_ros.sensors.localization import Localization

FRESH_S = 1.0
"""Older odometry shows nothing."""

SETTLE_S = {BehaviorState.SUCCEEDED: 2.0, BehaviorState.CANCELLED: 7.0}
"""Odometry has to agree this soon after the report of such an end: a vehicle may have to brake."""

FAR_M = {"ground": 3.0, "surface": 15.0, "air": 50.0}
"""Farther from its target than this, by domain, a vehicle has not arrived at it. A behavior with
`tolerance` has that and `SLACK_M`."""

SLACK_M = 1.0
MOVES_M_S = 0.3
"""A ground vehicle that is faster does not stand. Boats drift, and aircraft may circle."""

_DRIVING = ("single_vehicle_routing", "goto", "follow", "reverse")
_ENDS_AT_REST = {BehaviorState.SUCCEEDED: ("drive_stop",), BehaviorState.CANCELLED: _DRIVING}


def contradiction(
    request: BehaviorRequest,
    state: BehaviorState,
    domain: str,
    localization: Localization,
    origin: Origin,
) -> str:
    """Return what odometry shows against the end `state` of a behavior; "" if it shows nothing."""
    pose, twist = localization.pose, localization.twist
    if state not in SETTLE_S or pose is None or localization.age_s > FRESH_S:
        return ""
    if request.behavior in _ENDS_AT_REST[state] and domain == "ground" and twist is not None:
        speed_m_s = math.hypot(twist.forward_m_s, twist.left_m_s)
        return f"it moves at {speed_m_s:.1f} m/s" if speed_m_s > MOVES_M_S else ""
    given = BehaviorParameters(request.parameters)
    end = _end_of(request.behavior, given)
    if state is not BehaviorState.SUCCEEDED or end is None:
        return ""
    east_m, north_m, _ = to_local(GeoPosition(*end, origin[2]), origin)
    away_m = math.hypot(east_m - pose.east_m, north_m - pose.north_m)
    tolerance_m = given.tolerance_m
    most_m = FAR_M[domain] if tolerance_m is None else tolerance_m + SLACK_M
    return f"it is {away_m:.1f} m from its target" if away_m > most_m else ""


def _end_of(behavior: str, given: BehaviorParameters) -> tuple[float, float] | None:
    """Return latitude and longitude of the fixed place where a behavior ends, if it has one."""
    if behavior == "goto" and isinstance(given.target, Point):
        return given.target.position[:2]
    if behavior == "single_vehicle_routing" and given.route and not given.flag("loop"):
        return given.route.waypoints[-1][:2]
    return None
