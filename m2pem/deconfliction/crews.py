"""From a team behavior to the room that each of its members takes up, whoever makes it."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

from m2pem.deconfliction.craft import Craft
from m2pem.deconfliction.planning import (
    BEND_M,
    RADIUS_M,
    along,
    observed,
    survey_area,
    volume_of,
    way_to,
)
from m2pem.deconfliction.volume import Piece, Volume
from m2pem.deconfliction.wishes import Wishes
from m2pem.fleet.parameters import read_offsets
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import buffered_hull, convex_hull
from m2pem.teams.shapes import SPACING_M, Vector, shifted, slot, trimmed

_SHAPES = {
    "formation": "wedge",
    "road_following_formation": "column",
    "road_sweep": "line",
    "bridge_crossing": "column",
}


def member_volume(
    behavior: str, wishes: Wishes, lead: Craft | None, index: int, start_s: float
) -> Volume:
    """The room of member `index` of a team (0 leads); its lead may be no aircraft, and unseen."""
    if behavior in _SHAPES:
        return _march(behavior, wishes, lead, index)
    plan = _PLANS.get(behavior)
    return volume_of(behavior, wishes, start_s) if plan is None else plan(wishes)


def _march(behavior: str, wishes: Wishes, lead: Craft | None, index: int) -> Volume:
    shape = wishes.parameters.get("shape")
    spacing_m = wishes.number("spacing") or SPACING_M
    back, left = slot(shape if isinstance(shape, str) else _SHAPES[behavior], index)
    back_m, left_m = back * spacing_m, left * spacing_m
    offsets = wishes.parameters.get("offsets")
    if index and isinstance(offsets, str) and len(given := read_offsets(offsets)) >= index:
        back_m, left_m = given[index - 1]
    route = wishes.route
    if route is None or not route.waypoints:
        # To a place beside the lead, whichever way that looks.
        if lead is None:
            wishes.unknown = "where its lead stands is not known"
            return way_to(wishes, None, wishes.span())
        around = buffered_hull(lead.stop, math.hypot(back_m, left_m))
        return way_to(wishes, around if index else wishes.craft.stop, wishes.span())
    places: list[Vector] = [(*wishes.level(each), 0.0) for each in route.waypoints]
    spans = wishes.waypoint_spans(route)
    if len({place[:2] for place in places}) == 1:
        reach_m = 2 * math.hypot(back_m, left_m)
        return way_to(wishes, buffered_hull([places[0][:2], *_stop(lead)], reach_m), spans[0])
    moved = [place[:2] for place in shifted(places, left_m)]
    volume = along(wishes, moved, spans, BEND_M)
    if back_m <= sum(math.dist(a, b) for a, b in pairwise(moved)):
        return volume
    # Its place is before the route's beginning: it goes there at once, or by way of the route.
    end = trimmed([(*place, 0.0) for place in moved], back_m)[-1][:2]
    over = spans[0]
    for span in (*spans, wishes.craft.span):
        over = over.to(span)
    detour = convex_hull([*wishes.craft.stop, *moved, end])
    low_m = over.low_m if wishes.craft.flies else min(span.low_m for span in spans)
    extra = Piece(detour, low_m, over.high_m)
    return Volume((*volume.pieces, extra), volume.end_m, volume.unknown)


def _stop(lead: Craft | None) -> Sequence[EastNorth]:
    return () if lead is None else lead.stop


def _survey(wishes: Wishes) -> Volume:
    found = survey_area(wishes)
    return volume_of("", wishes, 0.0) if found is None else way_to(wishes, *found)


def _observe(wishes: Wishes) -> Volume:
    area, span = observed(wishes, RADIUS_M)
    return way_to(wishes, area, span if wishes.area is not None else span.to(wishes.span()))


def _escort(wishes: Wishes) -> Volume:
    place, span = wishes.target()
    reach_m = wishes.number("spacing") or SPACING_M
    area = None if place is None else buffered_hull([place], reach_m)
    return way_to(wishes, area, span.to(wishes.span()))


_PLANS: Mapping[str, Callable[[Wishes], Volume]] = {
    "area_survey": _survey,
    "area_observe": _observe,
    "escort": _escort,
}
