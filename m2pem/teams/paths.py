"""The places of members in a formation, and each member's path along the team's route."""

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]
"""East, north, up in metres."""

SPACING_M = 15.0
"""Between members, when nobody says."""


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


_BEHIND_M = 5.0
_STRAY_M = 30.0
"""Farther off than this from where it should be, a vehicle is looked for on the whole path."""

_WRONG_WAY_M = 10.0
"""What a path in the opposite direction seems farther away, to one who looks along it."""


class Path:
    """Places in a row. `marks`: how far each is along the team's route, in metres.

    On a bend the outer of two paths is longer, but both have the same marks at its ends: members
    that are abreast have the same mark.
    """

    def __init__(self, places: Sequence[Vector], marks: Sequence[float]) -> None:
        self._places = [(east, north) for east, north, _ in places]
        self._marks = tuple(marks)
        steps = (math.dist(a, b) for a, b in pairwise(self._places))
        self._lengths = tuple(accumulate(steps, initial=0.0))

    @property
    def end_mark_m(self) -> float:
        """The mark of its end."""
        return self._marks[-1]

    def find(
        self,
        place: tuple[float, float],
        near_m: float | None,
        ahead_m: float,
        yaw_rad: float | None = None,
    ) -> float:
        """How far along this path a place is, in metres of the path.

        `near_m`: where it was before, and it is at most `ahead_m` farther now, so that a path that
        crosses itself is not cut short. None, or one who has strayed: anywhere; `yaw_rad` (from
        east, counter-clockwise) then tells the way there from the way back.
        """
        if near_m is not None:
            found_m, off_m = self._nearest(place, near_m - _BEHIND_M, near_m + ahead_m, None)
            if off_m <= _STRAY_M:
                return found_m
        return self._nearest(place, 0.0, self._lengths[-1], yaw_rad)[0]

    def mark_m(self, along_m: float) -> float:
        """How far along the team's route that is."""
        for index, length in enumerate(self._lengths[1:], 1):
            if along_m <= length or index == len(self._lengths) - 1:
                before = self._lengths[index - 1]
                part = (along_m - before) / (length - before) if length > before else 1.0
                a, b = self._marks[index - 1], self._marks[index]
                return a + (b - a) * min(1.0, max(0.0, part))
        return self._marks[0]

    def off_m(self, place: tuple[float, float], along_m: float) -> float:
        """How far a place is from that one of the path."""
        for index, (begin_m, end_m) in enumerate(pairwise(self._lengths)):
            if along_m <= end_m or index == len(self._lengths) - 2:
                a, b = self._places[index], self._places[index + 1]
                part = (along_m - begin_m) / (end_m - begin_m) if end_m > begin_m else 1.0
                return math.dist(place, (a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part))
        return math.dist(place, self._places[0])

    def _nearest(
        self, place: tuple[float, float], from_m: float, to_m: float, yaw_rad: float | None
    ) -> tuple[float, float]:
        """How far along, and how far off."""
        best = (self._lengths[-1] if from_m > 0 else 0.0, math.inf)
        worst = math.inf
        legs = zip(pairwise(self._places), pairwise(self._lengths), strict=True)
        for (a, b), (begin_m, end_m) in legs:
            if end_m < from_m or begin_m > to_m or end_m <= begin_m:
                continue
            length = end_m - begin_m
            along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
            offset = (place[0] - a[0]) * along[0] + (place[1] - a[1]) * along[1]
            low, high = max(0.0, from_m - begin_m), min(length, to_m - begin_m)
            offset = min(high, max(low, offset))
            foot = a[0] + along[0] * offset, a[1] + along[1] * offset
            off_m = math.dist(foot, place)
            seems_m = off_m
            if yaw_rad is not None:
                facing = math.cos(yaw_rad) * along[0] + math.sin(yaw_rad) * along[1]
                seems_m += _WRONG_WAY_M if facing < 0 else 0.0
            if seems_m < worst:
                worst, best = seems_m, (begin_m + offset, off_m)
        return best
