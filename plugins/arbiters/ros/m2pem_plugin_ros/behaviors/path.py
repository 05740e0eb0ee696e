"""A path of straight legs, which may repeat for ever."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from m2pem_plugin_ros.behaviors.motion_state import Place, beyond, turned, yaw_towards

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


PASSED_M = 0.15
"""Who is so near before a sharp corner has reached it."""


class Progress:
    """Along a path, on which corners of more than `sharp_rad` are driven to before what is after
    them is looked at."""

    def __init__(self, path: Path, sharp_rad: float) -> None:
        self.path = path
        self._sharp_rad = sharp_rad
        self._number = 0
        self._along_m = 0.0
        self._before_m = 0.0

    @property
    def driven_m(self) -> float:
        """From the path's beginning, along it."""
        return self._before_m + self._along_m

    @property
    def leg(self) -> Leg | None:
        """The one that it is on; None for a path without any."""
        return self.path.leg(self._number)

    def is_sharp(self, number: int) -> bool:
        """Whether the corner after a leg is."""
        return self.path.turn(number) > self._sharp_rad

    def ahead(self) -> Iterator[tuple[int, Leg, float, float]]:
        """The legs from here on, without end if the path repeats: number, leg, how far along it one
        begins, and how far away that is along the path."""
        number, begin, away = self._number, self._along_m, 0.0
        while (leg := self.path.leg(number)) is not None:
            yield number, leg, begin, away
            away += leg.length_m - begin
            number, begin = number + 1, 0.0

    def advance(self, place: Place, window_m: float) -> None:
        """Go on to the point of the path, at most `window_m` ahead, that is nearest to a place."""
        self._go_to_nearest(place, window_m, over_corners=False)
        if self.is_sharp(self._number):
            leg = self.path.leg(self._number)
            if leg is not None and leg.length_m - self._along_m <= PASSED_M:
                self._go_to(self._number + 1, 0.0)

    def find_again(self, place: Place, window_m: float) -> None:
        """The vehicle is elsewhere than was thought: the nearest point within `window_m` of the
        path, ahead or behind, is where it goes on."""
        back = window_m
        while self._number > 0 and back > self._along_m:
            back -= self._along_m
            leg = self.path.leg(self._number - 1)
            if leg is None:
                break
            self._number -= 1
            self._before_m -= leg.length_m
            self._along_m = leg.length_m
        self._along_m = max(0.0, self._along_m - back)
        self._go_to_nearest(place, 2 * window_m, over_corners=True)

    def point_ahead(self, distance_m: float) -> Place:
        """The point so far ahead; before a sharp corner and at the end, straight on."""
        left, point = distance_m, self.path.end
        for number, leg, begin, _ in self.ahead():
            point = leg.at(begin + left)
            left -= leg.length_m - begin
            if left <= 0 or self.is_sharp(number):
                break
        return point

    @property
    def left_m(self) -> float:
        """To the end, along the path; infinite if it repeats."""
        if self.path.repeats:
            return math.inf
        return self.path.length_m - self.driven_m

    def _go_to_nearest(self, place: Place, window_m: float, over_corners: bool) -> None:
        nearest, found = math.inf, None
        for number, leg, begin, away in self.ahead():
            if away > window_m:
                break
            end = min(leg.length_m, begin + window_m - away)
            along = max(begin, min(end, leg.along(place)))
            distance = math.dist(leg.at(along), place)
            if distance < nearest - 1e-9:
                nearest, found = distance, (number, along)
            if self.is_sharp(number) and not over_corners:
                break
        if found is not None:
            self._go_to(*found)

    def _go_to(self, number: int, along_m: float) -> None:
        while self._number < number:
            leg = self.path.leg(self._number)
            self._before_m += leg.length_m if leg is not None else 0.0
            self._number += 1
        self._along_m = along_m


NEARER_M = 0.5
"""A later leg must be nearer by so much than one before it: nothing is left out by chance."""


def next_waypoint(places: Sequence[Place], here: Place, within_m: float) -> int | None:
    """The number of the waypoint that comes next.

    None: nobody can tell, as the route does not come by within `within_m`, or comes by again
    later on.
    """
    away = [_distance(leg, here) for leg in pairwise(places)]
    near = [number for number, distance_m in enumerate(away) if distance_m <= within_m]
    if not near or near[-1] - near[0] >= len(near):
        return None
    found = near[0]
    for number in near:
        if away[number] < away[found] - NEARER_M:
            found = number
    return found + 1


def _distance(leg: tuple[Place, Place], place: Place) -> float:
    (x, y), end = leg
    east, north = end[0] - x, end[1] - y
    square = east * east + north * north
    share = 0.0 if square == 0.0 else ((place[0] - x) * east + (place[1] - y) * north) / square
    share = max(0.0, min(1.0, share))
    return math.dist((x + share * east, y + share * north), place)
