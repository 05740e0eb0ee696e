"""Lawn-mower tracks over a polygon.

Each strip of the given width is driven along its middle from where the polygon begins in the strip
to where it ends, so that every point of the polygon is within half a spacing of a track. No pass
enters a hole: where one has the middle of a strip, what is free beside it gets passes, too.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

from m2pem.geo.fence import polygons, valid
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import turned

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Ring: TypeAlias = Sequence[EastNorth]
"""A closed ring; the first point is repeated last."""

Span: TypeAlias = tuple[float, float]
"""From one x to a greater one."""

Row: TypeAlias = list[tuple[float, Span]]
"""The passes of one strip: the y and the span of each, by where they begin."""

MAX_STRIPS = 5_000

_SAME_LENGTH = 1e-5
"""Edges whose lengths differ by less than this part are equally long."""

_NARROWEST_M = 0.05
"""What is free beside a hole and narrower is left out."""

_SHORTEST_M = 0.01
_SEAM_M = 1e-4
"""Passes side by side leave nothing between them, whatever the rounding."""

_TRIED = 8
"""Of so many lines through what is free beside a hole, the longest becomes a pass."""

_ALMOST = 0.95
"""No line is tried after one that is as long as this share of the part."""

_ROUNDS = 40


def longest_edge_yaw(ring: Ring) -> float:
    """Return the direction of the longest edge, along which there are the fewest turns.

    It is from east, counter-clockwise, in rad. Of edges that are equally long, as those of a square
    are but for rounding, the first one counts.
    """
    edges = list(pairwise(ring))
    longest_m = max(math.dist(*edge) for edge in edges)
    a, b = next(edge for edge in edges if math.dist(*edge) >= longest_m * (1 - _SAME_LENGTH))
    return math.atan2(b[1] - a[1], b[0] - a[0])


def rows(
    ring: Ring, spacing_m: float, yaw_rad: float, closed: "BaseGeometry | None" = None
) -> list[Row]:
    """Return the passes of each strip in axes that are turned by `yaw_rad`.

    `closed`: where no pass is, such as holes, in axes that are not turned.

    Raises:
        ValueError: it would take more than `MAX_STRIPS` passes.
    """
    level = [turned(corner, yaw_rad) for corner in ring]
    low, strips, width_m = strips_of(level, spacing_m)
    region, found = valid(level), list[Row]()
    shapely.prepare(region)
    west, east = (extreme(x for x, _ in level) for extreme in (min, max))
    for bottom in (low + strip * width_m for strip in range(strips)):
        inside = region.intersection(shapely.box(west, bottom, east, bottom + width_m))
        spans = merged((part.bounds[0], part.bounds[2]) for part in polygons(inside))
        found.append([(bottom + width_m / 2, span) for span in spans])
    if closed is None:
        return found
    obstacles = shapely.affinity.rotate(closed, -yaw_rad, (0, 0), use_radians=True)
    region = region.difference(obstacles)
    if region.is_empty:
        return []
    return [
        _beside(row, region, obstacles, low + strip * width_m, width_m)
        for strip, row in enumerate(found)
    ]


def _beside(
    row: Row, region: "BaseGeometry", closed: "BaseGeometry", bottom: float, width_m: float
) -> Row:
    """Return the passes of a strip that stay out of what is closed, with those beside it."""
    half_m = width_m / 2 + _SEAM_M
    west, _, east, _ = region.bounds
    strip = shapely.box(west - width_m, bottom, east + width_m, bottom + width_m)
    closed, left = closed.intersection(strip), region.intersection(strip)
    new = [(y, part) for y, span in row for part in _cut(y, span, closed)]
    found = list(new)
    for _ in range(_ROUNDS):
        boxes = [shapely.box(low, y - half_m, high, y + half_m) for y, (low, high) in new]
        left = left.difference(shapely.union_all(boxes)) if boxes else left
        new = []
        for part in polygons(left):
            if not part.buffer(-_NARROWEST_M / 2).is_empty:
                new += _longest(part, closed)
        if not new:
            break
        found += new
    return sorted(found, key=lambda each: each[1])


def _longest(part: "BaseGeometry", closed: "BaseGeometry") -> Row:
    """Return passes along the longest of some lines through a part of a strip."""
    low_x, low_y, high_x, high_y = part.bounds
    best: Row = []
    # From the middle outwards: of lines that are equally long, the one in the middle.
    for step in sorted(range(1, _TRIED), key=lambda each: abs(each - _TRIED / 2)):
        y = low_y + (high_y - low_y) * step / _TRIED
        tried = [(y, span) for span in _cut(y, (low_x, high_x), closed)]
        if _length_m(tried) > _length_m(best) + _SHORTEST_M:
            best = tried
        if _length_m(best) > _ALMOST * (high_x - low_x):
            break
    return best


def _length_m(row: Row) -> float:
    return sum(high - low for _, (low, high) in row)


def _cut(y: float, span: Span, closed: "BaseGeometry") -> Iterator[Span]:
    """Yield the parts of a pass that are free."""
    left = shapely.LineString([(span[0], y), (span[1], y)]).difference(closed)
    for part in shapely.get_parts(left):
        if part.length >= _SHORTEST_M:
            xs = [x for x, *_ in part.coords]
            yield min(xs), max(xs)


def strips_of(ring: Ring, spacing_m: float) -> tuple[float, int, float]:
    """Return the least y of a turned ring, the number of strips over it and their width.

    Raises:
        ValueError: there are more than `MAX_STRIPS`.
    """
    low = min(y for _, y in ring)
    height = max(y for _, y in ring) - low
    strips = max(1, math.ceil(height / spacing_m - 1e-9))
    if strips > MAX_STRIPS:
        raise ValueError(
            f"spacing: {spacing_m:g} m makes {strips} passes over an area that is {height:.0f} m "
            f"wide; at most {MAX_STRIPS} are flown or driven"
        )
    return low, strips, height / strips


def merged(spans: Iterable[Span]) -> list[Span]:
    """Return spans in order, those that touch as one."""
    found: list[Span] = []
    for low, high in sorted(spans):
        if found and low <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], high)
        else:
            found.append((low, high))
    return found
