"""A path of straight legs, which may repeat for ever."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from m2pem_plugin_ros.pilot.plane import Place, beyond, turned, yaw_towards

SHORTEST_M = 0.05
"""Waypoints that are nearer to each other are one."""


@dataclass(frozen=True, slots=True)
class Leg:
    """From a place straight to the next."""

    start: Place
    yaw_rad: float
    length_m: float

    def at(self, along_m: float) -> Place:
        """The place so far along, or before or beyond it."""
        return beyond(self.start, self.yaw_rad, along_m)

    def along(self, place: Place) -> float:
        """How far along the leg a place is, if one looks from the side; it may be beyond."""
        return (place[0] - self.start[0]) * math.cos(self.yaw_rad) + (
            place[1] - self.start[1]
        ) * math.sin(self.yaw_rad)


class Path:
    """Legs from the first place through all others; with `lap_from`, from the last one back to the
    place of that number, and round again without an end."""

    def __init__(self, places: Iterable[Place], lap_from: int | None = None) -> None:
        kept: list[Place] = []
        lap = lap_from
        for number, place in enumerate(places):
            if not kept or math.dist(kept[-1], place) >= SHORTEST_M:
                kept.append(place)
            if number == lap_from:
                lap = len(kept) - 1
        self._lap = None
        if lap is not None and len(kept) > lap + 1:
            if math.dist(kept[-1], kept[lap]) >= SHORTEST_M:
                kept.append(kept[lap])
            self._lap = lap
        self.end = kept[-1]
        self._legs = [_leg(start, end) for start, end in pairwise(kept)]
        self.length_m = sum(leg.length_m for leg in self._legs)

    @property
    def repeats(self) -> bool:
        """Whether it has no end."""
        return self._lap is not None

    def leg(self, number: int) -> Leg | None:
        """The leg of a number, counted on through all laps; None: the path has ended."""
        count = len(self._legs)
        if number < count:
            return self._legs[number]
        if self._lap is None:
            return None
        return self._legs[self._lap + (number - self._lap) % (count - self._lap)]

    def turn(self, number: int) -> float:
        """By how much one turns after a leg, 0 to pi; 0 at the end."""
        leg, after = self.leg(number), self.leg(number + 1)
        return 0.0 if leg is None or after is None else abs(turned(leg.yaw_rad, after.yaw_rad))


def _leg(start: Place, end: Place) -> Leg:
    return Leg(start, yaw_towards(start, end), math.dist(start, end))
