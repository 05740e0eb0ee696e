"""Between WGS-84 and the plane in which simulated vehicles move.

East and north are of the ENU frame at the fleet's origin; `up` is the difference of altitudes. The
ground is flat: below a plane that touches the Earth, "up" of ENU would sink by 8 m at 10 km.
"""

import math
from collections.abc import Iterable

from m2pem.api.telemetry import GeoPosition
from m2pem.sim.phases import Vector

MAX_RANGE_M = 500_000.0
"""Farther from the origin the plane is no longer a picture of the Earth."""

_MEAN_RADIUS_M = 6_371_000.0
_EQUATOR_M, _ECCENTRICITY_2 = 6_378_137.0, 6.694_379_990_141e-3


class Frame:
    """The local frame at `origin`: latitude and longitude in degrees, altitude in metres."""

    def __init__(self, origin: tuple[float, float, float]) -> None:
        self.origin = origin

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres.

        Raises:
            ValueError: it is too far from the origin to be simulated.
        """
        if not (math.isfinite(latitude_deg) and math.isfinite(longitude_deg)):
            raise ValueError(f"[{latitude_deg}, {longitude_deg}] is no position")
        import pymap3d  # noqa: PLC0415  # it loads NumPy, and not all who simulate move a vehicle

        east, north, up = pymap3d.geodetic2enu(
            latitude_deg, longitude_deg, self.origin[2], *self.origin
        )
        distance = math.hypot(east, north, up)
        if distance > MAX_RANGE_M:
            raise ValueError(
                f"[{latitude_deg}, {longitude_deg}] is {distance / 1000:.0f} km from the fleet's "
                f"origin [{self.origin[0]}, {self.origin[1]}]; the simulation reaches "
                f"{MAX_RANGE_M / 1000:.0f} km: set the fleet's `origin` near the vehicles"
            )
        return float(east), float(north)

    def geo(self, place: Vector) -> GeoPosition:
        """The WGS-84 position of a place."""
        import pymap3d  # noqa: PLC0415

        east, north, up = place
        sunk = -(east * east + north * north) / (2 * _MEAN_RADIUS_M)
        latitude, longitude, _ = pymap3d.enu2geodetic(east, north, sunk, *self.origin)
        return GeoPosition(float(latitude), float(longitude), self.origin[2] + up)

    def geo_near(self, middle: Vector, places: Iterable[Vector]) -> tuple[GeoPosition, ...]:
        """The WGS-84 positions of places that are at most some kilometres from `middle`.

        One `geo` for all of them, and metres of latitude and longitude from there: telemetry has
        many of them. 20 km from the origin they are off by 0.3 % of their distance from `middle`.
        """
        around = self.geo(middle)
        sin = math.sin(math.radians(around.latitude_deg))
        squared = 1 - _ECCENTRICITY_2 * sin * sin
        across_m = _EQUATOR_M / math.sqrt(squared)
        along_m = across_m * (1 - _ECCENTRICITY_2) / squared
        parallel_m = across_m * math.sqrt(1 - sin * sin)
        return tuple(
            GeoPosition(
                around.latitude_deg + math.degrees((north - middle[1]) / along_m),
                around.longitude_deg + math.degrees((east - middle[0]) / parallel_m),
                self.origin[2] + up,
            )
            for east, north, up in places
        )
