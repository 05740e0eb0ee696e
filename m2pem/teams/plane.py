"""Between WGS-84 and a level plane around the place where a team works."""

import math

_SEMI_MAJOR_M = 6_378_137.0
_ECCENTRICITY2 = 6.694379990141e-3

MAX_RANGE_M = 100_000.0
"""Farther from its origin the plane is no picture of the Earth."""


class Plane:
    """East and north in metres of a place in degrees. Exact there, and to 1 % within 100 km."""

    def __init__(self, latitude_deg: float, longitude_deg: float) -> None:
        self._latitude_deg = latitude_deg
        self._longitude_deg = longitude_deg
        sin2 = math.sin(math.radians(latitude_deg)) ** 2
        bent = 1 - _ECCENTRICITY2 * sin2
        meridian_m = _SEMI_MAJOR_M * (1 - _ECCENTRICITY2) / bent**1.5
        normal_m = _SEMI_MAJOR_M / math.sqrt(bent)
        self._north_m_per_deg = math.radians(meridian_m)
        self._east_m_per_deg = math.radians(
            normal_m * max(1e-6, math.cos(math.radians(latitude_deg)))
        )

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres."""
        turn = math.remainder(longitude_deg - self._longitude_deg, 360.0)
        north = (latitude_deg - self._latitude_deg) * self._north_m_per_deg
        return turn * self._east_m_per_deg, north

    def geo(self, east_m: float, north_m: float) -> tuple[float, float]:
        """Latitude and longitude of a place, in degrees."""
        longitude = self._longitude_deg + east_m / self._east_m_per_deg
        latitude = self._latitude_deg + north_m / self._north_m_per_deg
        return latitude, math.remainder(longitude, 360.0)
