"""Plans of teams that move along a route in a shape, all at once or one after the other."""

import math
from collections.abc import Sequence
from itertools import combinations

from m2pem.fleet.parameters import read_offsets
from m2pem.geo.polyline import EastNorthUp, Polyline, shifted, trimmed
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.teams.paths import SPACING_M, MemberPath, beside, slot
from m2pem.teams.plan import Leg, March, Marcher, Plan, PlanningContext, TeamRefusedError

GAP_SHARE = 0.5
"""Share of the spacing: the minimum distance of members in one lane, along the route."""

HEADROOM_SHARE = 0.4
"""Share of the spacing that the stopping distance may take, to avoid frequent braking."""

_SAME_PLACE_M = 0.01


def march(context: PlanningContext, default_shape: str) -> Plan:
    """Move together in a shape; without a route, form up on the lead."""
    shape, spacing = _shape(context, default_shape)
    route = context.parameters.route
    places = _places(context, shape, spacing)
    if context.parameters.text("offsets"):
        shape, spacing = "", min(math.dist(a, b) for a, b in combinations(places, 2))
    if route is None:
        return Plan(_forming_up(context, places, chained=False))
    ways = _ways(context, route, places)
    marchers = tuple(
        Marcher(way.member, way.path, way.back_m, way.left_m, context.motion(way.member))
        for way in ways
    )
    _refuse_wrong_order(marchers, spacing)
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
    ways = _ways(context, route, places)
    befores: list[ResourceId | None] = [None, *(way.member for way in ways)]
    speed_m_s = context.parameters.speed_m_s
    return Plan(
        tuple(way.leg(context, speed_m_s, after) for way, after in zip(ways, befores, strict=False))
    )


def lane_mates(a: Marcher, b: Marcher, spacing_m: float) -> bool:
    """Whether two members are in one lane."""
    return abs(a.left_m - b.left_m) < spacing_m / 2


class _Way:
    """A member's route: the team's, shifted sideways and shortened by its distance behind."""

    def __init__(
        self,
        context: PlanningContext,
        member: ResourceId,
        route: Sequence[EastNorthUp],
        place: tuple[float, float],
    ) -> None:
        self.member = member
        self.back_m, self.left_m = place
        marks = list(Polyline(place[:2] for place in route).marks_m)
        moved = shifted(route, self.left_m)
        kept = trimmed(moved, self.back_m)
        end_mark = marks[-1] - self.back_m
        if end_mark < 0:  # its place is before the route: it need not see the route's start
            kept = kept[-1:]
        self.places = kept
        marks = [*marks[: len(kept) - 1], end_mark]
        begin = context.poses[member].place
        if not context.begun:
            first = math.dist(begin, kept[0][:2])
            kept, marks = [(*begin, 0.0), *kept], [marks[0] - first, *marks]
        elif len(kept) == 1:
            kept, marks = [*kept, *kept], [*marks, *marks]
        self.path = MemberPath(kept, marks)

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


def _refuse_wrong_order(marchers: Sequence[Marcher], spacing_m: float) -> None:
    """Raise unless, in each lane, members ahead come first: each keeps clear of those before it."""
    for index, marcher in enumerate(marchers):
        for other in marchers[:index]:
            if lane_mates(marcher, other, spacing_m) and marcher.back_m < other.back_m:
                raise TeamRefusedError(
                    f"parameter 'offsets': {marcher.member} would be ahead of {other.member} in "
                    "its lane; name first in the team who is ahead"
                )


def _ways(
    context: PlanningContext, route: Route, offsets: Sequence[tuple[float, float]]
) -> list[_Way]:
    if route.altitude_frames and context.parameters.altitude_m is None:
        raise TeamRefusedError(
            "parameter 'route': the altitudes of its waypoints count from different heights, which "
            "a formation cannot keep: set 'altitude'"
        )
    places = [(*context.level(each), each[2] or 0.0) for each in _apart(context, route)]
    return [
        _Way(context, member, places, offset)
        for member, offset in zip(context.members, offsets, strict=False)
    ]


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
