"""Reads the values that simulators take from a fleet file or the command line.

`m2pem.units.quantity` reads those with a unit.
"""

import math
from collections.abc import Mapping

Coordinates = tuple[float, float, float | None]
"""Latitude and longitude in degrees (WGS-84), altitude in metres above mean sea level or None."""


def number(value: object) -> float:
    """Read a finite number.

    Raises:
        ValueError: it is something else.
    """
    try:
        read = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        read = math.nan
    if not math.isfinite(read):
        raise ValueError(f"{value!r} is not a number")
    return read


def fraction(value: object) -> float:
    """Read a fraction from 0 to 1, or a percentage.

    Raises:
        ValueError: it is something else.
    """
    try:
        if isinstance(value, str) and value.strip().endswith("%"):
            read = float(value.strip()[:-1]) / 100
        else:
            read = number(value)
    except ValueError:
        read = math.nan
    if not 0 <= read <= 1:
        raise ValueError(f"{value!r} is neither a percentage ('80 %') nor a fraction (0.8)")
    return read


def coordinates(value: object) -> Coordinates:
    """Read [lat, lon], [lat, lon, alt] or a map with these keys.

    Raises:
        ValueError: it is something else, or not on Earth.
    """
    if isinstance(value, Mapping):
        value = [value.get("lat"), value.get("lon"), *([value["alt"]] if "alt" in value else [])]
    if not isinstance(value, list | tuple) or len(value) not in (2, 3):
        raise ValueError(f"{value!r} is not a position; write [lat, lon] or [lat, lon, alt]")
    latitude, longitude = number(value[0]), number(value[1])
    if abs(latitude) > 90 or abs(longitude) > 180:
        raise ValueError(f"{list(value)} is not a position: latitude comes first, in degrees")
    return latitude, longitude, number(value[2]) if len(value) == 3 else None
