"""Plans of teams that move along a route in a shape, all at once or one after the other."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from m2pem.fleet.parameters import read_offsets
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import EastNorth, LatLon
from m2pem.geo.polyline import EastNorthUp, Polyline, Segment
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.teams.clearance import NEAREST_SHARE, Clearance
from m2pem.teams.paths import SHAPES, SPACING_M, MemberPath, beside, lane, slot
from m2pem.teams.plan import (
    MOTIONS,
    NO_MEETING,
    Leg,
    March,
    Marcher,
    Meeting,
    MemberPose,
    Plan,
    PlanningContext,
    TeamRefusedError,
)

GAP_SHARE = 0.5
"""Share of the spacing: the minimum distance of members in one lane, along the route."""

HEADROOM_SHARE = 0.4
"""Share of the spacing that the stopping distance may take, to avoid frequent braking."""

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
    ways, past = _ways(context, route, places, spacing)
    marchers = tuple(way.marcher(context) for way in ways)
    speed = _march_speed(context, marchers, spacing)
    legs = tuple(way.leg(context, speed, None) for way in ways)
    closes = shape == "column"
    return Plan(legs, March(marchers, spacing, speed, closes, context.frame, context.fence, past))


def one_by_one(context: PlanningContext) -> Plan:
    """Let each member set off when the member before it has arrived, and stop behind it."""
    _, spacing, places = _formation(context, "column")
    route = context.parameters.route
    if route is None:
        return Plan(_forming_up(context, places, chained=True))
    ways, _ = _ways(context, route, places, spacing)
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
    start, then = (context.level(each) for each in _apart(context, route)[:2])
    yaw_rad, first_m = Segment.between(start, then).yaw_rad, min(back for back, _ in places)
    poses = {
        member: MemberPose(beside(start, yaw_rad, back - first_m + 1.0, left)[:2])
        for member, (back, left) in zip(context.members, places, strict=False)
    }
    context = replace(context, poses=poses)
    try:
        _ways(context, route, places, spacing)
    except TeamRefusedError as error:
        return str(error), "", error.place
    distance_m, place, text = _meeting(context, _drawn(context, route, places, spacing))
    if distance_m >= GAP_SHARE * spacing or behavior == "bridge_crossing":
        return NO_MEETING
    remedy = f"the members pass it one after the other, or else {_REMEDY}"
    return f"{text} if they kept their spacing along it", remedy, place


def lane_mates(a: Marcher, b: Marcher, spacing_m: float) -> bool:
    """Whether two members are in one lane."""
    return abs(a.left_m - b.left_m) < spacing_m / 2


class _Way:
    """A member's route: the team's, shifted sideways and shortened by its distance behind."""

    def __init__(
        self,
        member: ResourceId,
        route: Sequence[EastNorthUp],
        place: tuple[float, float],
        spacing_m: float,
    ) -> None:
        self.member, self._spacing_m = member, spacing_m
        self._back_m, self._left_m = place
        self._route = route
        self._route_marks_m = Polyline(each[:2] for each in route).marks_m
        self._end_at(self._route_marks_m[-1] - self._back_m)

    def _end_at(self, mark_m: float) -> None:
        self._places = lane(self._route, self._route_marks_m[-1] - mark_m, self._left_m)
        self._marks = [*self._route_marks_m[: len(self._places) - 1], mark_m]

    def marcher(self, context: PlanningContext | None = None) -> Marcher:
        """The member on its path; without a context, without the way from where it is."""
        kept, marks = self._places, self._marks
        begin = context.begin(self.member) if context is not None else None
        motion = context.motion(self.member) if context is not None else MOTIONS["ground"]
        if begin is not None:
            way = [(*begin, 0.0), *((*each, 0.0) for each in self._via(context)), kept[0]]
            line = Polyline(each[:2] for each in way)
            first_m = marks[0] - line.length_m
            kept = [*way, *kept[1:]]
            marks = [*(first_m + each for each in line.marks_m), *marks[1:]]
        elif len(kept) == 1:
            kept, marks = [*kept, *kept], [*marks, *marks]
        return Marcher(self.member, MemberPath(kept, marks), self._back_m, self._left_m, motion)

    def _via(self, context: PlanningContext | None) -> Sequence[EastNorth]:
        """The places to pass on the way to the route, around where those behind it begin."""
        begin = None if context is None else context.begin(self.member)
        if context is None or begin is None:
            return ()
        apart_m = NEAREST_SHARE * self._spacing_m
        behind = context.members[context.members.index(self.member) + 1 :]
        others = [context.begin(each) for each in behind]
        ends = begin, self._places[0][:2]
        discs = [
            [*ring, ring[0]]
            for each in others
            if each is not None and min(math.dist(each, end) for end in ends) > apart_m
            for ring in [
                [beside(each, math.tau * k / 16, apart_m * 1.03, 0.0)[:2] for k in range(16)]
            ]
        ]
        via = (Fence.around(discs).way(*ends) or ()) if discs else ()
        track = [begin, *via, ends[1]]
        fenced = via and context.fence is not None
        if fenced and Fence(context.fence, frame=context.frame).leaves(track):
            return ()
        return via

    def shorten(self, by_m: float) -> None:
        """Let it end so much earlier, or a little more."""
        self._end_at(self._marks[-1] - by_m - _SAME_PLACE_M)

    def leg(
        self, context: PlanningContext, speed_m_s: float | None, after: ResourceId | None
    ) -> Leg:
        route = context.parameters.route
        if len(self._places) < 2 or route is None:
            return context.to_place(self.member, self._places[0], after=after)
        ups = [waypoint[2] for waypoint in _apart(context, route)]
        via = [(*each, self._places[0][2]) for each in self._via(context)]
        waypoints = tuple(
            context.coordinate(place, None if up is None else place[2])
            for place, up in zip([*via, *self._places], [*ups[:1] * len(via), *ups], strict=False)
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
    context: PlanningContext,
    route: Route,
    offsets: Sequence[tuple[float, float]],
    spacing_m: float,
) -> tuple[list[_Way], bool]:
    """Return the members' ways, and whether some lead past where others wait to set off."""
    ways = _drawn(context, route, offsets, spacing_m)
    try:
        _keep_ends_apart(context, ways, spacing_m, past=False)
    except _InTheWayError:
        ways = _drawn(context, route, offsets, spacing_m)
        _keep_ends_apart(context, ways, spacing_m, past=True)
        return ways, True
    return ways, False


def _drawn(
    context: PlanningContext,
    route: Route,
    offsets: Sequence[tuple[float, float]],
    spacing_m: float,
) -> list[_Way]:
    if route.altitude_frames and context.parameters.altitude_m is None:
        raise TeamRefusedError(
            "parameter 'route': the altitudes of its waypoints count from different heights, which "
            "a formation cannot keep: set 'altitude'"
        )
    places = [(*context.level(each), each[2] or 0.0) for each in _apart(context, route)]
    return [
        _Way(member, places, offset, spacing_m)
        for member, offset in zip(context.members, offsets, strict=False)
    ]


_NO_WAY = (
    "cannot come to its place in the formation: it and others are in each other's ways; let the"
    " members begin in the formation's order (a goto for each before), or name them in another one"
)


class _InTheWayError(TeamRefusedError):
    """Members are in each other's ways to the route."""


def _keep_ends_apart(
    context: PlanningContext, ways: Sequence[_Way], spacing_m: float, *, past: bool
) -> None:
    """Let members end earlier that would come too near to those at their ends.

    Raises:
        TeamRefusedError: one of them would not get to the end of the route, or near it.
    """
    short_m = max(context.motion(way.member).short_m(context.speed()) for way in ways)
    farther_m = [0.0 for _ in ways]
    shorter = True
    while shorter:
        marchers = [way.marcher(context) for way in ways]
        clearance = Clearance(marchers, NEAREST_SHARE * spacing_m, past)
        ends_m = [each.path.line.length_m for each in marchers]
        shorter = False
        for index, at_m in enumerate(clearance.reached_m([0.0] * len(ways), ends_m, short_m)):
            way, by_m = ways[index], ends_m[index] - at_m
            farther_m[index] += by_m
            too_far = farther_m[index] > _FARTHER_BACK_SHARE * spacing_m
            if not context.begun and too_far:
                _, place, text = _meeting(context, ways)
                text = f"{text}, and {way.member} cannot wait until it is free: {_REMEDY}"
                alone = [each.marcher() for each in ways]  # without their ways to the route
                ends_m = [each.path.line.length_m for each in alone]
                begins_m = [0.0] * len(ways)
                clearance = Clearance(alone, NEAREST_SHARE * spacing_m)
                if [*clearance.reached_m(begins_m, ends_m, short_m)] == ends_m:
                    raise _InTheWayError(f"{way.member} {_NO_WAY}", place)
                raise TeamRefusedError(text, place)
            if by_m and not too_far:
                way.shorten(by_m)
                shorter = True


def _meeting(context: PlanningContext, ways: Sequence[_Way]) -> tuple[float, LatLon, str]:
    """Return how near a formation brings two of its members, the corner there, and a text."""
    marchers = sorted((way.marcher() for way in ways), key=lambda each: each.back_m)
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
