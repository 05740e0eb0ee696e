"""Which member of a march waits for which, so that none comes too near to another in the plane.

Of two members, the one ahead in the formation passes each narrow place first: a place where the
formation would bring the two too near, as at a sharp turn. A place that the formation passes
safely, as where a route crosses itself, is first passed by the member that is there first.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import Polyline, Segment
from m2pem.teams.paths import MemberPath

NEAREST_SHARE = 0.83
"""Share of the spacing that is aimed at, to keep a minimum distance of 0.8 in the plane.

Members beside each other may come a little nearer in sharp turns of short legs.
"""

_BEND_RADIUS_M, _FARTHEST_MISS_M = 10.0, 3.5
"""Vehicles round corners: so far from the corner do they pass at most."""

_FAR_SHARE = 0.08
_BESIDE_SHARE = 0.97 / NEAREST_SHARE
"""Members beside each other pass corners together: that counts at most this share apart."""

_SAMPLES = 8
_STEPS = 20
_NOTHING_M = 1e-6


@dataclass(frozen=True, slots=True)
class Way:
    """A member's path, and how far behind the lead and to its left its place is."""

    path: MemberPath
    back_m: float
    left_m: float

    @property
    def line(self) -> Polyline:
        return self.path.line

    def lead_m(self, along_m: float) -> float:
        """Where the lead is when this one is there, if both keep their places."""
        return self.path.mark_m(along_m) + self.back_m


@dataclass(frozen=True, slots=True)
class _Near:
    """Two segments, one of each path, that come nearer to each other than `apart_m`."""

    first: int
    second: int
    apart_m: float


class _Yield:
    """One member waits for another: `nears` are the places that the other passes first."""

    def __init__(self, own: Polyline, other: Polyline, nears: Sequence[_Near]) -> None:
        self._own, self._other = own, other
        self._of: dict[int, list[_Near]] = {}
        for near in nears:
            self._of.setdefault(near.second, []).append(near)
        self._order = sorted(self._of)
        self._later_m: dict[int, float] = {}
        least_m = math.inf
        for index in reversed(self._order):
            self._later_m[index] = least_m
            least_m = min(least_m, self._within_m(index, 0.0))

    def limit_m(self, other_m: float) -> float:
        """How far along its path the member may go when the other has gone `other_m` along its."""
        at = self._other.segment_at(other_m)
        index = next((each for each in self._order if each >= at), None)
        if index is None:
            return math.inf
        from_m = other_m - self._other.marks_m[index] if index == at else 0.0
        return min(self._within_m(index, from_m), self._later_m[index])

    def _within_m(self, index: int, from_m: float) -> float:
        other = self._other.segments[index]
        rest = Segment(other.at(from_m), other.yaw_rad, max(0.0, other.length_m - from_m))
        entries = (
            self._own.marks_m[near.first]
            + first_within_m(self._own.segments[near.first], rest, near.apart_m)
            for near in self._of[index]
        )
        return min(entries, default=math.inf)


class Clearance:
    """How far each member may go, by where the others are. `apart_m`: the minimum distance."""

    def __init__(self, ways: Sequence[Way], apart_m: float) -> None:
        self._ways = ways
        order = sorted(range(len(ways)), key=lambda index: ways[index].back_m)
        self._yields: dict[int, list[tuple[int, _Yield]]] = {index: [] for index in order}
        for first, second in combinations(order, 2):
            a, b = ways[first], ways[second]
            ahead: list[_Near] = []
            behind: list[_Near] = []
            beside = abs(a.left_m - b.left_m) >= apart_m
            most_m = _BESIDE_SHARE * apart_m if beside else math.inf
            for nears in _places(a.line, b.line, apart_m, most_m):
                (ahead if _meets(a, b, nears) else behind).extend(nears)
            turned = [_Near(each.second, each.first, each.apart_m) for each in ahead]
            self._yields[second].append((first, _Yield(b.line, a.line, turned)))
            if behind:
                self._yields[first].append((second, _Yield(a.line, b.line, behind)))

    def limit_m(self, member: int, place_m: Callable[[int], float]) -> float:
        """How far along its path a member may go. `place_m`: where another is on its own path."""
        rules = self._yields[member]
        return min((rule.limit_m(place_m(other)) for other, rule in rules), default=math.inf)

    def reached_m(
        self, at_m: Sequence[float], ends_m: Sequence[float], short_m: float
    ) -> Sequence[float]:
        """How far along their paths the members get at most, from where they are.

        `short_m`: how far before the place where it must stop a member may come to a stop.
        """
        while True:
            limits_m = [self.limit_m(index, at_m.__getitem__) for index in range(len(at_m))]
            then_m = [
                max(at, end if limit >= end else limit - short_m)
                for at, end, limit in zip(at_m, ends_m, limits_m, strict=True)
            ]
            if max(b - a for a, b in zip(at_m, then_m, strict=True)) < _NOTHING_M:
                return then_m
            at_m = then_m


def first_within_m(segment: Segment, other: Segment, apart_m: float) -> float:
    """How far along a segment the first point is that is nearer than that to another one."""
    turn = segment.yaw_rad - other.yaw_rad
    cos, sin = math.cos(turn), math.sin(turn)
    x = other.along(segment.start)
    y = Segment(other.start, other.yaw_rad + math.pi / 2, 0.0).along(segment.start)
    found = [_beside(x, y, cos, sin, other.length_m, apart_m)]
    for middle in (0.0, other.length_m):
        half = (x - middle) * cos + y * sin
        rest = half**2 - (x - middle) ** 2 - y**2 + apart_m**2
        if rest > 0:
            found.append((-half - math.sqrt(rest), -half + math.sqrt(rest)))
    entries = (max(0.0, a) for a, b in found if b > 0.0 and a < b and a <= segment.length_m)
    return min(entries, default=math.inf)


def _beside(
    x: float, y: float, cos: float, sin: float, length_m: float, apart_m: float
) -> tuple[float, float]:
    """From where to where a ray from (x, y) is beside a segment on the x axis that begins at 0."""
    low, high = -math.inf, math.inf
    for at, step, least, most in ((x, cos, 0.0, length_m), (y, sin, -apart_m, apart_m)):
        if abs(step) < 1e-12:
            if not least < at < most:
                return math.inf, -math.inf
            continue
        a, b = sorted(((least - at) / step, (most - at) / step))
        low, high = max(low, a), min(high, b)
    return low, high


@dataclass(frozen=True, slots=True)
class Nearest:
    """Where a formation brings two of its members, by their indexes, nearest to each other.

    `place`: the corner of the first one's path, with `turn_deg` between their directions there.
    """

    distance_m: float
    members: tuple[int, int]
    place: EastNorth
    turn_deg: float


def nearest(ways: Sequence[Way]) -> Nearest:
    """Return where members that keep their places along the route are nearest to each other."""
    order = sorted(range(len(ways)), key=lambda index: ways[index].back_m)
    found = Nearest(math.inf, (0, 0), (0.0, 0.0), 0.0)
    for first, second in combinations(order, 2):
        a, b = ways[first].path, ways[second].path
        gap_m = ways[second].back_m - ways[first].back_m
        for begin_m, end_m in pairwise(a.marks_m):
            # On the leg, and while the second one has not come to its corner.
            for from_m, to_m in ((begin_m, end_m), (end_m, end_m + gap_m)):
                for step in range(_STEPS):
                    mark_m = from_m + (to_m - from_m) * step / _STEPS
                    if mark_m > a.end_mark_m or mark_m - gap_m < b.marks_m[0]:
                        continue
                    one_m, other_m = a.along_m(mark_m), b.along_m(mark_m - gap_m)
                    distance_m = math.dist(a.line.at(one_m), b.line.at(other_m))
                    if distance_m < found.distance_m - _NOTHING_M:
                        place, turn_deg = _corner(a.line, one_m, other_m)
                        found = Nearest(distance_m, (first, second), place, turn_deg)
    return found


def _corner(line: Polyline, ahead_m: float, behind_m: float) -> tuple[EastNorth, float]:
    """Return the sharpest corner between two places, and the turn from one to the other."""
    behind, ahead = sorted((line.segment_at(behind_m), line.segment_at(ahead_m)))
    if behind == ahead:
        corners = range(1, len(line.segments))
        ahead = min(corners, key=lambda each: abs(line.marks_m[each] - ahead_m), default=0)
        behind = max(0, ahead - 1)
    sharpest = max(
        range(behind, ahead), key=lambda each: turn_rad(line, each, each + 1), default=behind - 1
    )
    return line.points[sharpest + 1], math.degrees(turn_rad(line, behind, ahead))


def turn_rad(line: Polyline, first: int, second: int) -> float:
    """Return the angle between the directions of two segments, from 0 to pi."""
    change = line.segments[second].yaw_rad - line.segments[first].yaw_rad
    return abs(math.remainder(change, math.tau))


def _places(a: Polyline, b: Polyline, apart_m: float, most_m: float) -> Iterator[list[_Near]]:
    """The places where two paths come too near to each other: pairs of segments that touch."""
    left = {(each.first, each.second): each for each in _nears(a, b, apart_m, most_m)}
    while left:
        group = [left.popitem()[1]]
        for near in group:
            i, k = near.first, near.second
            for key, line, corner, segment in (
                ((i - 1, k), a, i, b.segments[k]),
                ((i + 1, k), a, i + 1, b.segments[k]),
                ((i, k - 1), b, k, a.segments[i]),
                ((i, k + 1), b, k + 1, a.segments[i]),
            ):
                if key in left and segment.distance_m(line.points[corner]) < near.apart_m:
                    group.append(left.pop(key))
        yield group


def _nears(a: Polyline, b: Polyline, apart_m: float, most_m: float) -> Iterator[_Near]:
    boxes = [_box(each, apart_m + _FARTHEST_MISS_M) for each in b.segments]
    for first, own in enumerate(a.segments):
        west, south, east, north = _box(own, 0.0)
        for second, box in enumerate(boxes):
            if box[0] < east and box[2] > west and box[1] < north and box[3] > south:
                low, high = min(first, second), max(first, second)
                missed_m = max(_missed_m(line, low, high, apart_m) for line in (a, b))
                least_m = min(apart_m + missed_m, most_m)
                if first_within_m(own, b.segments[second], least_m) < math.inf:
                    yield _Near(first, second, least_m)


def _box(segment: Segment, wide_m: float) -> tuple[float, float, float, float]:
    (ae, an), (be, bn) = segment.start, segment.at(segment.length_m)
    return min(ae, be) - wide_m, min(an, bn) - wide_m, max(ae, be) + wide_m, max(an, bn) + wide_m


def _missed_m(line: Polyline, first: int, second: int, apart_m: float) -> float:
    """How far off a vehicle passes the corners between two segments; less if many are between."""
    if second - first > 2:
        return _FAR_SHARE * apart_m
    turns = (
        turn_rad(line, corner, corner + 1)
        for corner in range(first, min(second, len(line.segments) - 1))
    )
    return max(
        (
            min(_FARTHEST_MISS_M, _BEND_RADIUS_M * (1 / max(1e-9, math.cos(turn / 2)) - 1))
            for turn in turns
        ),
        default=0.0,
    )


def _meets(a: Way, b: Way, nears: Sequence[_Near]) -> bool:
    """Whether the second of two members, in its place in the formation, comes to a place before
    the first has passed it."""
    for near in nears:
        own, other = a.line.segments[near.first], b.line.segments[near.second]
        back = Segment(other.at(other.length_m), other.yaw_rad + math.pi, other.length_m)
        for step in range(_SAMPLES + 1):
            along_m = own.length_m * step / _SAMPLES
            left_m = first_within_m(back, Segment(own.at(along_m), 0.0, 0.0), near.apart_m)
            if left_m < math.inf:
                first_m = a.lead_m(a.line.marks_m[near.first] + along_m)
                second_m = b.lead_m(b.line.marks_m[near.second] + other.length_m - left_m)
                if second_m > first_m:
                    return True
    return False
