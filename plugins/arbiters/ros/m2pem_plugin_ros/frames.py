"""Between WGS-84 and the fleet's local frame: ENU (REP-103) at the fleet's origin, `map` in ROS.

As everywhere in m2pem, heights above mean sea level and above the ellipsoid are not told apart.
"""

import math
from typing import NamedTuple, Protocol

from m2pem.api import GeoPosition, LocalFrame

Origin = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude in metres."""


class Quaternion(NamedTuple):
    """A rotation, in the order of ROS."""

    x: float
    y: float
    z: float
    w: float


class AnyQuaternion(Protocol):
    """Ours, or geometry_msgs/Quaternion."""

    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def z(self) -> float: ...
    @property
    def w(self) -> float: ...


def to_local(position: GeoPosition, origin: Origin) -> tuple[float, float, float]:
    """East, north and up of the origin, in metres."""
    return LocalFrame(origin).to_enu(
        position.latitude_deg, position.longitude_deg, position.altitude_m
    )


def to_geodetic(east_m: float, north_m: float, up_m: float, origin: Origin) -> GeoPosition:
    """The position that is so far east, north and up of the origin."""
    return GeoPosition(*LocalFrame(origin).from_enu(east_m, north_m, up_m))


def yaw_of_quaternion(q: AnyQuaternion) -> float:
    """From east, counter-clockwise, in -pi..pi. Its length does not matter.

    Raises:
        ValueError: it is no rotation: zero, or not finite.
    """
    square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not (1e-6 < square < math.inf):
        raise ValueError(f"({q.x:g}, {q.y:g}, {q.z:g}, {q.w:g}) is no rotation")
    sine, cosine = 2.0 * (q.w * q.z + q.x * q.y), square - 2.0 * (q.y * q.y + q.z * q.z)
    return math.atan2(sine, cosine)


def quaternion_of_yaw(yaw_rad: float) -> Quaternion:
    """A rotation about the vertical alone."""
    return Quaternion(0.0, 0.0, math.sin(yaw_rad / 2.0), math.cos(yaw_rad / 2.0))
