"""The plane that touches the Earth at a place: metres instead of degrees, for some kilometres."""

import math
from typing import TypeAlias

import pymap3d

Level: TypeAlias = tuple[float, float]
"""East and north, in metres."""

LatLon: TypeAlias = tuple[float, float]
"""Latitude and longitude in WGS-84 degrees."""


class Plane:
    """The plane at a latitude and longitude, in degrees."""

    def __init__(self, touches: LatLon) -> None:
        self.touches = touches

    def level(self, place: LatLon) -> Level:
        """Where a place is on the plane."""
        east, north, _ = pymap3d.geodetic2enu(*place, 0.0, *self.touches, 0.0)
        return float(east), float(north)

    def place(self, level: Level) -> LatLon:
        """What is at a point of the plane."""
        latitude, longitude, _ = pymap3d.enu2geodetic(*level, 0.0, *self.touches, 0.0)
        return float(latitude), float(longitude)


def distance_m(a: LatLon, b: LatLon) -> float:
    """Over ground, between places some kilometres apart."""
    return math.hypot(*Plane(a).level(b))


def offset(place: LatLon, east_m: float, north_m: float) -> LatLon:
    """The place so far from another."""
    return Plane(place).place((east_m, north_m))
