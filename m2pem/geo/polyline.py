"""Polylines in metres of a local frame: distances along them, and the nearest point of one."""

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TypeAlias

from m2pem.geo.local_frame import EastNorth

EastNorthUp: TypeAlias = tuple[float, float, float]
"""East, north and up of the origin of a local frame, in metres."""


SHARPEST_BEND_RAD = math.radians(150)
"""A sharper turn is made on the spot."""

FARTHEST_MISS_M = 3.5
"""A bend passes its waypoint no farther off: the sharper the corner, the tighter the bend."""

SMALLEST_RADIUS_M = 0.5


def bend(
    turn_rad: float, before_m: float, after_m: float, radius_m: float
) -> tuple[float, float] | None:
    """Return the radius of the bend with which vehicles round a corner between two legs, and how
    much it cuts off each; None: they stop and turn on the spot.

    `radius_m`: at most.
    """
    half = max(5e-7, abs(turn_rad) / 2)
    radius_m = min(radius_m, FARTHEST_MISS_M / (1 / math.cos(half) - 1 + 1e-9))
    cut_m = min(radius_m * math.tan(half), before_m / 2, after_m / 2)
    radius_m = cut_m / math.tan(half)
    sharp = abs(turn_rad) > SHARPEST_BEND_RAD or radius_m < SMALLEST_RADIUS_M
    return None if sharp else (radius_m, cut_m)


@dataclass(frozen=True, slots=True)
class Segment:
    """A straight line. `yaw_rad`: its direction, from east, counter-clockwise."""

    start: EastNorth
    yaw_rad: float
    length_m: float

    @classmethod
    def between(cls, start: EastNorth, end: EastNorth) -> "Segment":
        yaw_rad = math.atan2(end[1] - start[1], end[0] - start[0])
        return cls(start, yaw_rad, math.dist(start, end))

    def at(self, along_m: float) -> EastNorth:
        """Return the point at a distance from the start; it may lie before it or beyond the end."""
        return (
            self.start[0] + along_m * math.cos(self.yaw_rad),
            self.start[1] + along_m * math.sin(self.yaw_rad),
        )

    def along(self, point: EastNorth) -> float:
        """Return the distance from the start to the foot of the perpendicular from a point.

        It is below 0 before the start, and above `length_m` beyond the end.
        """
        return (point[0] - self.start[0]) * math.cos(self.yaw_rad) + (
            point[1] - self.start[1]
        ) * math.sin(self.yaw_rad)

    def distance_m(self, point: EastNorth) -> float:
        """Return the distance from a point to the nearest one of the segment."""
        return math.dist(point, self.at(min(self.length_m, max(0.0, self.along(point)))))


class Polyline:
    """Straight segments from each point to the next.

    `segments`: one less than points. `marks_m`: the distance along the polyline of each point.
    """

    __slots__ = ("marks_m", "points", "segments")

    def __init__(self, points: Iterable[EastNorth]) -> None:
        self.points = tuple(points)
        self.segments = tuple(Segment.between(a, b) for a, b in pairwise(self.points))
        lengths = (segment.length_m for segment in self.segments)
        self.marks_m = tuple(accumulate(lengths, initial=0.0))

    @property
    def length_m(self) -> float:
        return self.marks_m[-1]

    def segment_at(self, along_m: float) -> int:
        """Return the index of the segment that a distance along the polyline lies on.

        Distances before the start and beyond the end are on the first and the last segment.
        """
        last = len(self.segments)
        return bisect_left(self.marks_m, along_m, min(1, last), last) - 1

    def at(self, along_m: float) -> EastNorth:
        """Return the point at a distance along the polyline, from its start to its end."""
        if not self.segments:
            return self.points[0]
        along_m = min(self.length_m, max(0.0, along_m))
        index = self.segment_at(along_m)
        return self.segments[index].at(along_m - self.marks_m[index])

    def feet(
        self, point: EastNorth, from_m: float = 0.0, to_m: float = math.inf
    ) -> Iterator[tuple[float, float, Segment]]:
        """Yield the point of each segment with a length that is nearest to a point.

        Each is a distance along the polyline, within `from_m` and `to_m`, the distance from the
        point, and the segment.
        """
        for segment, begin_m in zip(self.segments, self.marks_m, strict=False):
            if begin_m > to_m:
                return
            low_m = max(0.0, from_m - begin_m)
            high_m = min(segment.length_m, to_m - begin_m)
            if segment.length_m and low_m <= high_m:
                along_m = min(high_m, max(low_m, segment.along(point)))
                yield begin_m + along_m, math.dist(segment.at(along_m), point), segment

    def nearest(self, point: EastNorth) -> EastNorth:
        """Return the point of the polyline that is nearest to a point."""
        feet = ((distance_m, along_m) for along_m, distance_m, _ in self.feet(point))
        return self.at(min(feet, default=(0.0, 0.0))[1])


def shifted(points: Sequence[EastNorthUp], left_m: float) -> list[EastNorthUp]:
    """Return a polyline moved sideways; at corners by as much as keeps the segments apart."""
    if not left_m or len(points) < 2:
        return list(points)
    yaws = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
    moved = []
    for index, (east, north, up) in enumerate(points):
        before, after = yaws[max(0, index - 1)], yaws[min(index, len(yaws) - 1)]
        half = math.remainder(after - before, math.tau) / 2
        aside = before + half + math.pi / 2
        reach = left_m / max(0.5, math.cos(half))
        moved.append((east + reach * math.cos(aside), north + reach * math.sin(aside), up))
    return moved


def trimmed(points: Sequence[EastNorthUp], back_m: float) -> list[EastNorthUp]:
    """Return a polyline without its last `back_m`; below 0, it is that much longer."""
    kept = list(points)
    if not back_m or len(kept) < 2:
        return kept
    while back_m > 0 and len(kept) > 2 and math.dist(kept[-1], kept[-2]) <= back_m:
        back_m -= math.dist(kept[-1], kept[-2])
        kept.pop()
    length = math.dist(kept[-1], kept[-2])
    if length > 0:
        part = 1 - back_m / length
        east, north, up = (a + (b - a) * part for a, b in zip(*kept[-2:], strict=True))
        kept[-1] = east, north, up
    return kept
