"""How much of an area was surveyed, and how much twice, by where vehicles were."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypeAlias

Sample: TypeAlias = tuple[float, float, float]
"""Time in s, east and north in m."""

CELL_M = 1.0
STEP_M = 0.5
ASIDE_M = 3.0
PARALLEL_RAD = math.radians(15)
"""A vehicle surveys while it moves along a pass, not on the way to another one."""


@dataclass
class Coverage:
    """A rectangle from the origin, with passes of one width along its east side.

    `passes`: how many passes have covered each cell of a metre.
    """

    east_m: float
    north_m: float
    width_m: float
    passes: dict[tuple[int, int], int] = field(default_factory=dict)

    def add(self, track: Sequence[Sample]) -> float:
        """Add where one vehicle was, in order. Return how long it surveyed, in m."""
        seen: set[tuple[int, int]] = set()
        length_m = 0.0
        for (_, ae, an), (_, be, bn) in pairwise(track):
            step_m = math.dist((ae, an), (be, bn))
            if step_m < 1e-3:
                continue
            along = abs(math.remainder(math.atan2(bn - an, be - ae), math.pi)) <= PARALLEL_RAD
            if not (along and self._on_a_pass(an) and self._on_a_pass(bn)):
                self._count(seen)
                continue
            length_m += step_m
            steps = max(1, math.ceil(step_m / STEP_M))
            for step in range(steps + 1):
                share = step / steps
                self._see(seen, ae + (be - ae) * share, an + (bn - an) * share)
        self._count(seen)
        return length_m

    def _on_a_pass(self, north_m: float) -> bool:
        return abs(math.remainder(north_m - self.width_m / 2, self.width_m)) <= ASIDE_M

    def _see(self, seen: set[tuple[int, int]], east_m: float, north_m: float) -> None:
        column = math.floor(east_m / CELL_M)
        if not 0 <= column < self.east_m / CELL_M:
            return
        first = math.ceil((north_m - self.width_m / 2) / CELL_M - 0.5)
        last = math.floor((north_m + self.width_m / 2) / CELL_M - 0.5)
        for row in range(max(0, first), min(last, math.ceil(self.north_m / CELL_M) - 1) + 1):
            seen.add((column, row))

    def _count(self, seen: set[tuple[int, int]]) -> None:
        for cell in seen:
            self.passes[cell] = self.passes.get(cell, 0) + 1
        seen.clear()

    @property
    def cells(self) -> int:
        """The number of cells of the area."""
        return math.ceil(self.east_m / CELL_M) * math.ceil(self.north_m / CELL_M)

    @property
    def covered(self) -> float:
        """The share of the area that was surveyed."""
        return len(self.passes) / self.cells

    @property
    def twice(self) -> float:
        """The share of the area that was surveyed more than once."""
        return sum(count > 1 for count in self.passes.values()) / self.cells


def optimum_s(left_m: float, speeds_m_s: Sequence[float], way_s: float) -> float:
    """Return the least time in which members survey what is left.

    `left_m`: the passes that are left, of all members. `speeds_m_s`: of those that go on, with
    their turns. `way_s`: from a member's band to what it takes over.
    """
    return left_m / sum(speeds_m_s) + way_s
