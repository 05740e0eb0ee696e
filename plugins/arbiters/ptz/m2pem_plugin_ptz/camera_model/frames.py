"""Rotations between the frames of a camera, its vehicle and the Earth.

Vectors and matrices are of NumPy, in metres or unit vectors. ECEF: of the Earth (WGS-84). ENU:
east, north, up at a position. Deck: forward, left, up of a vehicle (REP-103). The camera model
converts arrays of thousands of points by pymap3d, and single points by `m2pem.api.LocalFrame`, on
the same ellipsoid.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from m2pem.api import GeoPosition, LocalFrame

Vector: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]


EQUATOR_M = 6_378_137.0
POLE_M = 6_356_752.314245179
"""The axes of the ellipsoid."""

_SHRUNK = (POLE_M / EQUATOR_M) ** 2

_EARTH = LocalFrame((0.0, 0.0, -EQUATOR_M))
"""The frame at the centre of the Earth: up, east and north are the axes of ECEF."""


def ecef(position: GeoPosition) -> Vector:
    """Return a position in ECEF. Its altitude is taken as above the ellipsoid: within the view of a
    camera, only differences count."""
    y, z, x = _EARTH.to_enu(position.latitude_deg, position.longitude_deg, position.altitude_m)
    return np.array([x, y, z])


def geodetic(place: Vector) -> GeoPosition:
    """Return the position of a point in ECEF."""
    x, y, z = place.tolist()
    return GeoPosition(*_EARTH.from_enu(y, z, x))


def up_and_heights_m(places: Vector) -> tuple[Vector, Vector]:
    """Return the directions up (unit vectors of ECEF) and the heights above the ellipsoid of points
    in ECEF, one in each row.

    By Bowring's formula, which is exact to a micrometre up to 10 km from the ellipsoid. It needs no
    angles: a fifth of the time of a conversion to latitudes.
    """
    x, y, z = places.T
    aside = np.maximum(np.hypot(x, y), 1e-9)
    sin, cos = z * EQUATOR_M, aside * POLE_M
    length = np.hypot(sin, cos)
    sin, cos = sin / length, cos / length
    rise = z + (1 / _SHRUNK - 1) * POLE_M * sin**3
    run = aside - (1 - _SHRUNK) * EQUATOR_M * cos**3
    length = np.hypot(rise, run)
    sin, cos = rise / length, run / length
    heights_m = aside * cos + z * sin - EQUATOR_M * np.sqrt(1 - (1 - _SHRUNK) * sin**2)
    return np.column_stack((cos / aside * x, cos / aside * y, sin)), heights_m


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
    return np.array(
        [
            [
                cos_y * cos_p,
                cos_y * sin_p * sin_r - sin_y * cos_r,
                cos_y * sin_p * cos_r + sin_y * sin_r,
            ],
            [
                sin_y * cos_p,
                sin_y * sin_p * sin_r + cos_y * cos_r,
                sin_y * sin_p * cos_r - cos_y * sin_r,
            ],
            [-sin_p, cos_p * sin_r, cos_p * cos_r],
        ]
    )


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
    (bearing, tilt), (other_bearing, other_tilt) = first, second
    haversine = (
        math.sin((other_tilt - tilt) / 2) ** 2
        + math.cos(tilt) * math.cos(other_tilt) * math.sin((other_bearing - bearing) / 2) ** 2
    )
    return 2 * math.atan2(math.sqrt(haversine), math.sqrt(max(1.0 - haversine, 0.0)))
