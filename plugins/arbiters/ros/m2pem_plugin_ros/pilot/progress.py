"""How far along a path a vehicle is. It never goes back, and never skips to where the path comes by
again later on."""

import math
from collections.abc import Iterator

from m2pem_plugin_ros.pilot.path import Leg, Path
from m2pem_plugin_ros.pilot.plane import Place

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
