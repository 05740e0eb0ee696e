"""Positions in the ENU frame (REP-103) at the fleet's origin: `enu [east, north, up]` in metres."""

import json
import math

from m2pem.fleet.distance import Origin
from m2pem.fleet.geojson import GeometryError
from m2pem.mission.geometry import Point

FARTHEST_M = 1_000_000.0
_PREFIX = "enu"


def is_local(text: str) -> bool:
    """Whether it is meant as a local position."""
    start = text.strip()
    return start.startswith(_PREFIX) and start[len(_PREFIX) :].lstrip().startswith("[")


def local_point(text: str, origin: Origin) -> Point:
    """The position on Earth; with `up` its altitude is above mean sea level, without it not given.

    Raises:
        GeometryError: not two or three finite numbers, or too far away.
    """
    import pymap3d  # noqa: PLC0415  # it loads NumPy, and few missions have local positions

    try:
        metres = json.loads(text.strip()[len(_PREFIX) :])
    except (ValueError, RecursionError):
        metres = None
    if not isinstance(metres, list) or not 2 <= len(metres) <= 3:
        raise GeometryError(f"{text!r} is not a local position")
    for number in metres:
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise GeometryError(f"{text!r}: {number!r} is not a number of metres")
        if not math.isfinite(number) or abs(number) > FARTHEST_M:
            raise GeometryError(f"{text!r}: {number!r} m is not within {FARTHEST_M:g} m")
    east, north, *up = map(float, metres)
    latitude, longitude, altitude = map(
        float, pymap3d.enu2geodetic(east, north, up[0] if up else 0.0, *origin)
    )
    if up:
        return Point((latitude, longitude, altitude), "amsl")
    return Point((latitude, longitude, None))
