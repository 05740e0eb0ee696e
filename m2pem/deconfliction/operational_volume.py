"""The operational volume of a vehicle: polygons with heights from and to, perhaps for a time.

Heights are metres above mean sea level, times seconds since the Unix epoch.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import Hull, buffered_hull, hull_distance_m, near_stretch

NOTHING_M = 0.01
"""Two computations of one place may differ by this."""

OFF_M = 3.0
"""A vehicle that is nearer to its way than this keeps to it."""

REACHED_M = 2.0
"""A vehicle that is nearer to a place of its route than this has reached it."""


@dataclass(frozen=True, slots=True)
class Separation:
    """Two vehicles are never nearer than both distances, or never within `time_s` of each other at
    places that are; None: time does not help."""

    vertical_m: float
    horizontal_m: float
    time_s: float | None = None


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a volume. `area`: None is everywhere. `way`: it is flown from its first place to
    its second, evenly, from `from_s` to `to_s`, and no more than `aside_m` beside; without one,
    all of `area` is taken that long."""

    area: Hull | None
    low_m: float
    high_m: float
    from_s: float = -math.inf
    to_s: float = math.inf
    way: tuple[EastNorth, EastNorth] | None = None
    aside_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Volume:
    """`end_m`: the height that the vehicle keeps afterwards, if it is known. `unknown`: why some of
    it is boundless; "" if nothing is. `route`: the vehicle goes from its first place to the next,
    and so on, no more than `aside_m` beside; (): its way is not known."""

    pieces: tuple[Piece, ...] = ()
    end_m: float | None = None
    unknown: str = ""
    route: tuple[EastNorth, ...] = ()
    aside_m: float = 0.0

    @property
    def timed(self) -> bool:
        """Whether it says when the vehicle is where."""
        return any(piece.way is not None for piece in self.pieces)

    def at_any_time(self) -> "Volume":
        """The same, without saying when."""
        pieces = [replace(each, from_s=-math.inf, to_s=math.inf, way=None) for each in self.pieces]
        return replace(self, pieces=tuple(pieces))

    def after(self, place: EastNorth, stop: Hull, leg: int) -> "Volume":
        """What is left of it: from a place on a leg of its route to the end. `stop`: where the
        vehicle may be by the time at which it has stopped."""
        places = self.route[leg + 1 :]
        ways = [(place, *stop, places[0]), *pairwise(places)]
        pieces = [Piece(buffered_hull(way, self.aside_m), -math.inf, math.inf) for way in ways]
        return replace(self, pieces=tuple(pieces), route=(place, *places))

    def leg_at(self, place: EastNorth, leg: int) -> int:
        """On which leg of the route a vehicle is that was on `leg` before; the first is 0.

        It is on the next one when it has reached the end of its leg, or is past that end and nearer
        to the next leg.
        """
        while leg + 2 < len(self.route):
            begin, end, then = self.route[leg : leg + 3]
            ahead = _dot(end, begin, end, place) >= 0
            past_m, before_m = (
                hull_distance_m((place,), way) for way in ((end, then), (begin, end))
            )
            nearer = past_m < before_m
            if math.dist(place, end) > REACHED_M and not (ahead and nearer):
                break
            leg += 1
        return leg

    def passes(self, place: EastNorth, from_s: float, to_s: float) -> bool:
        """Whether the vehicle is at a place at some time from then to then, if it keeps to it."""
        for piece in self.pieces:
            if piece.to_s < from_s or piece.from_s > to_s:
                continue
            area = piece.area
            if piece.way is not None:
                times = max(from_s, piece.from_s), min(to_s, piece.to_s)
                area = tuple(_on(piece.way, _share(piece, time)) for time in times)
            if hull_distance_m((place,), area) <= piece.aside_m + OFF_M:
                return True
        return False


def too_near(a: Volume, b: Volume, policy: Separation) -> tuple[Piece, Piece] | None:
    """The first two pieces that come nearer than the policy allows; None: none do."""
    for one in a.pieces:
        for other in b.pieces:
            if _near(one, other, policy):
                return one, other
    return None


def _near(a: Piece, b: Piece, policy: Separation) -> bool:
    if max(a.low_m - b.high_m, b.low_m - a.high_m) >= policy.vertical_m - NOTHING_M:
        return False
    reach_m = policy.horizontal_m - NOTHING_M
    if hull_distance_m(a.area, b.area) >= reach_m:
        return False
    if policy.time_s is None:
        return True
    (a_from, a_to), (b_from, b_to) = _when(a, b, reach_m), _when(b, a, reach_m)
    return max(a_from - b_to, b_from - a_to) < policy.time_s


def _when(piece: Piece, other: Piece, reach_m: float) -> tuple[float, float]:
    """From when to when a piece is taken as far as it is within reach of another."""
    stretch = None
    if piece.way is not None and other.area is not None:
        stretch = near_stretch(piece.way, other.area, reach_m + piece.aside_m)
    begin, end = stretch or (0.0, 1.0)  # only just not apart: nothing can be left out
    if (begin, end) == (0.0, 1.0):
        return piece.from_s, piece.to_s
    lasts_s = piece.to_s - piece.from_s
    return piece.from_s + begin * lasts_s, piece.from_s + end * lasts_s


def _dot(start: EastNorth, before: EastNorth, end: EastNorth, place: EastNorth) -> float:
    """Above 0: `place`, seen from `start`, lies in the direction from `before` to `end`."""
    return (end[0] - before[0]) * (place[0] - start[0]) + (end[1] - before[1]) * (
        place[1] - start[1]
    )


def _on(way: tuple[EastNorth, EastNorth], share: float) -> EastNorth:
    (ae, an), (be, bn) = way
    return ae + (be - ae) * share, an + (bn - an) * share


def _share(piece: Piece, time_s: float) -> float:
    lasts_s = piece.to_s - piece.from_s
    return (time_s - piece.from_s) / lasts_s if lasts_s > 0 else 1.0
