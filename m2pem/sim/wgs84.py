"""Latitude, longitude and height on the WGS-84 ellipsoid, and Cartesian places in the Earth.

Cartesian places are "Earth-centred, Earth-fixed": metres from the centre of the Earth, x towards
0 N 0 E, y towards 0 N 90 E, z towards the north pole (NIMA TR8350.2, "Department of Defense World
Geodetic System 1984", 4.3). A library would do the same, and take longer to load than all the rest.
"""

import math

_SEMI_MAJOR_M = 6_378_137.0
_FLATTENING = 1 / 298.257_223_563
_SEMI_MINOR_M = _SEMI_MAJOR_M * (1 - _FLATTENING)
_E2 = _FLATTENING * (2 - _FLATTENING)
_SECOND_E2 = _E2 / (1 - _E2)


def cartesian(
    latitude_deg: float, longitude_deg: float, height_m: float
) -> tuple[float, float, float]:
    """The Cartesian place of a geodetic one."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sine = math.sin(latitude)
    normal = _SEMI_MAJOR_M / math.sqrt(1 - _E2 * sine * sine)
    from_axis = (normal + height_m) * math.cos(latitude)
    return (
        from_axis * math.cos(longitude),
        from_axis * math.sin(longitude),
        (normal * (1 - _E2) + height_m) * sine,
    )


def geodetic(x: float, y: float, z: float) -> tuple[float, float]:
    """Latitude and longitude in degrees of a Cartesian place near the ground.

    Bowring's formula ("Transformation from spatial to geographical coordinates", Survey Review 181,
    1976); its error is far below a millimetre up to the heights that aircraft reach.
    """
    from_axis = math.hypot(x, y)
    reduced = math.atan2(z * _SEMI_MAJOR_M, from_axis * _SEMI_MINOR_M)
    latitude = math.atan2(
        z + _SECOND_E2 * _SEMI_MINOR_M * math.sin(reduced) ** 3,
        from_axis - _E2 * _SEMI_MAJOR_M * math.cos(reduced) ** 3,
    )
    return math.degrees(latitude), math.degrees(math.atan2(y, x))
