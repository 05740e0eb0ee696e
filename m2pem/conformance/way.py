"""Which waypoints of a way a vehicle has passed, and how far off it is."""

import math
from collections.abc import Sequence

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import Segment
from m2pem.mission.values import Value


class Way:
    """Waypoints that are passed in their order, in metres of a local frame.

    `loop`: again and again. `anywhere`: the vehicle may be at any place of the way when it is seen
    first, as after a restart.
    """

    def __init__(
        self, points: Sequence[EastNorth], *, loop: bool = False, anywhere: bool = False
    ) -> None:
        self._points = tuple(points)
        self._loop = loop
        self._next = 0
        self._lap = 0
        self._unseen = 0
        self._passed = 0
        self._missed: list[int] = []
        self._nearest_m = math.inf
        self._resync = anywhere
        self._largest_off_m = 0.0
        self._left_m = math.inf
        self._legs: dict[int, Segment] = {}

    @property
    def finished(self) -> bool:
        """Whether the last waypoint was passed."""
        return self._next >= len(self._points)

    @property
    def approaches(self) -> bool:
        """Whether the vehicle has not passed the first waypoint yet."""
        return self._next == 0 and self._lap == 0

    @property
    def around(self) -> Sequence[int]:
        """The indexes of the waypoints between which the vehicle is, and of the one after these."""
        last = len(self._points) - 1
        if self._loop and self._lap and self._next == 0:
            return (last, 0, min(1, last))
        return range(max(0, self._next - 1), min(last, self._next + 1) + 1)

    @property
    def where(self) -> str:
        """The waypoint that comes next, for people."""
        if len(self._points) == 1:
            return "the target"
        return f"waypoint {min(self._next, len(self._points) - 1) + 1}"

    @property
    def done_m(self) -> float:
        """A number that rises as long as the vehicle makes progress."""
        at = self._lap * len(self._points) + self._next
        return 1e6 * at - (self._left_m if math.isfinite(self._left_m) else 1e6)

    def moved(
        self,
        seen_from: EastNorth | None,
        here: EastNorth,
        start: EastNorth,
        reach_m: float,
        off_bound_m: float,
    ) -> float:
        """Take the next place of the vehicle; return how far it is off its way.

        `seen_from`: its last place; None: what was between is not known. `start`: where it began.
        `reach_m`: how near it passes a waypoint. A corner that it has cut counts as passed within
        twice that.
        """
        if seen_from is None and self._resync:
            self._find(here, off_bound_m)
        self._resync = True
        track = None if seen_from is None else Segment.between(seen_from, here)
        for _ in self._points:
            if self.finished:
                break
            point = self._points[self._next]
            away_m = math.dist(here, point) if track is None else track.distance_m(point)
            self._nearest_m = min(self._nearest_m, away_m)
            if away_m > reach_m:
                if not self._has_cut(here, start, reach_m, off_bound_m):
                    break
                if self._nearest_m > 2 * reach_m:
                    self._missed.append(self._next)
                    self._passed -= 1
            self._advance()
        if self.finished:
            return 0.0
        self._left_m = math.dist(here, self._points[self._next])
        off_m = min(leg.distance_m(here) for leg in self._near_legs(start))
        self._largest_off_m = max(self._largest_off_m, off_m)
        return off_m

    def _advance(self) -> None:
        self._passed += 1
        self._nearest_m = math.inf
        self._next += 1
        if self._loop and self._next == len(self._points):
            self._next, self._lap = 0, self._lap + 1

    def _leg(self, index: int, start: EastNorth) -> Segment:
        """The leg to a waypoint."""
        if index == 0 and not (self._loop and self._lap):
            return Segment.between(start, self._points[0])
        leg = self._legs.get(index)
        if leg is None:
            leg = Segment.between(self._points[index - 1], self._points[index])
            self._legs[index] = leg
        return leg

    def _near_legs(self, start: EastNorth) -> list[Segment]:
        legs = [self._leg(self._next, start)]
        if self._next > 0:
            legs.append(self._leg(self._next - 1, start))
        if self._next + 1 < len(self._points):
            legs.append(self._leg(self._next + 1, start))
        return legs

    def _has_cut(
        self, here: EastNorth, start: EastNorth, reach_m: float, off_bound_m: float
    ) -> bool:
        """Whether the vehicle is on the leg after the next waypoint, and off the one to it."""
        if self._next + 1 >= len(self._points):
            return False
        after = self._leg(self._next + 1, start)
        if after.distance_m(here) > off_bound_m or after.along(here) < reach_m:
            return False
        return self._leg(self._next, start).distance_m(here) > off_bound_m

    def _find(self, here: EastNorth, off_bound_m: float) -> None:
        """Find the leg on which the vehicle is after it was not seen for a while; it may have
        passed all waypoints before."""
        last = len(self._points) - 1
        if math.dist(here, self._points[last]) <= off_bound_m and not self._loop:
            found = last
        else:
            offs = [
                (Segment.between(self._points[at - 1], self._points[at]).distance_m(here), at)
                for at in range(max(1, self._next), len(self._points))
            ]
            off_m, found = min(offs, default=(math.inf, 0))
            if off_m > off_bound_m:
                return
        if found > self._next:
            self._unseen += found - self._next
            self._next, self._nearest_m = found, math.inf

    def missing(self) -> str:
        """Return which waypoints were not passed; "": none, or it is not known."""
        count = len(self._points)
        left = [*self._missed, *range(self._next, count)]
        if not left or self._loop:
            return ""
        if count == 1:
            return f"it is {self._left_m:.0f} m from its target"
        names = ", ".join(_ranges([index + 1 for index in left]))
        plural = "waypoints" if len(left) > 1 else "waypoint"
        was = "were" if len(left) > 1 else "was"
        text = f"{plural} {names} of {count} {was} not passed"
        if not self.finished:
            text += f"; it is {self._left_m:.0f} m from waypoint {self._next + 1}"
        return text

    def evidence(self) -> dict[str, Value]:
        """Return what was seen, as values of JSON."""
        seen: dict[str, Value] = {
            "waypoints_passed": self._passed,
            "cross_track_m": round(self._largest_off_m, 1),
        }
        if not self._loop:
            seen["waypoints"] = len(self._points)
        if self._unseen:
            seen["waypoints_unseen"] = self._unseen
        return seen


def _ranges(numbers: Sequence[int]) -> list[str]:
    """Return rising numbers as people write them: 2, 4 to 7."""
    found: list[list[int]] = []
    for number in numbers:
        if found and found[-1][-1] == number - 1:
            found[-1].append(number)
        else:
            found.append([number])
    return [str(run[0]) if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in found]
