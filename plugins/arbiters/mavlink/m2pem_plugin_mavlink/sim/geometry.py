"""Where things are: WGS-84, and metres around a vehicle's home.

As an autopilot does, latitude and longitude are scaled to metres at the home, so that going there
and back again loses nothing; over some kilometres that differs from the geodesic by centimetres.
"""

import math
from typing import NamedTuple

from pymap3d.rcurve import meridian, transverse


class Location(NamedTuple):
    """A place on Earth (WGS-84), its altitude above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


class Point(NamedTuple):
    """A place in metres from the origin of a `LocalFrame`, axes north, east, up."""

    north_m: float
    east_m: float
    up_m: float

    def distance_m(self, other: "Point") -> float:
        """Over the ground."""
        return math.hypot(other.north_m - self.north_m, other.east_m - self.east_m)

    def bearing_rad(self, other: "Point") -> float:
        """Towards the other, from north, clockwise."""
        return math.atan2(other.east_m - self.east_m, other.north_m - self.north_m)

    def moved(self, bearing_rad: float, distance_m: float) -> "Point":
        """The point that lies so far in that direction, at the same height."""
        return Point(
            self.north_m + distance_m * math.cos(bearing_rad),
            self.east_m + distance_m * math.sin(bearing_rad),
            self.up_m,
        )

    def at_height(self, up_m: float) -> "Point":
        """The point above or below."""
        return Point(self.north_m, self.east_m, up_m)


class LocalFrame:
    """Metres north, east and up of an origin."""

    def __init__(self, origin: Location) -> None:
        self.origin = origin
        self._north_m_per_deg = math.radians(float(meridian(origin.latitude_deg)))
        self._east_m_per_deg = math.radians(
            float(transverse(origin.latitude_deg)) * math.cos(math.radians(origin.latitude_deg))
        )

    def to_point(self, location: Location) -> Point:
        """From WGS-84."""
        east_deg = (location.longitude_deg - self.origin.longitude_deg + 180.0) % 360.0 - 180.0
        return Point(
            (location.latitude_deg - self.origin.latitude_deg) * self._north_m_per_deg,
            east_deg * self._east_m_per_deg,
            location.altitude_amsl_m - self.origin.altitude_amsl_m,
        )

    def to_location(self, point: Point) -> Location:
        """To WGS-84."""
        longitude_deg = self.origin.longitude_deg + point.east_m / self._east_m_per_deg
        return Location(
            self.origin.latitude_deg + point.north_m / self._north_m_per_deg,
            (longitude_deg + 180.0) % 360.0 - 180.0,
            self.origin.altitude_amsl_m + point.up_m,
        )


def wrapped_rad(angle_rad: float) -> float:
    """The same direction, from -pi to pi."""
    return math.remainder(angle_rad, math.tau)


def towards(value: float, target: float, step: float) -> float:
    """`value`, nearer to `target` by at most `step`."""
    return value + max(-step, min(step, target - value))
