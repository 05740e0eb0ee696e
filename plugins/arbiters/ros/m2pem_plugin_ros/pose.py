"""Poses and twists in the local frame of the fleet: ENU at the fleet's origin.

That is the frame `map` of ROS (REP-105) for all vehicles of a fleet. x is east, y is north, yaw is
from east, counter-clockwise (REP-103).
"""

from dataclasses import dataclass


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
