"""Conversions between WGS-84 and the fleet's local frame: ENU (REP-103) at the fleet's origin,
`map` in ROS. Altitudes are above mean sea level; messages whose definition has heights above the
ellipsoid (NavSatFix, geographic_msgs) are converted where they come in and go out.
"""

import math
from functools import lru_cache
from typing import NamedTuple, Protocol

from m2pem.api import GeoPosition, LocalFrame, ellipsoidal_m, mean_sea_level_m

Origin = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude in metres above mean sea level."""


class Quaternion(NamedTuple):
    """A rotation, in the order of ROS."""

    x: float
    y: float
    z: float
    w: float


Vector = tuple[float, float, float]


class AnyQuaternion(Protocol):
    """The interface of a `Quaternion` and of geometry_msgs/Quaternion."""

    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def z(self) -> float: ...
    @property
    def w(self) -> float: ...


def to_local(position: GeoPosition, origin: Origin) -> tuple[float, float, float]:
    """Return a position as metres east, north and up of the origin."""
    height_m = ellipsoidal_m(*position.latlon, position.altitude_m)
    return _frame(origin).to_enu(*position.latlon, height_m)


def to_geodetic(east_m: float, north_m: float, up_m: float, origin: Origin) -> GeoPosition:
    """Return the position at metres east, north and up of the origin."""
    latitude_deg, longitude_deg, height_m = _frame(origin).from_enu(east_m, north_m, up_m)
    altitude_m = mean_sea_level_m(latitude_deg, longitude_deg, height_m)
    return GeoPosition(latitude_deg, longitude_deg, altitude_m)


@lru_cache(maxsize=16)
def _frame(origin: Origin) -> LocalFrame:
    """Return the frame at the origin's height above the ellipsoid, as `earth` in tf has it."""
    return LocalFrame((*origin[:2], ellipsoidal_m(*origin)))


def yaw_of_quaternion(q: AnyQuaternion) -> float:
    """Return the yaw of a quaternion of any length, from east, counter-clockwise, in -pi..pi.

    Raises:
        ValueError: the quaternion is zero or not finite.
    """
    square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not (1e-6 < square < math.inf):
        raise ValueError(f"({q.x:g}, {q.y:g}, {q.z:g}, {q.w:g}) is not a rotation")
    sine, cosine = 2.0 * (q.w * q.z + q.x * q.y), square - 2.0 * (q.y * q.y + q.z * q.z)
    return math.atan2(sine, cosine)


def quaternion_of_yaw(yaw_rad: float) -> Quaternion:
    """Return the quaternion of a yaw."""
    return Quaternion(0.0, 0.0, math.sin(yaw_rad / 2.0), math.cos(yaw_rad / 2.0))


def rotated(place: Vector, q: Quaternion) -> Vector:
    """Return a place turned by a quaternion of length 1."""
    x, y, z = place
    # Twice the vector product of the quaternion's axis and the place.
    tx, ty, tz = 2.0 * (q.y * z - q.z * y), 2.0 * (q.z * x - q.x * z), 2.0 * (q.x * y - q.y * x)
    return (
        x + q.w * tx + q.y * tz - q.z * ty,
        y + q.w * ty + q.z * tx - q.x * tz,
        z + q.w * tz + q.x * ty - q.y * tx,
    )


def quaternion_of(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Return the rotation from the frame of a vehicle (x forward, y left, z up) to ENU.

    Roll is about x, pitch about y (positive: nose down), yaw about z, from east.
    """
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return Quaternion(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def rotated_back(vector: Vector, q: Quaternion) -> Vector:
    """Return a vector of ENU in the frame of a vehicle whose rotation is `q`."""
    return rotated(vector, Quaternion(-q.x, -q.y, -q.z, q.w))


def earth_from_enu(latitude_deg: float, longitude_deg: float) -> Quaternion:
    """Return the rotation from ENU at a place to the axes of the Earth (ECEF)."""
    about_z = (math.radians(longitude_deg) + math.pi / 2) / 2
    about_x = (math.pi / 2 - math.radians(latitude_deg)) / 2
    cz, sz = math.cos(about_z), math.sin(about_z)
    cx, sx = math.cos(about_x), math.sin(about_x)
    return Quaternion(cz * sx, sz * sx, sz * cx, cz * cx)
