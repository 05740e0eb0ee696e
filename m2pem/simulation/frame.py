"""Between WGS-84 and the plane in which simulated vehicles move.

East and north are of the ENU frame at the fleet's origin; `up` is the difference of altitudes. The
ground is flat: below a plane that touches the Earth, "up" of ENU would sink by 8 m at 10 km.

Plain arithmetic of single places: a team looks at each of its members four times a second, also
in a rehearsal of hours, and an array library takes some twenty times as long for one place.
"""

import math

from m2pem.api.telemetry import GeoPosition
from m2pem.fleet.distance import MAX_RANGE_M
from m2pem.simulation.phases import Vector

_MEAN_RADIUS_M = 6_371_000.0
_SEMI_MAJOR_M = 6_378_137.0
_FLATTENING = 1 / 298.257223563
_ECCENTRICITY2 = _FLATTENING * (2 - _FLATTENING)

_CLOSE_ENOUGH_RAD = 1e-14
_ROUNDS = 10
"""Each makes the latitude some hundred times more exact; three do near the ground."""


class Frame:
    """The local frame at `origin`: latitude and longitude in degrees, altitude in metres."""

    def __init__(self, origin: tuple[float, float, float]) -> None:
        self.origin = origin
        latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
        self._centre = _geocentric(*origin)
        self._latitude = math.cos(latitude), math.sin(latitude)
        self._longitude = math.cos(longitude), math.sin(longitude)

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres.

        Raises:
            ValueError: it is too far from the origin to be simulated.
        """
        if not (math.isfinite(latitude_deg) and math.isfinite(longitude_deg)):
            raise ValueError(f"[{latitude_deg}, {longitude_deg}] is no position")
        place = _geocentric(latitude_deg, longitude_deg, self.origin[2])
        x, y, z = (there - here for there, here in zip(place, self._centre, strict=True))
        (cos_lat, sin_lat), (cos_lon, sin_lon) = self._latitude, self._longitude
        outwards = cos_lon * x + sin_lon * y
        east = cos_lon * y - sin_lon * x
        north = cos_lat * z - sin_lat * outwards
        distance = math.hypot(x, y, z)
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
        (cos_lat, sin_lat), (cos_lon, sin_lon) = self._latitude, self._longitude
        outwards = cos_lat * sunk - sin_lat * north
        latitude_deg, longitude_deg = _geodetic(
            self._centre[0] + cos_lon * outwards - sin_lon * east,
            self._centre[1] + sin_lon * outwards + cos_lon * east,
            self._centre[2] + sin_lat * sunk + cos_lat * north,
        )
        return GeoPosition(latitude_deg, longitude_deg, self.origin[2] + up)


def _geocentric(
    latitude_deg: float, longitude_deg: float, altitude_m: float
) -> tuple[float, float, float]:
    """From the Earth's centre, in metres."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sin = math.sin(latitude)
    normal_m = _SEMI_MAJOR_M / math.sqrt(1 - _ECCENTRICITY2 * sin * sin)
    aside_m = (normal_m + altitude_m) * math.cos(latitude)
    return (
        aside_m * math.cos(longitude),
        aside_m * math.sin(longitude),
        (normal_m * (1 - _ECCENTRICITY2) + altitude_m) * sin,
    )


def _geodetic(x: float, y: float, z: float) -> tuple[float, float]:
    """Latitude and longitude in degrees of a place near the ground, from the Earth's centre."""
    aside_m = math.hypot(x, y)
    latitude = math.atan2(z, aside_m * (1 - _ECCENTRICITY2))
    for _ in range(_ROUNDS):
        sin = math.sin(latitude)
        normal_m = _SEMI_MAJOR_M / math.sqrt(1 - _ECCENTRICITY2 * sin * sin)
        found = math.atan2(z + _ECCENTRICITY2 * normal_m * sin, aside_m)
        if abs(found - latitude) < _CLOSE_ENOUGH_RAD:
            return math.degrees(found), math.degrees(math.atan2(y, x))
        latitude = found
    return math.degrees(latitude), math.degrees(math.atan2(y, x))
