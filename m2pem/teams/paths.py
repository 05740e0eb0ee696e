"""The places of members in a formation, and each member's path along the team's route."""

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, chain, pairwise

from m2pem.geo.fence import Fence
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import EastNorthUp, Polyline, Segment, bend, shifted, trimmed

SPACING_M = 15.0
"""The default spacing between members."""

SHAPES = {
    "formation": "wedge",
    "road_following_formation": "column",
    "road_sweep": "line",
    "bridge_crossing": "column",
}
"""The default shape of each behavior that leads a team along a route."""


def slot(shape: str, index: int) -> tuple[float, float]:
    """Return the place of member `index` (0 leads): behind the lead and left of it, in spacings."""
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


def beside(place: EastNorth, yaw_rad: float, back_m: float, left_m: float) -> EastNorthUp:
    """Return the place behind and to the left of a pose with that yaw, at altitude 0."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    east, north = place
    return (east - back_m * cos - left_m * sin, north - back_m * sin + left_m * cos, 0.0)


def lane(route: Sequence[EastNorthUp], back_m: float, left_m: float) -> list[EastNorthUp]:
    """Return a member's way: the route without its last `back_m`, and to the left of it.

    One whose place is before the route's beginning goes to that place alone.
    """
    length_m = Polyline(place[:2] for place in route).length_m
    if back_m < length_m:
        return shifted(trimmed(route, back_m), left_m)
    first = Segment.between(route[0][:2], route[1][:2])
    return [beside(first.start, first.yaw_rad, back_m - length_m, left_m)]


_BEHIND_M = 5.0
_STRAY_M = 30.0
"""Farther off than this from where it should be, a vehicle is looked for on the whole path."""

_WRONG_WAY_M = 10.0
"""What a path in the opposite direction seems farther away, to one who looks along it."""


_BEND_RADIUS_M = 10.0
"""Of vehicles that round corners, at most."""

_BEND_PARTS = 4


class MemberPath:
    """A member's places in a row. `marks_m`: how far each is along the team's route.

    `line`: its path, which rounds corners as vehicles do; `corners_m`: how far along it the places
    are. `rows`: metres along it, and where a vehicle is then that rounds no corners, or does.

    On a bend the outer of two paths is longer, but both have the same marks at its ends: members
    that are abreast have the same mark.
    """

    def __init__(self, places: Sequence[EastNorthUp], marks: Sequence[float]) -> None:
        self.places, self.marks_m = tuple(places), tuple(marks)
        level = [each[:2] for each in places]
        legs = pairwise(Polyline(level).segments)
        arcs = [level[:1], *(_arc(before, after) for before, after in legs), level[1:][-1:]]
        self.line = Polyline(chain(*arcs))
        self.corners_m, self.rows = [], []
        begins = accumulate(map(len, arcs), initial=0)
        for begin, arc, corner in zip(begins, arcs, level, strict=False):
            half, last = len(arc) // 2, len(arc) - 1
            for index, place in ((0, arc[0]), (half, corner), (last, arc[last])):
                self.rows.append((self.line.marks_m[begin + index], *place, *arc[index]))
            self.corners_m.append(self.line.marks_m[begin + half])

    def rest(self, place: EastNorth, along_m: float) -> list[EastNorthUp]:
        """Return the places ahead of a member that is at `place`, which is the first."""
        index = bisect_left(self.corners_m, along_m, 1, len(self.corners_m) - 1)
        return [(*place, self.places[index - 1][2]), *self.places[index:]]

    def onward(self, places: Sequence[EastNorthUp]) -> "MemberPath":
        """Return another path to the end of this one, or to a place before it."""
        line = Polyline((east, north) for east, north, _ in places)
        end_m = self.mark_m(min(self.find(line.points[-1]), self.line.length_m))
        return MemberPath(places, [end_m - line.length_m + mark_m for mark_m in line.marks_m])

    def find(
        self,
        place: EastNorth,
        near_m: float | None = None,
        ahead_m: float = 0.0,
        yaw_rad: float | None = None,
    ) -> float:
        """How far along this path a place is, in metres of the path.

        `near_m`: where it was before, and it is at most `ahead_m` farther now, so that a path that
        crosses itself is not cut short. None, or one who has strayed: anywhere. `yaw_rad`, where it
        moves (from east, counter-clockwise), distinguishes the way there from the way back.
        """
        if near_m is not None:
            feet = self.line.feet(place, near_m - _BEHIND_M, near_m + ahead_m)
            _, off_m, along_m = min(_seen(feet, yaw_rad), default=(0.0, math.inf, 0.0))
            if off_m <= _STRAY_M:
                return along_m
        return min(_seen(self.line.feet(place), yaw_rad), default=(0.0, 0.0, 0.0))[2]

    def mark_m(self, along_m: float) -> float:
        """How far along the team's route that is."""
        return _interpolated(along_m, self.corners_m, self.marks_m)

    def along_m(self, mark_m: float) -> float:
        """How far along this path the place with that mark is."""
        return _interpolated(mark_m, self.marks_m, self.corners_m)


def _seen(
    feet: Iterable[tuple[float, float, Segment]], yaw_rad: float | None
) -> Iterator[tuple[float, float, float]]:
    """Yield how far away each foot seems to one who moves so, how far it is, and where it is."""
    for along_m, off_m, leg in feet:
        turned = 0.0 if yaw_rad is None else (1 - math.cos(yaw_rad - leg.yaw_rad)) / 2
        yield off_m + _WRONG_WAY_M * turned, off_m, along_m


def _interpolated(at: float, from_m: Sequence[float], to_m: Sequence[float]) -> float:
    index = bisect_left(from_m, at, 1, len(from_m) - 1)
    a, b = from_m[index - 1 : index + 1]
    part = min(1.0, max(0.0, (at - a) / (b - a))) if b > a else 1.0
    return to_m[index - 1] + (to_m[index] - to_m[index - 1]) * part


def _arc(before: Segment, after: Segment) -> list[EastNorth]:
    """Return the places of the bend between two segments; of none, the corner."""
    turn = math.remainder(after.yaw_rad - before.yaw_rad, math.tau)
    found = bend(turn, before.length_m, after.length_m, _BEND_RADIUS_M)
    if found is None:
        return [after.start]
    radius_m, cut_m = found
    begin = before.at(before.length_m - cut_m)
    sweeps = [turn * part / _BEND_PARTS for part in range(_BEND_PARTS + 1)]
    return [
        Segment(begin, before.yaw_rad + sweep / 2, 0.0).at(2 * radius_m * math.sin(abs(sweep) / 2))
        for sweep in sweeps
    ]


def lead_around(places: Sequence[EastNorthUp], fence: Fence) -> list[EastNorthUp]:
    """Return the places of a way around what is kept out; none: there is no way.

    A way that would end there ends beside it.
    """
    way, last = [places[0]], places[-1]
    for start, end in pairwise(places):
        level = shapely.LineString([start[:2], end[:2]])
        edges = shapely.get_coordinates(level.intersection(fence.closed.boundary)).tolist()
        edges.sort(key=lambda edge: math.dist(edge, start[:2]))
        for there in (*((*edge, end[2]) for edge in edges), end):
            free = fence.is_free(there[:2], there[:2])
            if not free and there is not last:
                continue
            between = fence.way(way[-1][:2], there[:2])
            if between is None:
                return []
            way += [(*each, there[2]) for each in between]
            if free:
                way.append(there)
    return way
