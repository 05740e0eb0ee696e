"""Rounding the corners of a route: waypoints in, straight pieces and bends out."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias, Union

from m2pem.simulation.phases import Vector

SHARPEST_BEND_RAD = math.radians(150)
"""A sharper turn is made on the spot."""

FARTHEST_MISS_M = 3.5
"""A bend passes its waypoint no farther off: the sharper the corner, the tighter the bend."""

SMALLEST_RADIUS_M = 0.5
_NOTHING_M = 1e-3


@dataclass(frozen=True, slots=True)
class Line:
    """A straight piece."""

    start: Vector
    end: Vector

    @property
    def level_m(self) -> float:
        """Length on the map."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def climb_m(self) -> float:
        """Difference of height."""
        return self.end[2] - self.start[2]

    @property
    def length_m(self) -> float:
        """Length in space."""
        return math.hypot(self.level_m, self.climb_m)

    @property
    def yaw_rad(self) -> float:
        """Direction on the map, from east counter-clockwise."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def point(self, level_m: float) -> Vector:
        """The point that far from the start on the map."""
        part = level_m / self.level_m
        return (
            self.start[0] + (self.end[0] - self.start[0]) * part,
            self.start[1] + (self.end[1] - self.start[1]) * part,
            self.start[2] + self.climb_m * part,
        )


@dataclass(frozen=True, slots=True)
class Bend:
    """An arc around `centre`; `sweep_rad` is counter-clockwise."""

    centre: tuple[float, float]
    radius_m: float
    angle_rad: float
    sweep_rad: float
    up_m: float
    climb_m: float

    @property
    def level_m(self) -> float:
        """Length on the map."""
        return self.radius_m * abs(self.sweep_rad)

    @property
    def length_m(self) -> float:
        """Length in space."""
        return math.hypot(self.level_m, self.climb_m)


Piece: TypeAlias = Union[Line, Bend]


def turned(start_rad: float, end_rad: float) -> float:
    """The short way from one direction to the other, in -pi to pi."""
    return math.remainder(end_rad - start_rad, math.tau)


def rounded(points: list[Vector], radius_m: float) -> list[list[Piece]]:
    """Runs of pieces that are driven without a stop, through `points`.

    A corner gets a bend of `radius_m`, smaller where the legs are short. Between two runs the
    vehicle stops and turns: at sharp corners, and where a leg goes straight up or down.
    """
    legs = [Line(a, b) for a, b in pairwise(points) if math.dist(a, b) > _NOTHING_M]
    runs: list[list[Piece]] = [[]]
    for index, leg in enumerate(legs):
        start = leg.start
        if index:
            bend, cut_m = _bend(legs[index - 1], leg, radius_m)
            if bend is not None:
                runs[-1].append(bend)
                start = leg.point(cut_m)
            elif cut_m < 0:
                runs.append([])
        end = leg.end
        if index + 1 < len(legs):
            bend, cut_m = _bend(leg, legs[index + 1], radius_m)
            if bend is not None:
                end = leg.point(leg.level_m - cut_m)
        if math.dist(start, end) > _NOTHING_M:
            runs[-1].append(Line(start, end))
    return [run for run in runs if run]


def _bend(before: Line, after: Line, radius_m: float) -> tuple[Bend | None, float]:
    """The bend between two legs and how much it cuts off each; no bend and -1: stop and turn."""
    if before.level_m < _NOTHING_M or after.level_m < _NOTHING_M:
        return None, -1.0
    sweep = turned(before.yaw_rad, after.yaw_rad)
    if abs(sweep) < 1e-6:
        return None, 0.0
    tangent = math.tan(abs(sweep) / 2)
    radius_m = min(radius_m, FARTHEST_MISS_M / (1 / math.cos(sweep / 2) - 1 + 1e-9))
    cut_m = min(radius_m * tangent, before.level_m / 2, after.level_m / 2)
    radius_m = cut_m / tangent
    if abs(sweep) > SHARPEST_BEND_RAD or radius_m < SMALLEST_RADIUS_M:
        return None, -1.0
    start, end = before.point(before.level_m - cut_m), after.point(cut_m)
    aside = before.yaw_rad + math.copysign(math.pi / 2, sweep)
    centre = (start[0] + radius_m * math.cos(aside), start[1] + radius_m * math.sin(aside))
    return Bend(centre, radius_m, aside + math.pi, sweep, start[2], end[2] - start[2]), cut_m
