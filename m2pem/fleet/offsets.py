"""Places of a team's members beside its lead, as a mission's author gives them."""

import json
import math

from m2pem.mission.values import Value

Offset = tuple[float, float]
"""Metres behind the lead, and to its left; less than 0: ahead of it, and to its right."""

REMEDY = "write [[behind, left], ...] in metres, one for each member after the lead"


def read_offsets(value: Value) -> tuple[Offset, ...]:
    """The offsets of the members after the lead, from a list or its text.

    Raises:
        ValueError: it is no list of pairs of numbers, or two members would be in one place.
    """
    if isinstance(value, str):
        try:
            value = json.loads(value)
        except (ValueError, RecursionError):
            raise ValueError(f"{value!r} is no list of offsets") from None
    if not isinstance(value, list) or not value:
        raise ValueError(f"{value!r} is no list of offsets")
    found: list[Offset] = [(0.0, 0.0)]
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2 or not all(map(_is_number, pair)):
            raise ValueError(f"{pair!r} is no offset")
        place = float(pair[0]), float(pair[1])  # type: ignore[arg-type]  # numbers, as was seen
        if place in found:
            raise ValueError(f"two members would be at {pair!r}")
        found.append(place)
    return tuple(found[1:])


def _is_number(value: Value) -> bool:
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and math.isfinite(float(value))  # type: ignore[arg-type]  # it is a number
