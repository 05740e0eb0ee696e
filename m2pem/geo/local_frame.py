"""The local frame: east, north and up in metres (REP-103) of an origin on the WGS-84 ellipsoid.

One accuracy holds for all of m2pem. East, north and up are exact to 1 micrometre. A place on the
ground that goes from metres to degrees and back moves by less than 1 mm within 50 km of the origin,
1 cm within 100 km and 1 m within 500 km. A distance is that of the geodesic to 1 mm within 10 km,
1 cm within 50 km and 2 m within 500 km. Altitudes count from mean sea level, which is taken as
parallel to the ellipsoid: the geoid's slope, mostly below 0.1 m and at most 2 m in 10 km, is left
out.

This is plain arithmetic: a simulation converts single places many thousand times, for which an
array library takes some twenty times as long, and the command line need not load NumPy.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

from m2pem.geo.geoid import ellipsoidal_m

LatLon: TypeAlias = tuple[float, float]
"""Latitude and longitude in WGS-84 degrees."""

EastNorth: TypeAlias = tuple[float, float]
"""East and north of the origin of a local frame, in metres."""

Origin: TypeAlias = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude in metres above mean sea level."""

SEMI_MAJOR_M = 6_378_137.0
"""Of the ellipsoids WGS 84 and GRS 80."""
_MEAN_RADIUS_M = 6_371_008.8
_FLATTENING = 1 / 298.257223563
_ECCENTRICITY2 = _FLATTENING * (2 - _FLATTENING)

_CLOSE_ENOUGH_RAD = 1e-14
_ROUNDS = 10
"""Each makes the latitude some hundred times more exact; three do near the ground."""


class LocalFrame:
    """The plane and the vertical that touch the Earth at `origin`.

    `to_local` and `to_latlon` are for places on the ground, at the altitude of the origin.
    `to_enu` and `from_enu` are for places of any altitude, and `up` then counts from the plane,
    under which the ground sinks by 8 m at a distance of 10 km.

    `origin`: latitude and longitude in degrees, and perhaps the altitude in metres.
    """

    __slots__ = ("_centre", "_cos_lat", "_cos_lon", "_sin_lat", "_sin_lon", "origin")

    def __init__(self, origin: Sequence[float]) -> None:
        altitude_m = origin[2] if len(origin) > 2 else 0.0
        self.origin: Origin = origin[0], origin[1], altitude_m
        latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
        self._centre = _geocentric(*self.origin)
        self._cos_lat, self._sin_lat = math.cos(latitude), math.sin(latitude)
        self._cos_lon, self._sin_lon = math.cos(longitude), math.sin(longitude)

    def to_local(self, place: LatLon) -> EastNorth:
        """Return east and north of a place on the ground.

        A place on the other half of the Earth is not projected: it keeps its direction, at more
        than an Earth radius, so that what is far never seems near.
        """
        east, north, up = self.to_enu(place[0], place[1], self.origin[2])
        if up >= -SEMI_MAJOR_M:
            return east, north
        distance_m = math.hypot(east, north)
        if distance_m == 0.0:
            return 2 * SEMI_MAJOR_M, 0.0
        stretch = (2 * SEMI_MAJOR_M - distance_m) / distance_m
        return east * stretch, north * stretch

    def to_latlon(self, point: EastNorth) -> LatLon:
        """Return the place on the ground at a point of the plane."""
        latitude_deg, longitude_deg, _ = self.from_enu(*point, self._ground_up_m(*point))
        return latitude_deg, longitude_deg

    def to_enu(
        self, latitude_deg: float, longitude_deg: float, altitude_m: float
    ) -> tuple[float, float, float]:
        """Return east, north and up of a position, in metres."""
        x, y, z = _geocentric(latitude_deg, longitude_deg, altitude_m)
        x, y, z = x - self._centre[0], y - self._centre[1], z - self._centre[2]
        outwards = self._cos_lon * x + self._sin_lon * y
        return (
            self._cos_lon * y - self._sin_lon * x,
            self._cos_lat * z - self._sin_lat * outwards,
            self._cos_lat * outwards + self._sin_lat * z,
        )

    def from_enu(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float, float]:
        """Return latitude and longitude in degrees, and altitude in metres, of such a place."""
        outwards = self._cos_lat * up_m - self._sin_lat * north_m
        return _geodetic(
            self._centre[0] + self._cos_lon * outwards - self._sin_lon * east_m,
            self._centre[1] + self._sin_lon * outwards + self._cos_lon * east_m,
            self._centre[2] + self._sin_lat * up_m + self._cos_lat * north_m,
        )

    @property
    def geocentric(self) -> tuple[float, float, float]:
        """The origin as x, y and z from the Earth's centre, in metres (ECEF, EPSG:4978)."""
        return _geocentric(*self.origin[:2], ellipsoidal_m(*self.origin))

    def _ground_up_m(self, east_m: float, north_m: float) -> float:
        """Return how high the ground is there: below 0, as the Earth is round.

        The ellipsoid is taken as a sphere with its radius of curvature in that direction.
        """
        distance2 = east_m * east_m + north_m * north_m
        if distance2 == 0.0:
            return 0.0
        bent = 1 - _ECCENTRICITY2 * self._sin_lat * self._sin_lat
        normal_m = SEMI_MAJOR_M / math.sqrt(bent)
        meridian_m = normal_m * (1 - _ECCENTRICITY2) / bent
        radius_m = distance2 / (east_m * east_m / normal_m + north_m * north_m / meridian_m)
        radius_m += self.origin[2]
        # As radius - sqrt(radius² - distance²), without losing digits.
        return -distance2 / (radius_m + math.sqrt(max(0.0, radius_m * radius_m - distance2)))


def distance_m(a: LatLon, b: LatLon) -> float:
    """Return the distance between two places over the ground; beyond 500 km it is a rough one."""
    chord_m = math.dist(_geocentric(*a, 0.0), _geocentric(*b, 0.0))
    return 2 * _MEAN_RADIUS_M * math.asin(min(1.0, chord_m / (2 * _MEAN_RADIUS_M)))


def offset(place: LatLon, east_m: float, north_m: float) -> LatLon:
    """Return the place that lies so far east and north of another."""
    return LocalFrame(place).to_latlon((east_m, north_m))


def _geocentric(
    latitude_deg: float, longitude_deg: float, altitude_m: float
) -> tuple[float, float, float]:
    """Return x, y and z from the Earth's centre, in metres (ECEF)."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sin = math.sin(latitude)
    normal_m = SEMI_MAJOR_M / math.sqrt(1 - _ECCENTRICITY2 * sin * sin)
    aside_m = (normal_m + altitude_m) * math.cos(latitude)
    return (
        aside_m * math.cos(longitude),
        aside_m * math.sin(longitude),
        (normal_m * (1 - _ECCENTRICITY2) + altitude_m) * sin,
    )


def _geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return latitude and longitude in degrees, and altitude in metres, of a place in ECEF."""
    aside_m = math.hypot(x, y)
    latitude = math.atan2(z, aside_m * (1 - _ECCENTRICITY2))
    for _ in range(_ROUNDS):
        sin = math.sin(latitude)
        normal_m = SEMI_MAJOR_M / math.sqrt(1 - _ECCENTRICITY2 * sin * sin)
        found = math.atan2(z + _ECCENTRICITY2 * normal_m * sin, aside_m)
        done = abs(found - latitude) < _CLOSE_ENOUGH_RAD
        latitude = found
        if done:
            break
    sin = math.sin(latitude)
    bent_m = SEMI_MAJOR_M * math.sqrt(1 - _ECCENTRICITY2 * sin * sin)
    altitude_m = aside_m * math.cos(latitude) + z * sin - bent_m
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), altitude_m
