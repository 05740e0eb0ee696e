"""How far a position is from the fleet's origin: a swapped latitude and longitude shows there."""

import math
from collections.abc import Iterator
from typing import TypeAlias

from m2pem.mission.geometry import Area, Coordinate, Geometry, Point, Route

Origin: TypeAlias = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude in metres above mean sea level."""

NO_ORIGIN: Origin = (0.0, 0.0, 0.0)
"""Of a fleet that gives none."""

MAX_RANGE_M = 500_000.0
"""Farther from the origin its local plane is no longer a picture of the Earth."""

_EARTH_RADIUS_M = 6_371_000.0
_NEAR_M = 10_000.0
_SWAPPED_IS_NEARER = 20.0
"""A position this many times as far from the origin as its mirror image is taken as swapped."""


def distance_m(a: tuple[float, float], b: tuple[float, float]) -> float:
    """The great-circle distance of two places (latitude, longitude in degrees), in metres."""
    lat_a, lat_b = math.radians(a[0]), math.radians(b[0])
    half_lat, half_lon = (lat_b - lat_a) / 2, math.radians(b[1] - a[1]) / 2
    part = math.sin(half_lat) ** 2 + math.cos(lat_a) * math.cos(lat_b) * math.sin(half_lon) ** 2
    return 2 * _EARTH_RADIUS_M * math.asin(min(1.0, math.sqrt(part)))


def out_of_reach(place: Coordinate, origin: Origin) -> tuple[str, str] | None:
    """What is wrong with a place too far from the fleet's origin, and a remedy; None: nothing."""
    latitude, longitude, _ = place
    centre = origin[:2]
    away_m = distance_m((latitude, longitude), centre)
    swapped_m = math.inf if abs(longitude) > 90 else distance_m((longitude, latitude), centre)
    swapped = away_m > _NEAR_M and swapped_m * _SWAPPED_IS_NEARER < away_m
    if away_m <= MAX_RANGE_M and not swapped:
        return None
    message = (
        f"latitude {latitude:.9g}, longitude {longitude:.9g} is {_km(away_m)} from "
        f"the fleet's origin [{centre[0]:.9g}, {centre[1]:.9g}]"
    )
    if swapped:
        return (
            message,
            f"are latitude and longitude swapped? The other way round it is {_km(swapped_m)} away",
        )
    limit = f"positions must be within {_km(MAX_RANGE_M)}"
    return message, f"{limit}: correct it, or set the fleet's `origin` near its vehicles"


def geometry_out_of_reach(geometry: Geometry, origin: Origin) -> tuple[str, str] | None:
    """As `out_of_reach`, for the first position of a geometry that is too far away."""
    for name, place in _places(geometry):
        if wrong := out_of_reach(place, origin):
            return f"{name}{wrong[0]}", wrong[1]
    return None


def _places(geometry: Geometry) -> Iterator[tuple[str, Coordinate]]:
    if isinstance(geometry, Point):
        yield "", geometry.position
    elif isinstance(geometry, Route):
        yield from ((f"waypoint {n}: ", each) for n, each in enumerate(geometry.waypoints, 1))
    elif isinstance(geometry, Area):
        for ring in geometry.rings:
            yield from ((f"corner {n}: ", each) for n, each in enumerate(ring, 1))


def _km(metres: float) -> str:
    return f"{metres / 1000:.0f} km" if metres >= 10_000 else f"{metres / 1000:.1f} km"
