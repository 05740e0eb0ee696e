"""Poses and twists in the local frame of the fleet: ENU at the fleet's origin.

That is the frame `map` of ROS (REP-105) for all vehicles of a fleet. x is east, y is north, yaw is
from east, counter-clockwise (REP-103).
"""

import math
from dataclasses import dataclass

from m2pem.api import VehicleState


@dataclass(frozen=True, slots=True)
class Pose:
    """In metres and radians."""

    east_m: float
    north_m: float
    yaw_rad: float
    up_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Twist:
    """In the frame of the vehicle (x forward, y left), in metres and radians a second."""

    forward_m_s: float = 0.0
    yaw_rad_s: float = 0.0
    left_m_s: float = 0.0


COURSE_ABOVE_M_S = 0.3
"""The course of a vehicle faster than this is used as its heading, if it reports none."""


def known_yaw_rad(state: VehicleState) -> float:
    """Return the yaw of a vehicle, from east, counter-clockwise; 0 if it is not known."""
    if state.yaw_rad is not None:
        return state.yaw_rad
    east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    moves = math.hypot(east_m_s, north_m_s) > COURSE_ABOVE_M_S
    return math.atan2(north_m_s, east_m_s) if moves else 0.0
