"""Where things are: WGS-84, and metres around a vehicle's home."""

import math
from typing import NamedTuple

from m2pem import api


class Location(NamedTuple):
    """A place on Earth (WGS-84), its altitude above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float

    @property
    def scaled(self) -> tuple[int, int, int]:
        """In 1e-7 degrees and millimetres, as messages have it."""
        latitude_e7, longitude_e7 = round(self.latitude_deg * 1e7), round(self.longitude_deg * 1e7)
        return latitude_e7, longitude_e7, round(self.altitude_amsl_m * 1e3)


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
    """Metres north, east and up of an origin, over flat ground."""

    def __init__(self, origin: Location) -> None:
        self.origin = origin
        self._frame = api.LocalFrame(origin)

    def to_point(self, location: Location) -> Point:
        """From WGS-84."""
        east_m, north_m = self._frame.to_local((location.latitude_deg, location.longitude_deg))
        return Point(north_m, east_m, location.altitude_amsl_m - self.origin.altitude_amsl_m)

    def to_location(self, point: Point) -> Location:
        """To WGS-84."""
        latitude_deg, longitude_deg = self._frame.to_latlon((point.east_m, point.north_m))
        return Location(latitude_deg, longitude_deg, self.origin.altitude_amsl_m + point.up_m)


def wrapped_rad(angle_rad: float) -> float:
    """The same direction, from -pi to pi."""
    return math.remainder(angle_rad, math.tau)


def towards(value: float, target: float, step: float) -> float:
    """`value`, nearer to `target` by at most `step`."""
    return value + max(-step, min(step, target - value))
