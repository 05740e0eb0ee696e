"""The operational volume of each member of a team behavior."""

import math
from collections.abc import Callable, Mapping, Sequence

from m2pem.deconfliction.behavior_volumes import (
    along,
    observed,
    survey_area,
    volume_of,
    way_to,
)
from m2pem.deconfliction.operational_volume import Piece, Volume
from m2pem.deconfliction.participant import FlightParameters, Participant
from m2pem.fleet.behaviors import ORBIT_RADIUS_M
from m2pem.fleet.parameters import read_offsets
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import buffered_hull, convex_hull
from m2pem.geo.polyline import EastNorthUp, Polyline, shifted
from m2pem.teams.paths import SHAPES, SPACING_M, lane, slot


def member_volume(
    behavior: str,
    parameters: FlightParameters,
    lead: Participant | None,
    index: int,
    start_s: float,
) -> Volume:
    """Return the volume of member `index` of a team (0 leads); the lead need not be an aircraft."""
    if behavior in SHAPES:
        return _march(behavior, parameters, lead, index)
    plan = _PLANS.get(behavior)
    return volume_of(behavior, parameters, start_s) if plan is None else plan(parameters)


def _march(
    behavior: str, parameters: FlightParameters, lead: Participant | None, index: int
) -> Volume:
    back_m, left_m = _offset(behavior, parameters, index)
    route = parameters.route
    if route is None or not route.waypoints:
        # To a place beside the lead, whichever way that looks.
        if lead is None:
            parameters.unknown = "the position of its lead is not known"
            return way_to(parameters, None, parameters.span())
        around = buffered_hull(lead.stop, math.hypot(back_m, left_m))
        return way_to(parameters, around if index else parameters.vehicle.stop, parameters.span())
    places: list[EastNorthUp] = [(*parameters.to_local(each), 0.0) for each in route.waypoints]
    spans = parameters.waypoint_spans(route)
    if len({place[:2] for place in places}) == 1:
        reach_m = 2 * math.hypot(back_m, left_m)
        return way_to(parameters, buffered_hull([places[0][:2], *_stop(lead)], reach_m), spans[0])
    moved = [place[:2] for place in shifted(places, left_m)]
    volume = along(parameters, moved, spans, parameters.bend_m)
    if back_m <= Polyline(place[:2] for place in places).length_m:
        return volume
    # Its place is before the route's beginning: it goes there at once, or by way of the route.
    end = lane(places, back_m, left_m)[-1][:2]
    over = spans[0]
    for span in (*spans, parameters.vehicle.span):
        over = over.to(span)
    detour = convex_hull([*parameters.vehicle.stop, *moved, end])
    low_m = over.low_m if parameters.vehicle.flies else min(span.low_m for span in spans)
    extra = Piece(detour, low_m, over.high_m)
    return Volume((*volume.pieces, extra), volume.end_m, volume.unknown)


def _offset(behavior: str, parameters: FlightParameters, index: int) -> tuple[float, float]:
    """How far behind the lead and left of it a member goes, in metres."""
    spacing_m = parameters.spacing_m or SPACING_M
    back, left = slot(parameters.text("shape") or SHAPES[behavior], index)
    offsets = parameters.text("offsets")
    if index and offsets and len(given := read_offsets(offsets)) >= index:
        return given[index - 1]
    return back * spacing_m, left * spacing_m


def end_of_member(behavior: str, parameters: FlightParameters, index: int) -> EastNorth | None:
    """Return where member `index` of a team stands at the end of a route; None: not known."""
    route = parameters.route
    if behavior not in SHAPES or route is None or not route.waypoints:
        return None
    places: list[EastNorthUp] = [(*parameters.to_local(each), 0.0) for each in route.waypoints]
    if len({place[:2] for place in places}) == 1:
        return None if index else places[0][:2]
    back_m, left_m = _offset(behavior, parameters, index)
    return lane(places, back_m, left_m)[-1][:2]


def _stop(lead: Participant | None) -> Sequence[EastNorth]:
    return () if lead is None else lead.stop


def _survey(parameters: FlightParameters) -> Volume:
    found = survey_area(parameters)
    return volume_of("", parameters, 0.0) if found is None else way_to(parameters, *found)


def _observe(parameters: FlightParameters) -> Volume:
    area, span = observed(parameters, ORBIT_RADIUS_M)
    return way_to(
        parameters, area, span if parameters.area is not None else span.to(parameters.span())
    )


def _escort(parameters: FlightParameters) -> Volume:
    place, span = parameters.target_place()
    reach_m = parameters.spacing_m or SPACING_M
    area = None if place is None else buffered_hull([place], reach_m)
    return way_to(parameters, area, span.to(parameters.span()))


_PLANS: Mapping[str, Callable[[FlightParameters], Volume]] = {
    "area_survey": _survey,
    "area_observe": _observe,
    "escort": _escort,
}

TEAM_BEHAVIORS = frozenset({*SHAPES, *_PLANS})
"""Those whose members' volumes are known; of others, each member does that of one vehicle."""
