"""Plans of teams that move along a route in a shape, all at once or one after the other."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from m2pem.fleet.parameters import read_offsets
from m2pem.geo.polyline import EastNorthUp, Polyline, Segment
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.teams.clearance import NEAREST_SHARE, Clearance, Nearest, Way, nearest
from m2pem.teams.paths import SHAPES, SPACING_M, MemberPath, beside, lane, slot
from m2pem.teams.plan import (
    Leg,
    March,
    Marcher,
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

_FARTHER_BACK_SHARE = 2.0
"""Share of the spacing: so much farther back than in the formation may a member end."""


def march(context: PlanningContext, default_shape: str) -> Plan:
    """Move together in a shape; without a route, form up on the lead."""
    shape, spacing = _shape(context, default_shape)
    route = context.parameters.route
    places = _places(context, shape, spacing)
    if context.parameters.text("offsets"):
        shape, spacing = "", min(math.dist(a, b) for a, b in combinations(places, 2))
    if route is None:
        return Plan(_forming_up(context, places, chained=False))
    ways = _ways(context, route, places, spacing)
    marchers = tuple(
        Marcher(
            way.member,
            way.path(context.begin(way.member)),
            way.back_m,
            way.left_m,
            context.motion(way.member),
        )
        for way in ways
    )
    speed = _march_speed(context, marchers, spacing)
    legs = tuple(way.leg(context, speed, None) for way in ways)
    return Plan(legs, March(marchers, spacing, speed, closes=shape == "column"))


def one_by_one(context: PlanningContext) -> Plan:
    """Let each member set off when the member before it has arrived, and stop behind it."""
    shape, spacing = _shape(context, "column")
    route = context.parameters.route
    places = _places(context, shape, spacing)
    if route is None:
        return Plan(_forming_up(context, places, chained=True))
    ways = _ways(context, route, places, spacing)
    befores: list[ResourceId | None] = [None, *(way.member for way in ways)]
    speed_m_s = context.parameters.speed_m_s
    return Plan(
        tuple(way.leg(context, speed_m_s, after) for way, after in zip(ways, befores, strict=False))
    )


_REMEDY = (
    "draw a wider turn, or the way back beside the way there; or set a smaller spacing; or command "
    "the members one after the other"
)


def turns(context: PlanningContext, behavior: str) -> tuple[str, str]:
    """Say where a route brings members too near to each other, and what would be right; "" if not.

    The members come from their places behind the beginning of the route.
    """
    route, (shape, spacing) = context.parameters.route, _shape(context, SHAPES[behavior])
    if route is None or len(context.members) < 2:
        return "", ""
    places = _places(context, shape, spacing)
    if context.parameters.text("offsets"):
        spacing = min(math.dist(a, b) for a, b in combinations(places, 2))
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
        return str(error), ""
    near = nearest(
        [Way(way.path(), way.back_m, way.left_m) for way in _drawn(context, route, places)]
    )
    if near.distance_m >= GAP_SHARE * spacing or behavior == "bridge_crossing":
        return "", ""
    said = f"parameter 'route': {_turn(context, near)} if they kept their spacing along it"
    return said, f"the members pass it one after the other, or else {_REMEDY}"


def lane_mates(a: "Marcher | _Way", b: "Marcher | _Way", spacing_m: float) -> bool:
    """Whether two members are in one lane."""
    return abs(a.left_m - b.left_m) < spacing_m / 2


class _Way:
    """A member's route: the team's, shifted sideways and shortened by its distance behind."""

    def __init__(
        self, member: ResourceId, route: Sequence[EastNorthUp], place: tuple[float, float]
    ) -> None:
        self.member = member
        self.back_m, self.left_m = place
        self._route = route
        self._route_marks_m = Polyline(each[:2] for each in route).marks_m
        self._end_at(self._route_marks_m[-1] - self.back_m)

    def _end_at(self, mark_m: float) -> None:
        self.places = lane(self._route, self._route_marks_m[-1] - mark_m, self.left_m)
        self._marks = [*self._route_marks_m[: len(self.places) - 1], mark_m]

    def path(self, begin: tuple[float, float] | None = None) -> MemberPath:
        """Its path, without the way from `begin` to the route if there is none."""
        kept, marks = self.places, self._marks
        if begin is not None:
            first = math.dist(begin, kept[0][:2])
            kept, marks = [(*begin, 0.0), *kept], [marks[0] - first, *marks]
        elif len(kept) == 1:
            kept, marks = [*kept, *kept], [*marks, *marks]
        return MemberPath(kept, marks)

    def shorten(self, by_m: float) -> None:
        """Let it end so much earlier, or a little more."""
        self._end_at(self._marks[-1] - by_m - _SAME_PLACE_M)

    def leg(
        self, context: PlanningContext, speed_m_s: float | None, after: ResourceId | None
    ) -> Leg:
        route = context.parameters.route
        if len(self.places) < 2 or route is None:
            return context.to_place(self.member, self.places[0], after=after)
        ups = [waypoint[2] for waypoint in _apart(context, route)]
        waypoints = tuple(
            context.coordinate(place, None if up is None else place[2])
            for place, up in zip(self.places, ups, strict=False)
        )
        parameters = {"route": Route(waypoints, route.altitude_frame), "speed": speed_m_s}
        return context.leg(self.member, "single_vehicle_routing", parameters, after)


def _shape(context: PlanningContext, default: str) -> tuple[str, float]:
    return context.parameters.text("shape") or default, context.parameters.spacing_m or SPACING_M


def _places(context: PlanningContext, shape: str, spacing_m: float) -> list[tuple[float, float]]:
    """Return each member's place, in metres behind the lead and to its left."""
    text = context.parameters.text("offsets")
    if not text:
        slots = (slot(shape, index) for index in range(len(context.members)))
        return [(back * spacing_m, left * spacing_m) for back, left in slots]
    doubled = [name for name in ("shape", "spacing") if name in context.parameters]
    if doubled:
        raise TeamRefusedError(f"parameter 'offsets': it says what '{doubled[0]}' says, too")
    places = [(0.0, 0.0), *read_offsets(text)]
    if len(places) < len(context.members) or len(places) < 2:
        raise TeamRefusedError(
            f"parameter 'offsets': there are {len(places) - 1} for {len(context.members) - 1} "
            "members after the lead"
        )
    return places[: max(2, len(context.members))]


def _refuse_wrong_order(marchers: "Sequence[_Way]", spacing_m: float) -> None:
    """Raise unless, in each lane, members ahead come first: each keeps clear of those before it."""
    for index, marcher in enumerate(marchers):
        for other in marchers[:index]:
            if lane_mates(marcher, other, spacing_m) and marcher.back_m < other.back_m:
                raise TeamRefusedError(
                    f"parameter 'offsets': {marcher.member} would be ahead of {other.member} in "
                    "its lane; name first in the team who is ahead"
                )


def _ways(
    context: PlanningContext,
    route: Route,
    offsets: Sequence[tuple[float, float]],
    spacing_m: float,
) -> list[_Way]:
    ways = _drawn(context, route, offsets)
    _refuse_wrong_order(ways, spacing_m)
    _keep_ends_apart(context, ways, spacing_m)
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
        _Way(member, places, offset)
        for member, offset in zip(context.members, offsets, strict=False)
    ]


def _keep_ends_apart(context: PlanningContext, ways: Sequence[_Way], spacing_m: float) -> None:
    """Let members end earlier that would come too near to those at their ends.

    Raises:
        TeamRefusedError: one of them would not get to the end of the route, or near it.
    """
    nearest_m = NEAREST_SHARE * spacing_m
    short_m = max(context.motion(way.member).short_m(context.speed()) for way in ways)
    formation = [Way(way.path(), way.back_m, way.left_m) for way in ways]
    farther_m = [0.0 for _ in ways]
    while True:
        paths = [Way(way.path(context.begin(way.member)), way.back_m, way.left_m) for way in ways]
        clearance = Clearance(paths, nearest_m)
        ends_m = [path.line.length_m for path in paths]
        shorter = False
        for index, at_m in enumerate(clearance.reached_m([0.0] * len(ways), ends_m, short_m)):
            way, by_m = ways[index], ends_m[index] - at_m
            farther_m[index] += by_m
            too_far = farther_m[index] > _FARTHER_BACK_SHARE * spacing_m
            if not context.begun and too_far:
                raise TeamRefusedError(
                    f"parameter 'route': {_turn(context, nearest(formation))}, and {way.member} "
                    f"cannot wait until it is free: {_REMEDY}"
                )
            if by_m and not too_far:
                way.shorten(by_m)
                shorter = True
        if not shorter:
            break


def _turn(context: PlanningContext, near: Nearest) -> str:
    """Say where a formation brings two members nearest to each other."""
    latitude_deg, longitude_deg, _ = context.coordinate(near.place, None)
    first, second = (context.members[each] for each in near.members)
    return (
        f"at [{latitude_deg:.6f}, {longitude_deg:.6f}] it turns by {near.turn_deg:.0f} degrees, "
        f"where {first} and {second} would come within {near.distance_m:.1f} m of each other"
    )


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
                gap_m = marcher.back_m - other.back_m
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
