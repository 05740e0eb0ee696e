"""Divides what a lost member has left undone among the others, so that all end at the same time."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.remaining import RemainingRoute, RemainingSurvey, RemainingWork, raw_parameters
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import ParameterError, ResolvedValue, resolve
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polyline import Polyline
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.mission.values import Value

ALL_ORDERS_UP_TO = 5
"""So many members are tried in every order; more take what is left in the order of the team."""

SHORTEST_M = 2.0
"""Less than this is left to the neighbour."""

CORNER_S = 5.0
"""About what a vehicle loses at a corner, where it brakes and turns: the way is cut at the corner
where a member would do less than that beyond it."""

_CORNER_RAD = math.radians(45)

_ROUNDS = 4
"""The way to a piece depends on where it begins, and that on the pieces before it."""


def read_parameters(behavior: str, raw: Mapping[str, Value]) -> dict[str, ResolvedValue] | None:
    """Return what an arbiter has said that is left; None: it is of no shared behavior."""
    spec = SHARED.get((behavior, BehaviorType.VEHICLE))
    try:
        return None if spec is None else resolve(spec, raw, lambda _: None, ())
    except ParameterError:
        return None


def work_of(
    behavior: str, parameters: Mapping[str, ResolvedValue], frame: LocalFrame
) -> RemainingWork | None:
    """Return the way of a part of a team behavior; None: it is neither a route nor a survey."""
    raw, given = raw_parameters(parameters), BehaviorParameters(parameters)
    if behavior == "single_vehicle_routing" and given.route is not None:
        # A team goes at its own speed: `m2pem check` says that it ignores those of waypoints.
        route = replace(given.route, speeds_m_s=())
        return RemainingRoute(raw, route, frame)
    if behavior != "area_survey" or given.area is None:
        return None
    area = given.area
    rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings]
    try:
        tracks = SurveyTracks.over(rings, given.spacing_m, given.yaw_rad, given.overshoot_m)
    except ValueError:
        return None
    return RemainingSurvey(raw, tracks, frame, area.rings[0][0][2], area.altitude_frame)


def from_nearer_end(
    behavior: str,
    parameters: Mapping[str, ResolvedValue],
    frame: LocalFrame,
    place: EastNorth | None,
) -> Mapping[str, ResolvedValue]:
    """Return the parameters of a part, turned round if it then begins nearer to a place."""
    given = BehaviorParameters(parameters)
    turned = dict(parameters)
    if given.route is not None:
        turned["route"] = Route.of(given.route.waypoints[::-1], given.route.frames[::-1])
    if given.heading_rad is not None:
        turned["heading"] = (given.heading_rad + math.pi) % math.tau
    works = [(each, work_of(behavior, each, frame)) for each in (parameters, turned)]
    return min(
        works, key=lambda each: 0.0 if each[1] is None else _way_m(place, each[1].line.points[0])
    )[0]


@dataclass(frozen=True, slots=True)
class Taker:
    """A member that can take more. `free_s`: in how much time it has done what it has; `place`:
    where it is then, in metres; None: not known."""

    member: ResourceId
    free_s: float
    place: EastNorth | None
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class Piece:
    """What a member takes: the part of a way between two distances."""

    member: ResourceId
    work: int
    from_m: float
    to_m: float


def divide(works: Sequence[RemainingWork], takers: Sequence[Taker]) -> list[Piece]:
    """Return the pieces of ways, so that the last member ends as early as possible.

    The ways are cut where the times are even, or at a corner near there: each member takes what is
    between two cuts, and begins at the end that is nearer.
    """
    if not works:
        return []
    orders: Iterable[Sequence[Taker]] = [takers]
    if len(takers) <= ALL_ORDERS_UP_TO:
        orders = permutations(takers)
    whole_m = sum(work.line.length_m for work in works)
    best = min((_shared(works, order, whole_m) for order in orders), key=lambda found: found[0])
    return _pieces(works, best[1], best[2])


def _shared(
    works: Sequence[RemainingWork], order: Sequence[Taker], whole_m: float
) -> tuple[float, Sequence[Taker], list[float]]:
    """Return when the last member ends, in s, the order, and each one's length."""
    lengths = [whole_m / len(order)] * len(order)
    ready = [taker.free_s for taker in order]
    for _ in range(_ROUNDS):
        begin_m = 0.0
        for index, (taker, length_m) in enumerate(zip(order, lengths, strict=True)):
            corners = _at(works, begin_m), _at(works, begin_m + length_m)
            way_m = min(_way_m(taker.place, corner) for corner in corners)
            ready[index] = taker.free_s + way_m / taker.speed_m_s
            begin_m += length_m
        lengths = _even(ready, [taker.speed_m_s for taker in order], whole_m)
    ends = [
        at_s + length_m / taker.speed_m_s
        for taker, at_s, length_m in zip(order, ready, lengths, strict=True)
        if length_m > 0
    ]
    return max(ends, default=0.0), order, lengths


def _way_m(place: EastNorth | None, end: EastNorth) -> float:
    return 0.0 if place is None else math.dist(place, end)


def _even(ready: Sequence[float], speeds: Sequence[float], whole_m: float) -> list[float]:
    """Return lengths with which all who take any end at the same time."""
    taking = list(range(len(ready)))
    while True:
        end_s = (whole_m + sum(ready[i] * speeds[i] for i in taking)) / sum(
            speeds[i] for i in taking
        )
        late = [i for i in taking if ready[i] >= end_s]
        if not late:
            break
        taking = [i for i in taking if i not in late]
    return [
        max(0.0, end_s - ready[i]) * speeds[i] if i in taking else 0.0 for i in range(len(ready))
    ]


def _at(works: Sequence[RemainingWork], along_m: float) -> EastNorth:
    for work in works:
        if along_m < work.line.length_m:
            return work.line.at(along_m)
        along_m -= work.line.length_m
    return works[-1].line.points[-1]


def _cut_m(line: Polyline, even_m: float, near_m: float) -> float:
    """Return the nearest corner along a way if one is near; else where the times are even."""
    corners_m = [
        mark_m
        for mark_m, (before, after) in zip(line.marks_m[1:], pairwise(line.segments), strict=False)
        if abs(math.remainder(after.yaw_rad - before.yaw_rad, math.tau)) > _CORNER_RAD
    ]
    found_m = min(corners_m, key=lambda each: abs(each - even_m), default=even_m)
    return found_m if abs(found_m - even_m) < near_m else even_m


def _pieces(
    works: Sequence[RemainingWork], order: Sequence[Taker], lengths: Sequence[float]
) -> list[Piece]:
    pieces: list[Piece] = []
    ends = [sum(lengths[: index + 1]) for index in range(len(lengths))]
    before_m = 0.0
    for number, work in enumerate(works):
        after_m = before_m + work.line.length_m
        cuts = [0.0]
        takers: list[Taker] = []
        for taker, end_m in zip(order, ends, strict=True):
            cut_m = _cut_m(work.line, min(end_m, after_m) - before_m, CORNER_S * taker.speed_m_s)
            if work.line.length_m - cut_m < SHORTEST_M:
                cut_m = work.line.length_m
            if cut_m - cuts[-1] >= SHORTEST_M:
                cuts.append(cut_m)
                takers.append(taker)
        if takers:
            cuts[-1] = work.line.length_m
        else:
            takers, cuts = [order[-1]], [0.0, work.line.length_m]
        pieces += [
            Piece(taker.member, number, from_m, to_m)
            for taker, from_m, to_m in zip(takers, cuts, cuts[1:], strict=False)
        ]
        before_m = after_m
    return pieces
