"""Which share of a survey's lines a vehicle has covered."""

import math
from collections.abc import Sequence

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import Segment

MAX_PLACES = 4_000
"""Of one survey: the longer it is, the farther apart they are."""


class Coverage:
    """`lines`, in metres of a local frame, are looked at in places at most `reach_m` apart. A place
    is covered when the vehicle passes it within `reach_m`."""

    def __init__(self, lines: Sequence[tuple[EastNorth, EastNorth]], reach_m: float) -> None:
        self._reach_m = reach_m
        segments = [Segment.between(*line) for line in lines]
        length_m = sum(each.length_m for each in segments)
        step_m = max(reach_m, length_m / MAX_PLACES)
        self._cell_m = 2 * reach_m
        self._cells: dict[tuple[int, int], list[EastNorth]] = {}
        self._count = 0
        for segment in segments:
            parts = max(1, math.ceil(segment.length_m / step_m))
            for part in range(parts):
                place = segment.at((part + 0.5) * segment.length_m / parts)
                self._cells.setdefault(self._cell(place), []).append(place)
                self._count += 1
        self._left = self._count
        self._step_m = length_m / self._count if self._count else math.inf
        self._unseen_m = 0.0

    @property
    def share(self) -> float:
        """Of the places that are covered, from 0 to 1; with those that may be while the vehicle was
        not seen."""
        if not self._count:
            return 1.0
        return min(1.0, 1.0 - (self._left - self._unseen_m / self._step_m) / self._count)

    @property
    def entered(self) -> bool:
        """Whether a place was covered."""
        return self._left < self._count

    def moved(self, seen_from: EastNorth | None, here: EastNorth, unseen_m: float = 0.0) -> None:
        """Take the next place of the vehicle. `seen_from`: the last one; None: what was between is
        not known, but it may have been so long."""
        if seen_from is None:
            self._unseen_m += unseen_m
            seen_from = here
        track = Segment.between(seen_from, here)
        (ax, ay), (bx, by) = self._cell(seen_from), self._cell(here)
        for x in range(min(ax, bx) - 1, max(ax, bx) + 2):
            for y in range(min(ay, by) - 1, max(ay, by) + 2):
                places = self._cells.get((x, y))
                if not places:
                    continue
                left = [each for each in places if track.distance_m(each) > self._reach_m]
                self._left -= len(places) - len(left)
                self._cells[x, y] = left

    def _cell(self, place: EastNorth) -> tuple[int, int]:
        return math.floor(place[0] / self._cell_m), math.floor(place[1] / self._cell_m)
