"""Positions and the fleet's origin: what is too far from it, and positions in metres from it.

A position that is too far away has most often its latitude and longitude swapped.
"""

import json
import math
from collections.abc import Iterator

from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import LocalFrame, Origin, distance_m
from m2pem.mission.geometry import Area, Coordinate, Geometry, Point, Route

NO_ORIGIN: Origin = (0.0, 0.0, 0.0)
"""Of a fleet that gives none."""

MAX_RANGE_M = 500_000.0
"""Farther from the origin than this its local frame is not used."""

FARTHEST_ENU_M = 1_000_000.0
"""The largest number that a local position may hold."""

_ENU = "enu"
_NEAR_M = 10_000.0
_SWAPPED_IS_NEARER = 20.0
"""A position this many times as far from the origin as its mirror image is taken as swapped."""


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


def positions(geometry: Geometry) -> Iterator[Coordinate]:
    """Yield the positions of a geometry in order; the present one of a vehicle is not known."""
    for _, place in _places(geometry):
        yield place


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


def is_local(text: str) -> bool:
    """Whether it is meant as a local position."""
    start = text.strip()
    return start.startswith(_ENU) and start[len(_ENU) :].lstrip().startswith("[")


def local_point(text: str, origin: Origin) -> Point:
    """The position on Earth; with `up` its altitude is above mean sea level, without it not given.

    Raises:
        GeometryError: not two or three finite numbers, or too far away.
    """
    try:
        metres = json.loads(text.strip()[len(_ENU) :])
    except (ValueError, RecursionError):
        metres = None
    if not isinstance(metres, list) or not 2 <= len(metres) <= 3:
        raise GeometryError(f"{text!r} is not a local position")
    for number in metres:
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise GeometryError(f"{text!r}: {number!r} is not a number of metres")
        if not math.isfinite(number) or abs(number) > FARTHEST_ENU_M:
            raise GeometryError(f"{text!r}: {number!r} m is not within {FARTHEST_ENU_M:g} m")
    east, north, *up = map(float, metres)
    frame = LocalFrame(origin)
    latitude, longitude, altitude = frame.from_enu(east, north, up[0] if up else 0.0)
    if up:
        return Point((latitude, longitude, altitude), "amsl")
    return Point((latitude, longitude, None))
