"""A member's way along the team's route, and how far along it the member is."""

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

from m2pem.teams.shapes import Vector

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
