"""A path of straight legs, and the progress of a vehicle along it. A path may repeat."""

import math
from collections.abc import Iterable, Iterator, Sequence

from m2pem.api import Polyline, Segment
from m2pem_plugin_ros.behaviors.motion_state import Place, angle_between

SHORTEST_M = 0.05
"""Waypoints closer to each other than this count as one."""


class Path:
    """Legs through all positions. With `lap_from`, the path returns from its end to the position of
    that index, and repeats from there."""

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
        line = Polyline(kept)
        self._legs, self.length_m = line.segments, line.length_m

    @property
    def repeats(self) -> bool:
        return self._lap is not None

    def leg(self, number: int) -> Segment | None:
        """Return the leg with an index, counted through all laps; None after the end of the
        path."""
        count = len(self._legs)
        if number < count:
            return self._legs[number]
        if self._lap is None:
            return None
        return self._legs[self._lap + (number - self._lap) % (count - self._lap)]

    def turn(self, number: int) -> float:
        """Return the angle between a leg and the next one, 0 to pi; 0 at the end."""
        leg, after = self.leg(number), self.leg(number + 1)
        return (
            0.0 if leg is None or after is None else abs(angle_between(leg.yaw_rad, after.yaw_rad))
        )


PASSED_M = 0.15
"""A vehicle this close to a sharp corner has reached it."""


class Progress:
    """The progress along a path. A corner of more than `sharp_rad` must be reached before later
    legs are considered."""

    def __init__(self, path: Path, sharp_rad: float) -> None:
        self.path = path
        self._sharp_rad = sharp_rad
        self._number = 0
        self._along_m = 0.0
        self._before_m = 0.0

    @property
    def driven_m(self) -> float:
        """The distance from the start of the path, along it."""
        return self._before_m + self._along_m

    @property
    def leg(self) -> Segment | None:
        """The current leg; None if the path has none."""
        return self.path.leg(self._number)

    def is_sharp(self, number: int) -> bool:
        """Whether the corner after a leg is sharp."""
        return self.path.turn(number) > self._sharp_rad

    def ahead(self) -> Iterator[tuple[int, Segment, float, float]]:
        """Yield the legs from here on: index, leg, distance along it at which it begins, and
        distance from here. A path that repeats has no end."""
        number, begin, away = self._number, self._along_m, 0.0
        while (leg := self.path.leg(number)) is not None:
            yield number, leg, begin, away
            away += leg.length_m - begin
            number, begin = number + 1, 0.0

    def advance(self, place: Place, window_m: float) -> None:
        """Advance to the nearest point of the path to a position, at most `window_m` ahead."""
        self._go_to_nearest(place, window_m, over_corners=False)
        if self.is_sharp(self._number):
            leg = self.path.leg(self._number)
            if leg is not None and leg.length_m - self._along_m <= PASSED_M:
                self._go_to(self._number + 1, 0.0)

    def find_again(self, place: Place, window_m: float) -> None:
        """Search the nearest point of the path within `window_m`, ahead or behind, after a jump of
        the pose."""
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
        """Return the point at a distance ahead. It lies straight on before a sharp corner and at
        the end."""
        left, point = distance_m, self.path.end
        for number, leg, begin, _ in self.ahead():
            point = leg.at(begin + left)
            left -= leg.length_m - begin
            if left <= 0 or self.is_sharp(number):
                break
        return point

    @property
    def left_m(self) -> float:
        """The distance to the end of the path; infinite if it repeats."""
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
"""A later leg must be nearer by this distance, so that no leg is skipped by chance."""


def next_waypoint(places: Sequence[Place], here: Place, within_m: float) -> int | None:
    """Return the index of the waypoint that comes next for a vehicle that stands at `here`.

    Return None if that is ambiguous: the route passes farther away than `within_m`, or more than
    once.
    """
    away = [leg.distance_m(here) for leg in Polyline(places).segments]
    near = [number for number, distance_m in enumerate(away) if distance_m <= within_m]
    if not near or near[-1] - near[0] >= len(near):
        return None
    found = near[0]
    for number in near:
        if away[number] < away[found] - NEARER_M:
            found = number
    return found + 1
