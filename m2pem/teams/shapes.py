"""Where the members of a team stand to each other, and the routes that keep them so.

Pure geometry in a local frame: east, north and up in metres.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]
"""East, north, up in metres."""

SPACING_M = 15.0
"""Between members, when nobody says."""


def slot(shape: str, index: int) -> tuple[float, float]:
    """Where member `index` (0 leads) stands: behind the lead and to its left, in spacings."""
    rank, side = (index + 1) // 2, 1 if index % 2 else -1
    match shape:
        case "line":
            return 0.0, float(rank * side)
        case "wedge":
            return float(rank), float(rank * side)
        case "vee":
            return -float(rank), float(rank * side)
        case "echelon_left":
            return float(index), float(index)
        case "echelon_right":
            return float(index), -float(index)
        case "diamond":
            rows, place = divmod(index, 4)
            back, left = ((0, 0), (1, 1), (1, -1), (2, 0))[place]
            return float(back + 3 * rows), float(left)
        case _:
            return float(index), 0.0


def beside(place: tuple[float, float], yaw_rad: float, back_m: float, left_m: float) -> Vector:
    """The place behind and to the left of one who looks along `yaw_rad`, on the level."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    east, north = place
    return (east - back_m * cos - left_m * sin, north - back_m * sin + left_m * cos, 0.0)


def shifted(places: Sequence[Vector], left_m: float) -> list[Vector]:
    """The route moved sideways; at corners by as much as keeps the legs apart."""
    if not left_m or len(places) < 2:
        return list(places)
    yaws = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(places)]
    moved = []
    for index, (east, north, up) in enumerate(places):
        before, after = yaws[max(0, index - 1)], yaws[min(index, len(yaws) - 1)]
        half = math.remainder(after - before, math.tau) / 2
        aside = before + half + math.pi / 2
        reach = left_m / max(0.5, math.cos(half))
        moved.append((east + reach * math.cos(aside), north + reach * math.sin(aside), up))
    return moved


def trimmed(places: Sequence[Vector], back_m: float) -> list[Vector]:
    """The route without its last `back_m`, or (less than 0) that much longer."""
    kept = list(places)
    if not back_m or len(kept) < 2:
        return kept
    while back_m > 0 and len(kept) > 2 and math.dist(kept[-1], kept[-2]) <= back_m:
        back_m -= math.dist(kept[-1], kept[-2])
        kept.pop()
    length = math.dist(kept[-1], kept[-2])
    if length > 0:
        part = 1 - back_m / length
        a, b = kept[-2], kept[-1]
        kept[-1] = (
            a[0] + (b[0] - a[0]) * part,
            a[1] + (b[1] - a[1]) * part,
            a[2] + (b[2] - a[2]) * part,
        )
    return kept
