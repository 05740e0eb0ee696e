"""Convex polygons on the map: their hulls, how they grow, and how far apart they are.

Points are (east, north) in metres. A polygon is its corners, counter-clockwise; one corner is a
place, two are a straight way. None stands for everywhere.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TypeAlias

Place: TypeAlias = tuple[float, float]
Hull: TypeAlias = tuple[Place, ...]

SIDES = 16
"""Of the polygon that stands for a circle, and lies around it."""

_OUTER = 1 / math.cos(math.pi / SIDES)
_CIRCLE = tuple(
    (_OUTER * math.cos(math.tau * side / SIDES), _OUTER * math.sin(math.tau * side / SIDES))
    for side in range(SIDES)
)


def hull(places: Iterable[Place]) -> Hull:
    """The smallest convex polygon around places; at least one is needed."""
    ordered = sorted(set(places))
    if len(ordered) < 3:
        return tuple(ordered)
    lower, upper = _chain(ordered), _chain(ordered[::-1])
    return (*lower[:-1], *upper[:-1])


def _chain(places: Sequence[Place]) -> list[Place]:
    kept: list[Place] = []
    for place in places:
        while len(kept) >= 2 and _turn(kept[-2], kept[-1], place) <= 0:
            kept.pop()
        kept.append(place)
    return kept


def _turn(a: Place, b: Place, c: Place) -> float:
    """Above 0: c is to the left of the way from a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def grown(places: Iterable[Place], reach_m: float) -> Hull:
    """A polygon around everything that is within `reach_m` of the hull of places."""
    if reach_m <= 0:
        return hull(places)
    return hull(
        (east + reach_m * cos, north + reach_m * sin)
        for east, north in places
        for cos, sin in _CIRCLE
    )


def apart_m(a: Hull | None, b: Hull | None) -> float:
    """The distance between two polygons; 0 if they touch."""
    if a is None or b is None or _holds(a, b[0]) or _holds(b, a[0]):
        return 0.0
    return min(_sides_apart_m(first, second) for first in _sides(a) for second in _sides(b))


def _holds(polygon: Hull, place: Place) -> bool:
    return len(polygon) > 2 and all(_turn(a, b, place) >= 0 for a, b in _sides(polygon))


def _sides(polygon: Hull) -> list[tuple[Place, Place]]:
    if len(polygon) == 1:
        return [(polygon[0], polygon[0])]
    if len(polygon) == 2:
        return [(polygon[0], polygon[1])]
    return [*pairwise(polygon), (polygon[-1], polygon[0])]


def _sides_apart_m(first: tuple[Place, Place], second: tuple[Place, Place]) -> float:
    (a, b), (c, d) = first, second
    over = _turn(a, b, c) * _turn(a, b, d) < 0 and _turn(c, d, a) * _turn(c, d, b) < 0
    if over:
        return 0.0
    return min(_off_m(a, second), _off_m(b, second), _off_m(c, first), _off_m(d, first))


def _off_m(place: Place, side: tuple[Place, Place]) -> float:
    """How far a place is from a straight way."""
    (ae, an), (be, bn) = side
    de, dn = be - ae, bn - an
    length2 = de * de + dn * dn
    part = ((place[0] - ae) * de + (place[1] - an) * dn) / length2 if length2 else 0.0
    part = min(1.0, max(0.0, part))
    return math.dist(place, (ae + de * part, an + dn * part))
