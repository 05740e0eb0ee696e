"""The plane in which a base is driven: places in metres, angles in radians."""

import math
from typing import TypeAlias

from m2pem_plugin_ros.pose import Pose, Twist

Place: TypeAlias = tuple[float, float]
"""East and north, in metres, of the fleet's local frame."""


def turned(from_rad: float, to_rad: float) -> float:
    """The short way from one direction to another: positive is counter-clockwise."""
    return math.remainder(to_rad - from_rad, math.tau)


def place_of(pose: Pose) -> Place:
    """Where a pose is."""
    return pose.east_m, pose.north_m


def beyond(place: Place, yaw_rad: float, distance_m: float) -> Place:
    """The place so far away in a direction."""
    return (
        place[0] + distance_m * math.cos(yaw_rad),
        place[1] + distance_m * math.sin(yaw_rad),
    )


def yaw_towards(start: Place, end: Place) -> float:
    """The direction in which `end` lies."""
    return math.atan2(end[1] - start[1], end[0] - start[0])


FARTHEST_M = 1e6
FASTEST = 1e3
"""What is farther from the origin, or faster in m/s or rad/s, is no pose or twist of a base."""


def sane_pose(pose: Pose | None) -> Pose | None:
    """The pose, unless something in it is no number, or none that can be."""
    if pose is None or not math.isfinite(pose.yaw_rad):
        return None
    return pose if _within(FARTHEST_M, pose.east_m, pose.north_m) else None


def sane_twist(twist: Twist | None) -> Twist | None:
    """The twist, unless something in it is no number, or none that can be."""
    if twist is None or not _within(FASTEST, twist.forward_m_s, twist.yaw_rad_s):
        return None
    return twist


def _within(bound: float, *numbers: float) -> bool:
    return all(-bound <= number <= bound for number in numbers)  # not if it is no number
