"""Plans of teams that move along a route in a shape, all at once or one after the other."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from m2pem.fleet.parameters import read_offsets
from m2pem.geo.fence import Fence
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.geo.polyline import EastNorthUp, Polyline, Segment
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.teams.clearance import NEAREST_SHARE, Clearance
from m2pem.teams.paths import SHAPES, SPACING_M, MemberPath, beside, lane, lead_around, slot
from m2pem.teams.plan import (
    NO_MEETING,
    Leg,
    March,
    Marcher,
    Meeting,
    MemberPose,
    Motion,
    Plan,
    PlanningContext,
    TeamRefusedError,
)

GAP_SHARE = 0.5
"""Share of the spacing: the minimum distance of members in one lane, along the route."""

HEADROOM_SHARE = 0.4
"""Share of the spacing that the stopping distance may take, to avoid frequent braking."""

_AROUND_SHARE = 0.9
"""Share of the spacing at which members go around others that wait."""

_SAME_PLACE_M = 0.01
_LOOKS = 10_000

_LEAST_SHARE = 0.8
"""Share of the spacing: the minimum distance of members in the plane."""

_FARTHER_BACK_SHARE = 2.0
"""Share of the spacing: so much farther back than in the formation may a member end."""


def march(context: PlanningContext, default_shape: str) -> Plan:
    """Move together in a shape; without a route, form up on the lead."""
    shape, spacing, places = _formation(context, default_shape)
    route = context.parameters.route
    if route is None:
        return Plan(_forming_up(context, places, chained=False))
    ways, in_order = _ways(context, route, places, spacing)
    marchers = tuple(way.marcher(context.motion(way.member)) for way in ways)
    speed = _march_speed(context, marchers, spacing)
    legs = tuple(way.leg(context, speed, None) for way in ways)
    closes = shape == "column"
    return Plan(legs, March(marchers, spacing, speed, closes, in_order))


def one_by_one(context: PlanningContext) -> Plan:
    """Let each member set off when the member before it has arrived, and stop behind it."""
    _, spacing, places = _formation(context, "column")
    route = context.parameters.route
    if route is None:
        return Plan(_forming_up(context, places, chained=True))
    ways = _ways_in_order(context, route, places, spacing)
    befores: list[ResourceId | None] = [None, *(way.member for way in ways)]
    speed_m_s = context.parameters.speed_m_s
    return Plan(
        tuple(way.leg(context, speed_m_s, after) for way, after in zip(ways, befores, strict=False))
    )


_REMEDY = (
    "draw a wider turn, or the way back beside the way there; or set a smaller spacing; or command "
    "the members one after the other"
)


def turns(context: PlanningContext, behavior: str, least_m: float) -> Meeting:
    """Say where a route brings members too near to each other, and what would be right.

    The members come from their places behind the beginning of the route. `least_m`: the fleet's
    separation.
    """
    route, (_, spacing, places) = context.parameters.route, _formation(context, SHAPES[behavior])
    if route is None or len(context.members) < 2:
        return NO_MEETING
    if (apart_m := _LEAST_SHARE * spacing) < least_m:
        name = "offsets" if context.parameters.text("offsets") else "spacing"
        said = f"parameter '{name}': members come within {apart_m:g} m of each other, below the "
        return f"{said}fleet's separation of {least_m:g} m", "set a larger spacing", None
    context = _formed_up(context, route, places)
    find = _ways_in_order if behavior == "bridge_crossing" else _ways
    try:
        find(context, route, places, spacing)
    except TeamRefusedError as error:
        return str(error), "", error.place
    distance_m, place, text = _meeting(context, _drawn(context, route, places))
    if distance_m >= GAP_SHARE * spacing or behavior == "bridge_crossing":
        return NO_MEETING
    remedy = f"the members pass it one after the other, or else {_REMEDY}"
    return f"{text} if they kept their spacing along it", remedy, place


def lanes(context: PlanningContext, behavior: str) -> Mapping[ResourceId, Sequence[LatLon]]:
    """Return the corners of each member's way along the route, without its way to the route.

    Raises:
        TeamRefusedError: the members cannot move along it.
    """
    route, (_, spacing, places) = context.parameters.route, _formation(context, SHAPES[behavior])
    if route is None or not context.members:
        return {}
    ways, _ = _ways(_formed_up(context, route, places), route, places, spacing)
    return {way.member: way.corners(context.frame) for way in ways}


def _formed_up(
    context: PlanningContext, route: Route, places: Sequence[tuple[float, float]]
) -> PlanningContext:
    """Return the context with the members in their places behind the beginning of the route."""
    start, then = (context.level(each) for each in _apart(context, route)[:2])
    yaw_rad, first_m = Segment.between(start, then).yaw_rad, min(back for back, _ in places)
    poses = {
        member: MemberPose(beside(start, yaw_rad, back - first_m + 1.0, left)[:2])
        for member, (back, left) in zip(context.members, places, strict=False)
    }
    return replace(context, poses=poses)


def lane_mates(a: Marcher, b: Marcher, spacing_m: float) -> bool:
    return abs(a.left_m - b.left_m) < spacing_m / 2


class _Way:
    """A member's route: the team's, shifted sideways and shortened by its distance behind.

    `begin`: where it comes from; None: it is on the route.
    """

    def __init__(
        self,
        member: ResourceId,
        route: Sequence[EastNorthUp],
        place: tuple[float, float],
        begin: EastNorth | None,
        fence: Fence,
    ) -> None:
        self.member, self._begin, self._fence = member, begin, fence
        self._around: Fence | None = None
        self._back_m, self._left_m = place
        self._route = route
        self._route_marks_m = Polyline(each[:2] for each in route).marks_m
        self._end_at(self._route_marks_m[-1] - self._back_m)

    def _end_at(self, mark_m: float) -> None:
        places = lane(self._route, self._route_marks_m[-1] - mark_m, self._left_m)
        marks_m = [*self._route_marks_m[: len(places) - 1], mark_m]
        self._mark_m, self.alone = mark_m, len(places) == 1
        self.lane = MemberPath(places * (1 + self.alone), marks_m * (1 + self.alone))
        self.path = self.lane
        if self._begin is not None:
            places = [(*self._begin, places[0][2]), *places]
            first_m = marks_m[0] - math.dist(places[0][:2], places[1][:2])
            self.path = MemberPath(places, [first_m, *marks_m])
            if self._around and (led := lead_around(places, self._around)):
                self.path = self.path.onward(led)
                self.alone = self.alone and len(led) == 2

    def lead_around(
        self, waiting: Sequence[EastNorth], spacing_m: float, context: PlanningContext
    ) -> None:
        """Lead it around where others wait, as far from them as where it begins and ends."""
        ends = context.poses[self.member].place, self.path.places[-1][:2]
        discs = []
        for place in waiting:
            nearest_m = min(math.dist(place, end) for end in ends)
            radius_m = min(_AROUND_SHARE * spacing_m, nearest_m - _SAME_PLACE_M)
            discs.append(shapely.Point(place).buffer(radius_m))
        # A route that leaves the fence is refused by the arbiters, and not led around its holes.
        leaves = self._fence.leaves([each[:2] for each in self.lane.places])
        self._around = (Fence.around(()) if leaves else self._fence).apart_from(discs)
        self._end_at(self._mark_m)

    def marcher(self, motion: Motion, *, begins: bool = True) -> Marcher:
        """The member on its path; or on that without its way to the route."""
        path = self.path if begins else self.lane
        return Marcher(self.member, path, self._back_m, self._left_m, motion, self._fence)

    def corners(self, frame: LocalFrame) -> list[LatLon]:
        return [frame.to_latlon(place[:2]) for place in self.lane.places]

    def shorten(self, by_m: float) -> None:
        """Let it end so much earlier, or a little more."""
        self._end_at(self._mark_m - by_m - _SAME_PLACE_M)

    def leg(
        self, context: PlanningContext, speed_m_s: float | None, after: ResourceId | None
    ) -> Leg:
        route = context.parameters.route
        if self.alone or route is None:
            return context.to_place(self.member, self.path.places[-1], after=after)
        high = all(each[2] is not None for each in route.waypoints)
        waypoints = tuple(
            context.coordinate(place, place[2] if high else None)
            for place in self.path.places[self._begin is not None :]
        )
        parameters = {"route": Route(waypoints, route.altitude_frame), "speed": speed_m_s}
        return context.leg(self.member, "single_vehicle_routing", parameters, after)


def _formation(
    context: PlanningContext, default: str
) -> tuple[str, float, list[tuple[float, float]]]:
    """Return the shape, the spacing, and each member's place: metres behind the lead, and left."""
    parameters, count = context.parameters, len(context.members)
    text = parameters.text("offsets")
    if not text:
        shape, spacing_m = parameters.text("shape") or default, parameters.spacing_m or SPACING_M
        slots = (slot(shape, index) for index in range(count))
        return shape, spacing_m, [(back * spacing_m, left * spacing_m) for back, left in slots]
    doubled = [name for name in ("shape", "spacing") if name in parameters]
    if doubled:
        raise TeamRefusedError(f"parameter 'offsets': it says what '{doubled[0]}' says, too")
    places = [(0.0, 0.0), *read_offsets(text)]
    if len(places) < max(2, count):
        raise TeamRefusedError(
            f"parameter 'offsets': there are {len(places) - 1} for {count - 1} members after the "
            "lead"
        )
    places = places[: max(2, count)]
    return "", min(math.dist(a, b) for a, b in combinations(places, 2)), places


def _ways(
    context: PlanningContext, route: Route, offsets: Sequence[tuple[float, float]], spacing_m: float
) -> tuple[list[_Way], bool]:
    """Return the members' ways, and whether they set off in their order: where they are in each
    other's ways else.

    Raises:
        TeamRefusedError: there are none, because of the route, or of where they begin.
    """
    ways = _drawn(context, route, offsets)
    try:
        _keep_ends_apart(context, ways, spacing_m, in_order=False)
    except _StuckError as stuck:
        formed_up = _formed_up(context, route, offsets)
        _keep_ends_apart(formed_up, _drawn(formed_up, route, offsets), spacing_m, in_order=False)
        try:
            return _ways_in_order(context, route, offsets, spacing_m), True
        except _StuckError:
            raise TeamRefusedError(f"{stuck.member} {_NO_WAY}", stuck.place) from None
    return ways, False


def _ways_in_order(
    context: PlanningContext, route: Route, offsets: Sequence[tuple[float, float]], spacing_m: float
) -> list[_Way]:
    """Return ways around those that have not set off, and those that have arrived."""
    ways = _drawn(context, route, offsets)
    if not context.begun:
        begins = [context.poses[way.member].place for way in ways]
        ends = [way.lane.places[-1][:2] for way in ways]
        for index, way in enumerate(ways):
            way.lead_around([*ends[:index], *begins[index + 1 :]], spacing_m, context)
    _keep_ends_apart(context, ways, spacing_m, in_order=True)
    return ways


def _drawn(
    context: PlanningContext, route: Route, offsets: Sequence[tuple[float, float]]
) -> list[_Way]:
    if route.altitude_frames and context.parameters.altitude_m is None:
        raise TeamRefusedError(
            "parameter 'route': the altitudes of its waypoints count from different heights, which "
            "a formation cannot keep: set 'altitude'"
        )
    places = [(*context.level(each), each[2] or 0.0) for each in _apart(context, route)]
    return [
        _Way(member, places, offset, context.begin(member), context.fence(member))
        for member, offset in zip(context.members, offsets, strict=False)
    ]


_NO_WAY = (
    "cannot come to its place in the formation: it and others are in each other's ways; let the"
    " members begin in the formation's order (a goto for each before), or name them in another one"
)


class _StuckError(TeamRefusedError):
    """A member cannot get to its end."""

    def __init__(self, text: str, place: LatLon, member: ResourceId) -> None:
        super().__init__(text, place)
        self.member = member


def _keep_ends_apart(
    context: PlanningContext, ways: Sequence[_Way], spacing_m: float, *, in_order: bool
) -> None:
    """Let members end earlier that would come too near to those at their ends.

    Raises:
        _StuckError: one of them would not get to the end of the route, or near it.
    """
    short_m = max(context.motion(way.member).short_m(context.speed()) for way in ways)
    farther_m = [0.0 for _ in ways]
    shorter = True
    while shorter:
        marchers = [way.marcher(context.motion(way.member)) for way in ways]
        clearance = Clearance(marchers, NEAREST_SHARE * spacing_m, in_order)
        ends_m = [each.path.line.length_m for each in marchers]
        shorter = False
        for index, at_m in enumerate(clearance.reached_m([0.0] * len(ways), ends_m, short_m)):
            way, by_m = ways[index], ends_m[index] - at_m
            farther_m[index] += by_m
            too_far = farther_m[index] > _FARTHER_BACK_SHARE * spacing_m
            if not context.begun and too_far:
                _, place, text = _meeting(context, ways)
                text = f"{text}, and {way.member} cannot wait until it is free: {_REMEDY}"
                raise _StuckError(text, place, way.member)
            if by_m and not too_far:
                way.shorten(by_m)
                shorter = True


def _meeting(context: PlanningContext, ways: Sequence[_Way]) -> tuple[float, LatLon, str]:
    """Return how near a formation brings two of its members, the corner there, and a text."""
    marchers = [way.marcher(context.motion(way.member), begins=False) for way in ways]
    marchers.sort(key=lambda each: each.back_m)
    ends_m = [each.back_m + mark_m for each in marchers for mark_m in each.path.marks_m]
    lead_m = np.linspace(min(ends_m), max(ends_m), _LOOKS)
    tracks = [
        np.interp(lead_m - each.back_m, each.path.marks_m, axis, math.nan, math.nan)
        for each in marchers
        for axis in np.transpose(each.path.places)[:2]
    ]
    found = []
    for first, other in combinations(range(len(marchers)), 2):
        east, north = (tracks[2 * first + axis] - tracks[2 * other + axis] for axis in (0, 1))
        apart_m = np.nan_to_num(np.hypot(east, north), nan=math.inf)
        found.append((float(apart_m.min()), int(apart_m.argmin()), first, other))
    distance_m, at, *pair = min(found)
    east, north = (sum(tracks[2 * each + axis][at] for each in pair) / 2 for axis in (0, 1))
    path = marchers[pair[0]].path.places
    corner = min(path[1:-1] or path, key=lambda each: math.dist(each[:2], (east, north)))
    place = context.frame.to_latlon(corner[:2])
    names = " and ".join(marchers[each].member for each in pair)
    text = f"[{place[0]:.6f}, {place[1]:.6f}] {names} would come within {distance_m:.1f} m"
    return distance_m, place, f"parameter 'route': at {text} of each other"


def _apart(context: PlanningContext, route: Route) -> list[tuple[float, float, float | None]]:
    """Return the waypoints without repetitions; a route of one point begins at the lead."""
    kept = [route.waypoints[0]]
    for waypoint in route.waypoints[1:]:
        if math.dist(context.level(waypoint), context.level(kept[-1])) > _SAME_PLACE_M:
            kept.append(waypoint)
    if len(kept) == 1:
        lead = context.members[0]
        here = context.poses[lead].place
        if math.dist(here, context.level(kept[0])) <= 1.0:
            raise TeamRefusedError("parameter 'route': it is one place, and the lead is there")
        kept.insert(0, context.coordinate(here, kept[0][2]))
    return kept


def _march_speed(context: PlanningContext, marchers: Sequence[Marcher], spacing_m: float) -> float:
    """Return the requested speed, limited so that each member can stop behind the one ahead."""
    speed = context.speed()
    for index, marcher in enumerate(marchers):
        for other in marchers[:index]:
            if lane_mates(marcher, other, spacing_m):
                gap_m = abs(marcher.back_m - other.back_m)
                headroom_m = gap_m - (1 - HEADROOM_SHARE) * spacing_m
                speed = min(speed, marcher.motion.safe_m_s(headroom_m))
    return speed


def _forming_up(
    context: PlanningContext, places: Sequence[tuple[float, float]], *, chained: bool
) -> tuple[Leg, ...]:
    lead, *others = context.members
    stand = context.poses[lead]
    if stand.yaw_rad is None:
        raise TeamRefusedError(f"the heading of {lead} is not known, on which the others form up")
    legs: list[Leg] = []
    for index, member in enumerate(others, 1):
        back, left = places[index]
        place = beside(stand.place, stand.yaw_rad, back, left)
        after = others[index - 2] if chained and index > 1 else None
        legs.append(context.to_place(member, place, after=after))
    return tuple(legs)
