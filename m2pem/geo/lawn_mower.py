"""Lawn-mower tracks over a polygon.

Each strip of the given width is driven along its middle from where the polygon begins in the strip
to where it ends, so that every point of the polygon is within half a spacing of a track.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import Edge, turned

Ring: TypeAlias = Sequence[EastNorth]
"""A closed ring; the first point is repeated last."""

MAX_STRIPS = 5_000

_SAME_LENGTH = 1e-5
"""Edges whose lengths differ by less than this part are equally long."""


def longest_edge_yaw(ring: Ring) -> float:
    """Return the direction of the longest edge, along which there are the fewest turns.

    It is from east, counter-clockwise, in rad. Of edges that are equally long, as those of a square
    are but for rounding, the first one counts.
    """
    edges = list(pairwise(ring))
    longest_m = max(math.dist(*edge) for edge in edges)
    a, b = next(edge for edge in edges if math.dist(*edge) >= longest_m * (1 - _SAME_LENGTH))
    return math.atan2(b[1] - a[1], b[0] - a[0])


def lawn_mower(
    rings: Sequence[Ring], spacing_m: float, yaw_rad: float, overshoot_m: float = 0.0
) -> list[tuple[float, float]]:
    """The points to pass, in order; each pair of them is one pass over the area.

    Args:
        rings: the outer ring, then holes.
        spacing_m: at most this between two passes.
        yaw_rad: direction of the passes, from east, counter-clockwise.
        overshoot_m: how far each pass goes on beyond the area at both ends.

    Raises:
        ValueError: it would take more than `MAX_STRIPS` passes.
    """
    level = [[turned(corner, yaw_rad) for corner in ring] for ring in rings]
    low, strips, width = _strips(level[0], spacing_m)
    points: list[tuple[float, float]] = []
    for strip in range(strips):
        bottom = low + strip * width
        passes = _passes(level, bottom, bottom + width)
        middle = bottom + width / 2
        row = [((a - overshoot_m, middle), (b + overshoot_m, middle)) for a, b in passes]
        if strip % 2:
            row = [(b, a) for a, b in reversed(row)]
        points.extend(point for pair in row for point in pair)
    return [turned(point, -yaw_rad) for point in points]


def strip_width_m(ring: Ring, spacing_m: float, yaw_rad: float) -> float:
    """Return the width of each strip of `lawn_mower` over an area with that outer ring."""
    return _strips([turned(corner, yaw_rad) for corner in ring], spacing_m)[2]


def _strips(ring: Ring, spacing_m: float) -> tuple[float, int, float]:
    """Return the least y of a turned ring, the number of strips over it and their width."""
    low = min(y for _, y in ring)
    height = max(y for _, y in ring) - low
    strips = max(1, math.ceil(height / spacing_m - 1e-9))
    if strips > MAX_STRIPS:
        raise ValueError(
            f"spacing: {spacing_m:g} m makes {strips} passes over an area that is {height:.0f} m "
            f"wide; at most {MAX_STRIPS} are flown or driven"
        )
    return low, strips, height / strips


def _passes(rings: Sequence[Ring], bottom: float, top: float) -> list[tuple[float, float]]:
    """The spans of x that the polygon takes between two y."""
    corners = sorted({y for ring in rings for _, y in ring if bottom < y < top} | {bottom, top})
    spans: list[tuple[float, float]] = []
    for low, high in pairwise(corners):
        middle = (low + high) / 2
        # Between two corners' heights the edges do not cross, so their order in the middle holds.
        edges = sorted(_edges_at(rings, middle), key=lambda edge: _x(edge, middle))
        for left, right in zip(edges[::2], edges[1::2], strict=False):
            spans.append(
                (
                    min(_x(left, low), _x(left, high)),
                    max(_x(right, low), _x(right, high)),
                )
            )
    return _merged(spans)


def _edges_at(rings: Sequence[Ring], y: float) -> Iterator[Edge]:
    for ring in rings:
        for a, b in pairwise(ring):
            if (a[1] <= y) != (b[1] <= y):
                yield a, b


def _x(edge: Edge, y: float) -> float:
    (ax, ay), (bx, by) = edge
    part = min(1.0, max(0.0, (y - ay) / (by - ay)))
    return ax + (bx - ax) * part


def _merged(spans: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return spans in order, those that touch as one."""
    merged: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if merged and low <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], high)
        else:
            merged.append((low, high))
    return merged
