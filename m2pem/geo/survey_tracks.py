"""A survey as the tracks that are flown or driven, and the area that a part of them covers.

Each pass covers a strip along it. What a part of the passes covers is bounded by the strips' edges
and by straight lines across them, so that lawn-mower tracks over it are again these passes, also a
piece of one.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

from m2pem.geo.fence import Fence, rings_of
from m2pem.geo.lawn_mower import Ring, Span, longest_edge_yaw, merged, rows, strips_of
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import turned
from m2pem.geo.polyline import Polyline

PassAt: TypeAlias = tuple[int, float, float, float]
"""The index of a pass's first end, how far it goes on beyond its strip there and at the other end,
and how far it lies to the left of the strip's middle, in metres."""

Slab: TypeAlias = tuple[float, float, Sequence[Span]]
"""From one y to a greater one, and the spans of x between them."""

SURVEY_SPACING_M = 20.0
"""Between the tracks of a survey that gives no spacing."""

_SEAM = 0.1
"""Share of a strip's width. Near its edges, a strip is no longer than where it meets the next one:
else a small error of a corner would lengthen the pass beside it."""

_SLACK = 0.05
"""Share of a strip's width by which the height of all strips may seem greater than it is."""

_SEAM_M = 1e-3
"""Strips side by side overlap by so much, whatever the rounding."""

_SHORTEST_M = 0.01
_DIGITS = 2
"""Of the ends of spans: passes that end on one line get a straight side."""


class SurveyTracks:
    """`points`: the ends of each pass, in the order in which they are passed, with the places to
    pass on the way from one to the next around `holes` of the area.

    `width_m`: of a strip. `passes`: if none is given, the points are the ends of passes, in pairs,
    which go on by `overshoot_m`. All passes are parallel. Distances along the tracks are in metres
    and count the ways between passes.
    """

    def __init__(
        self,
        points: Sequence[EastNorth],
        width_m: float,
        overshoot_m: float = 0.0,
        passes: Sequence[PassAt] = (),
        holes: Sequence[Ring] = (),
    ) -> None:
        self.line = Polyline(points)
        self.width_m = width_m
        self.overshoot_m = overshoot_m
        self.passes = tuple(passes) or tuple(
            (index, overshoot_m, overshoot_m, 0.0) for index in range(0, len(points) - 1, 2)
        )
        self.holes = tuple(holes)
        first = self.passes[0][0]
        (ax, ay), (bx, by) = self.line.points[first : first + 2]
        self.yaw_rad = math.atan2(by - ay, bx - ax)

    @classmethod
    def over(
        cls,
        rings: Sequence[Ring],
        spacing_m: float | None = None,
        yaw_rad: float | None = None,
        overshoot_m: float = 0.0,
    ) -> "SurveyTracks":
        """Return tracks over an area: by themselves `SURVEY_SPACING_M` apart, and along the longest
        edge.

        A pass goes on by `overshoot_m` at both ends, but not into a hole. Between two passes, the
        way leads around holes.

        Raises:
            ValueError: it would take too many passes, nothing of the area is left beside its holes,
                or a part of it cannot be reached without crossing one.
        """
        spacing_m = spacing_m or SURVEY_SPACING_M
        yaw_rad = longest_edge_yaw(rings[0]) if yaw_rad is None else yaw_rad
        low, _, width_m = strips_of([turned(corner, yaw_rad) for corner in rings[0]], spacing_m)
        fence = Fence.around(rings[1:]) if len(rings) > 1 else None
        closed = None if fence is None else fence.closed
        points: list[EastNorth] = []
        passes: list[PassAt] = []
        for number, row in enumerate(rows(rings[0], spacing_m, yaw_rad, closed)):
            along, middle = (-1 if number % 2 else 1), low + (number + 0.5) * width_m
            for y, span in row[::along]:
                (a, b), out_m = span[::along], along * overshoot_m
                before, start, end, beyond = (
                    turned((x, y), -yaw_rad) for x in (a - out_m, a, b, b + out_m)
                )
                before_m = after_m = 0.0
                if fence is None or fence.is_free(start, before):
                    start, before_m = before, overshoot_m
                if fence is None or fence.is_free(end, beyond):
                    end, after_m = beyond, overshoot_m
                if points and fence is not None:
                    way = fence.way(points[-1], start)
                    if way is None:
                        raise ValueError("area: a part cannot be reached without crossing a hole")
                    points += way
                passes.append((len(points), before_m, after_m, along * (y - middle)))
                points += (start, end)
        if not passes:
            raise ValueError("area: nothing is left beside its holes")
        return cls(points, width_m, overshoot_m, passes, rings[1:])

    def reversed(self) -> "SurveyTracks":
        """Return the same tracks from their other end."""
        last = len(self.line.points) - 2
        passes = [
            (last - index, after, before, -left) for index, before, after, left in self.passes[::-1]
        ]
        points = self.line.points[::-1]
        return SurveyTracks(points, self.width_m, self.overshoot_m, passes, self.holes)

    def approached_from(self, place: EastNorth) -> "SurveyTracks":
        """Return the tracks with the places to pass on the way to them around the holes."""
        way = Fence.around(self.holes).way(place, self.line.points[0]) if self.holes else None
        if not way:
            return self
        passes = [(len(way) + each[0], *each[1:]) for each in self.passes]
        points = [*way, *self.line.points]
        return SurveyTracks(points, self.width_m, self.overshoot_m, passes, self.holes)

    def spacing_m(self, rings: Sequence[Sequence[EastNorth]]) -> float:
        """Return the spacing with which tracks over a part are as these, in any local frame."""
        norths = [turned(corner, self.yaw_rad)[1] for corner in rings[0]]
        count = max(1, round((max(norths) - min(norths)) / self.width_m))
        return self.width_m * (1 + _SLACK / count)

    def part(self, from_m: float, to_m: float = math.inf) -> list[list[EastNorth]]:
        """Return the area that the tracks from one distance to another cover, as closed rings.

        The first ring is the outer one, the others are holes. It is empty where there is nothing,
        or where what they cover is not connected.
        """
        strips, half_m = self._strips(from_m, to_m), self.width_m / 2 + _SEAM_M
        slabs: list[Slab] = [(y - half_m, y + half_m, spans) for y, spans in strips]
        if not self.holes:
            slabs = _slabs(strips, self.width_m)
        boxes = [shapely.box(x0, y0, x1, y1) for y0, y1, spans in slabs for x0, x1 in spans]
        holes = [[turned(corner, self.yaw_rad) for corner in ring] for ring in self.holes]
        covered = shapely.union_all(boxes).difference(Fence.around(holes).closed)
        return [
            [turned(corner, -self.yaw_rad) for corner in ring]
            for ring in rings_of(covered.simplify(0))
        ]

    def _strips(self, from_m: float, to_m: float) -> list[tuple[float, list[Span]]]:
        """Return the middle of each strip and its spans, from the lowest strip to the highest."""
        strips: list[tuple[float, list[Span]]] = []
        for index, before_m, after_m, left_m in self.passes:
            begin_m, end_m = self.line.marks_m[index], self.line.marks_m[index + 1]
            low_m = max(from_m, begin_m + before_m)
            high_m = min(to_m, end_m - after_m)
            if high_m - low_m < _SHORTEST_M:
                continue
            segment = self.line.segments[index]
            (ax, ay), (bx, _) = (
                turned(segment.at(along_m - begin_m), self.yaw_rad) for along_m in (low_m, high_m)
            )
            ay -= left_m if math.cos(segment.yaw_rad - self.yaw_rad) > 0 else -left_m
            span = round(min(ax, bx), _DIGITS), round(max(ax, bx), _DIGITS)
            same = next((s for y, s in strips if abs(y - ay) < self.width_m / 2), None)
            if same is None:
                strips.append((ay, [span]))
            else:
                same.append(span)
        return sorted((y, merged(spans)) for y, spans in strips)


def _slabs(strips: Sequence[tuple[float, Sequence[Span]]], width_m: float) -> list[Slab]:
    """Return the strips, with what neighbours have in common along each seam between two."""
    slabs: list[Slab] = []
    bottoms, tops = dict[float, float](), dict[float, float]()
    for (y, spans), (above, others) in pairwise(strips):
        if above - y < 1.5 * width_m:
            edge, seam_m = (y + above) / 2, _SEAM * width_m
            tops[y], bottoms[above] = edge - seam_m, edge + seam_m
            slabs.append((tops[y], bottoms[above], _common(spans, others)))
    for y, spans in strips:
        slabs.append((bottoms.get(y, y - width_m / 2), tops.get(y, y + width_m / 2), spans))
    return slabs


def _common(spans: Sequence[Span], others: Sequence[Span]) -> list[Span]:
    found = (
        (max(low, other_low), min(high, other_high))
        for low, high in spans
        for other_low, other_high in others
    )
    return sorted((low, high) for low, high in found if high - low >= _SHORTEST_M)
