"""Between WGS-84 and the plane in which simulated vehicles move.

East and north are of the ENU frame at the fleet's origin; `up` is the difference of altitudes. The
ground is flat: below a plane that touches the Earth, "up" of ENU would sink by 8 m at 10 km.
"""

import math

from m2pem.api.telemetry import GeoPosition
from m2pem.sim.phases import Vector
from m2pem.sim.wgs84 import cartesian, geodetic

MAX_RANGE_M = 500_000.0
"""Farther from the origin the plane is no longer a picture of the Earth."""

_MEAN_RADIUS_M = 6_371_000.0


class Frame:
    """The local frame at `origin`: latitude and longitude in degrees, altitude in metres."""

    def __init__(self, origin: tuple[float, float, float]) -> None:
        self.origin = origin
        self._center = cartesian(*origin)
        latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
        self._sin_latitude, self._cos_latitude = math.sin(latitude), math.cos(latitude)
        self._sin_longitude, self._cos_longitude = math.sin(longitude), math.cos(longitude)

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres.

        Raises:
            ValueError: it is too far from the origin to be simulated.
        """
        if not (math.isfinite(latitude_deg) and math.isfinite(longitude_deg)):
            raise ValueError(f"[{latitude_deg}, {longitude_deg}] is no position")
        east, north, up = self._turned(cartesian(latitude_deg, longitude_deg, self.origin[2]))
        distance = math.hypot(east, north, up)
        if distance > MAX_RANGE_M:
            raise ValueError(
                f"[{latitude_deg}, {longitude_deg}] is {distance / 1000:.0f} km from the fleet's "
                f"origin [{self.origin[0]}, {self.origin[1]}]; the simulation reaches "
                f"{MAX_RANGE_M / 1000:.0f} km: set the fleet's `origin` near the vehicles"
            )
        return east, north

    def geo(self, place: Vector) -> GeoPosition:
        """The WGS-84 position of a place."""
        east, north, up = place
        sunk = -(east * east + north * north) / (2 * _MEAN_RADIUS_M)
        latitude, longitude = geodetic(*self._turned_back(east, north, sunk))
        return GeoPosition(latitude, longitude, self.origin[2] + up)

    def _turned(self, place: Vector) -> Vector:
        """East, north and up of the origin, of a place in the Earth."""
        x, y, z = (there - here for there, here in zip(place, self._center, strict=True))
        outwards = self._cos_longitude * x + self._sin_longitude * y
        return (
            self._cos_longitude * y - self._sin_longitude * x,
            self._cos_latitude * z - self._sin_latitude * outwards,
            self._sin_latitude * z + self._cos_latitude * outwards,
        )

    def _turned_back(self, east: float, north: float, up: float) -> Vector:
        """The place in the Earth."""
        x, y, z = self._center
        outwards = self._cos_latitude * up - self._sin_latitude * north
        return (
            x + self._cos_longitude * outwards - self._sin_longitude * east,
            y + self._sin_longitude * outwards + self._cos_longitude * east,
            z + self._sin_latitude * up + self._cos_latitude * north,
        )
