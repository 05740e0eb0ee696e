"""Conversions between WGS-84 and the frame of a vehicle's map (VDA 5050, section 6.7).

The map is a plane. Its x axis is turned counter-clockwise from east by the rotation.
"""

import math
from typing import NamedTuple

from m2pem.api import GeoPosition, LatLon, LocalFrame


class MapPoint(NamedTuple):
    """In metres."""

    x: float
    y: float


def wrapped(angle_rad: float) -> float:
    """Return the same direction, from -pi to pi."""
    return math.remainder(angle_rad, math.tau)


class MapFrame:
    """`origin`: of the map, as latitude, longitude (degrees) and altitude (m)."""

    def __init__(self, origin: tuple[float, float, float], rotation_rad: float) -> None:
        self._frame = LocalFrame(origin)
        self._altitude_m = origin[2]
        self._rotation_rad = rotation_rad
        self._cos, self._sin = math.cos(rotation_rad), math.sin(rotation_rad)

    def to_map(self, place: LatLon) -> MapPoint:
        """Return a place in the frame of the map."""
        east, north = self._frame.to_local(place)
        return MapPoint(self._cos * east + self._sin * north, self._cos * north - self._sin * east)

    def to_position(self, x: float, y: float) -> GeoPosition:
        """Return the position at a point of the map, at the altitude of its origin."""
        place = self._frame.to_latlon(self.to_enu(x, y))
        return GeoPosition(*place, self._altitude_m)

    def to_enu(self, x: float, y: float) -> tuple[float, float]:
        """Return a vector of the map as east and north."""
        return self._cos * x - self._sin * y, self._sin * x + self._cos * y

    def to_yaw(self, theta_rad: float) -> float:
        """Return a direction of the map from east, counter-clockwise."""
        return wrapped(theta_rad + self._rotation_rad)

    def to_theta(self, heading_rad: float) -> float:
        """Return a heading (from true north, clockwise) as a direction of the map."""
        return wrapped(math.pi / 2 - heading_rad - self._rotation_rad)
