"""The places of members in a formation, and each member's path along the team's route."""

import math
from bisect import bisect_left
from collections.abc import Sequence

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import EastNorthUp, Polyline, Segment, shifted, trimmed

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


class MemberPath:
    """A member's places in a row. `marks_m`: how far each is along the team's route.
    `line`: the `places`, without their heights.

    On a bend the outer of two paths is longer, but both have the same marks at its ends: members
    that are abreast have the same mark.
    """

    def __init__(self, places: Sequence[EastNorthUp], marks: Sequence[float]) -> None:
        self.places = tuple(places)
        self.line = Polyline((east, north) for east, north, _ in places)
        self.marks_m = tuple(marks)

    @property
    def end_mark_m(self) -> float:
        """The mark of its end."""
        return self.marks_m[-1]

    def rest(self, place: EastNorth, along_m: float) -> list[EastNorthUp]:
        """Return the places ahead of a member that is at `place`, which is the first."""
        index = self.line.segment_at(along_m)
        return [(*place, self.places[index][2]), *self.places[index + 1 :]]

    def onward(self, places: Sequence[EastNorthUp]) -> "MemberPath":
        """Return another path to the end of this one, or to a place before it."""
        line = Polyline((east, north) for east, north, _ in places)
        end_m = self.mark_m(min(self.find(line.points[-1], None, 0.0), self.line.length_m))
        return MemberPath(places, [end_m - line.length_m + mark_m for mark_m in line.marks_m])

    def find(
        self,
        place: EastNorth,
        near_m: float | None,
        ahead_m: float,
        yaw_rad: float | None = None,
        course_rad: float | None = None,
    ) -> float:
        """How far along this path a place is, in metres of the path.

        `near_m`: where it was before, and it is at most `ahead_m` farther now, so that a path that
        crosses itself is not cut short. None, or one who has strayed: anywhere. `course_rad`, where
        it moves (from east, counter-clockwise), distinguishes the way there from the way back;
        anywhere, `yaw_rad` does.
        """
        if near_m is not None:
            feet = self.line.feet(place, near_m - _BEHIND_M, near_m + ahead_m)
            _, off_m, found_m = min(
                (
                    (off_m + _wrong_way_m(leg, course_rad), off_m, along_m)
                    for along_m, off_m, leg in feet
                ),
                default=(math.inf, math.inf, 0.0),
            )
            if off_m <= _STRAY_M:
                return found_m
        feet = self.line.feet(place)
        seems = ((off_m + _wrong_way_m(leg, yaw_rad), along_m) for along_m, off_m, leg in feet)
        return min(seems, default=(0.0, 0.0))[1]

    def mark_m(self, along_m: float) -> float:
        """How far along the team's route that is."""
        index = self.line.segment_at(along_m)
        begin_m, length_m = self.line.marks_m[index], self.line.segments[index].length_m
        part = (along_m - begin_m) / length_m if length_m else 1.0
        a, b = self.marks_m[index], self.marks_m[index + 1]
        return a + (b - a) * min(1.0, max(0.0, part))

    def along_m(self, mark_m: float) -> float:
        """How far along this path the place with that mark is."""
        index = bisect_left(self.marks_m, mark_m, 1, len(self.marks_m) - 1)
        a, b = self.marks_m[index - 1 : index + 1]
        part = (mark_m - a) / (b - a) if b > a else 1.0
        begin_m, end_m = self.line.marks_m[index - 1 : index + 1]
        return begin_m + (end_m - begin_m) * min(1.0, max(0.0, part))

    def off_m(self, place: EastNorth, along_m: float) -> float:
        """How far a place is from that one of the path."""
        return math.dist(place, self.line.at(along_m))


def _wrong_way_m(leg: Segment, yaw_rad: float | None) -> float:
    opposite = yaw_rad is not None and math.cos(yaw_rad - leg.yaw_rad) < 0
    return _WRONG_WAY_M if opposite else 0.0
