"""Rotations between the frames of a camera, its vehicle and the Earth.

Vectors and matrices are of NumPy, in metres or unit vectors. ECEF: of the Earth (WGS-84). ENU:
east, north, up at a position. Deck: forward, left, up of a vehicle (REP-103). The camera model
converts arrays of thousands of points, by pymap3d, on the ellipsoid of `m2pem.api.LocalFrame`.
"""

import math
from typing import TypeAlias

import numpy as np
import pymap3d
from numpy.typing import NDArray

from m2pem.api import GeoPosition

Vector: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]


def ecef(position: GeoPosition) -> Vector:
    """Return a position in ECEF. The altitude counts from the ellipsoid."""
    return np.array(
        pymap3d.geodetic2ecef(position.latitude_deg, position.longitude_deg, position.altitude_m),
        dtype=float,
    )


def geodetic(place: Vector) -> GeoPosition:
    """Return the position of a point in ECEF."""
    latitude, longitude, altitude = pymap3d.ecef2geodetic(*(float(part) for part in place))
    return GeoPosition(float(latitude), float(longitude), float(altitude))


def enu_of_ecef(position: GeoPosition) -> Matrix:
    """Return the rotation from ECEF to ENU at a position."""
    latitude, longitude = math.radians(position.latitude_deg), math.radians(position.longitude_deg)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lon, cos_lon = math.sin(longitude), math.cos(longitude)
    return np.array(
        [
            [-sin_lon, cos_lon, 0.0],
            [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        ]
    )


def enu_of_deck(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Matrix:
    """Return the rotation from the deck to ENU.

    Angles as in `VehicleState`: positive roll is right side down, positive pitch is nose down;
    yaw is from east, counter-clockwise.
    """
    sin_r, cos_r = math.sin(roll_rad), math.cos(roll_rad)
    sin_p, cos_p = math.sin(pitch_rad), math.cos(pitch_rad)
    sin_y, cos_y = math.sin(yaw_rad), math.cos(yaw_rad)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, cos_r, -sin_r], [0.0, sin_r, cos_r]])
    pitch = np.array([[cos_p, 0.0, sin_p], [0.0, 1.0, 0.0], [-sin_p, 0.0, cos_p]])
    yaw = np.array([[cos_y, -sin_y, 0.0], [sin_y, cos_y, 0.0], [0.0, 0.0, 1.0]])
    turned: Matrix = yaw @ pitch @ roll
    return turned


def deck_vector(bearing_rad: float, tilt_rad: float) -> Vector:
    """Return the unit vector, in the deck frame, of a bearing clockwise from ahead and a tilt."""
    level = math.cos(tilt_rad)
    return np.array(
        [level * math.cos(bearing_rad), -level * math.sin(bearing_rad), math.sin(tilt_rad)]
    )


def deck_angles(vector: Vector) -> tuple[float, float]:
    """Return bearing (clockwise from ahead) and tilt (upwards) of a vector in the deck frame."""
    forward, left, up = (float(part) for part in vector)
    level = math.hypot(forward, left)
    # Straight up and down every bearing is as good.
    bearing = math.atan2(-left, forward) if level > 1e-12 else 0.0
    return bearing, math.atan2(up, level)


def enu_vector(heading_rad: float, elevation_rad: float) -> Vector:
    """Return the unit vector in ENU of a heading from north, clockwise, and an elevation."""
    level = math.cos(elevation_rad)
    return np.array(
        [level * math.sin(heading_rad), level * math.cos(heading_rad), math.sin(elevation_rad)]
    )


def enu_angles(vector: Vector) -> tuple[float, float]:
    """Return heading from north, clockwise, and elevation of a vector in ENU."""
    east, north, up = (float(part) for part in vector)
    level = math.hypot(east, north)
    heading = math.atan2(east, north) if level > 1e-12 else 0.0
    return heading, math.atan2(up, level)


def angle_between(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the angle between two directions, each of a bearing and a tilt."""
    a, b = deck_vector(*first), deck_vector(*second)
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(np.dot(a, b)))
