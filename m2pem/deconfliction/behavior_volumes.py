"""The operational volume of a behavior of one vehicle, by its meaning in the shared catalogue.

Whichever arbiter executes the behavior, the vehicle stays in the volume. Each way is as wide as
its bends may be, and as high as from its beginning to its end. An aircraft on the ground is assumed
to climb vertically first. A vehicle that does not fly is assumed to go straight to each place.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from m2pem.deconfliction.operational_volume import NOTHING_M, Piece, Volume
from m2pem.deconfliction.participant import ANY_HEIGHT, FlightParameters, Span, SurfaceParameters
from m2pem.fleet.behaviors import ORBIT_RADIUS_M
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import Hull, buffered_hull, convex_hull, middle_of
from m2pem.geo.survey_tracks import SURVEY_SPACING_M

RETURN_HEIGHT_M = 30.0
"""Above home: as high as an autopilot rises, if it is lower, before it returns by itself."""

AT_HOME_M = 5.0


def volume_of(
    behavior: str, parameters: FlightParameters, start_s: float, *, timed: bool = False
) -> Volume:
    """Return the volume of a behavior that starts at `start_s`.

    `timed`: the volume also says when the vehicle is where, if that can be known.
    """
    if timed and (scheduled := _scheduled(behavior, parameters, start_s)) is not None:
        return scheduled
    plans = SURFACE_PLANS if isinstance(parameters, SurfaceParameters) else PLANS
    return plans.get(behavior, _anything)(parameters)


def ascent(parameters: FlightParameters, span: Span) -> tuple[list[Piece], Span]:
    """How it comes from where it is to its way at some height: the column in which it takes off, if
    it must, and at which heights the way to the first place is flown."""
    vehicle = parameters.vehicle
    column = vehicle.span.to(span) if not vehicle.flies else vehicle.span
    pieces = [Piece(vehicle.stop, column.low_m, column.high_m)]
    return pieces, span if not vehicle.flies else vehicle.span.to(span)


def way_to(parameters: FlightParameters, area: Hull | None, span: Span) -> Volume:
    """From where it is into an area, and anywhere in it."""
    pieces, flown = ascent(parameters, span)
    there = None if area is None else convex_hull([*parameters.vehicle.stop, *area])
    pieces.append(Piece(there, flown.low_m, flown.high_m))
    straight = area is not None and len(area) == 1
    route = (parameters.vehicle.place, *area) if straight and area is not None else ()
    return Volume(tuple(pieces), _end(span), parameters.unknown, route)


def along(
    parameters: FlightParameters, places: Sequence[EastNorth], spans: Sequence[Span], wide_m: float
) -> Volume:
    """From where it is to the first of some places, and on from each to the next."""
    pieces, flown = ascent(parameters, spans[0])
    pieces.append(
        Piece(
            buffered_hull([*parameters.vehicle.stop, places[0]], wide_m), flown.low_m, flown.high_m
        )
    )
    legs = zip(pairwise(places), pairwise(spans), strict=True)
    for (begin, end), (first, second) in legs:
        over = first.to(second)
        pieces.append(Piece(buffered_hull([begin, end], wide_m), over.low_m, over.high_m))
    route = (parameters.vehicle.place, *places)
    return Volume(tuple(pieces), _end(spans[-1]), parameters.unknown, route, wide_m)


def _end(span: Span) -> float | None:
    return span.low_m if span.exact and math.isfinite(span.low_m) else None


def _scheduled(behavior: str, parameters: FlightParameters, start_s: float) -> Volume | None:
    """A route or a way at one height, at a speed that is given; None: it is not one."""
    vehicle, speed_m_s = parameters.vehicle, parameters.speed_m_s
    if behavior == "single_vehicle_routing" and parameters.route is not None:
        places = [parameters.to_local(each) for each in parameters.route.waypoints]
        spans = parameters.waypoint_spans(parameters.route)
    elif behavior == "goto" and parameters.target_vehicle is None:
        place, span = parameters.target_place()
        places, spans = ([] if place is None else [place]), [span]
    else:
        return None
    level = all(
        span.exact and vehicle.span.exact and abs(span.low_m - vehicle.span.low_m) <= NOTHING_M
        for span in spans
    )
    ready = vehicle.flies and vehicle.stands and not parameters.loop
    if not (places and level and ready and speed_m_s and not parameters.unknown):
        return None
    height_m, now_s = spans[0].low_m, start_s
    wide_m = parameters.bend_m if len(places) > 1 else 0.0
    pieces = [Piece((vehicle.place,), height_m, height_m, to_s=start_s)]
    for begin, end in pairwise([vehicle.place, *places]):
        then_s = now_s + math.dist(begin, end) / speed_m_s
        area = buffered_hull([begin, end], wide_m)
        pieces.append(Piece(area, height_m, height_m, now_s, then_s, (begin, end), wide_m))
        now_s = then_s
    pieces.append(Piece((places[-1],), height_m, height_m, from_s=now_s))
    return Volume(tuple(pieces), height_m)


# --- one each -----------------------------------------------------------------------------------


def _anything(parameters: FlightParameters) -> Volume:
    parameters.unknown = f"where it {parameters.moves} is not known"
    return Volume((Piece(None, -math.inf, math.inf),), unknown=parameters.unknown)


def _stay(parameters: FlightParameters) -> Volume:
    if not parameters.vehicle.flies:
        return Volume()
    span = parameters.vehicle.span
    return Volume((Piece(parameters.vehicle.stop, span.low_m, span.high_m),), _end(span))


def _route(parameters: FlightParameters) -> Volume:
    route = parameters.route
    if route is None or not route.waypoints:
        return _anything(parameters)
    places, spans = (
        [parameters.to_local(each) for each in route.waypoints],
        parameters.waypoint_spans(route),
    )
    if parameters.loop:
        places, spans = [*places, places[0]], [*spans, spans[0]]
    volume = along(parameters, places, spans, parameters.bend_m if len(places) > 1 else 0.0)
    return replace(volume, route=()) if parameters.loop else volume


def _to_target(parameters: FlightParameters) -> Volume:
    place, span = parameters.target_place()
    return way_to(parameters, None if place is None else (place,), span)


def _around(parameters: FlightParameters) -> Volume:
    place, span = parameters.target_place()
    radius_m = parameters.radius_m or ORBIT_RADIUS_M
    return way_to(parameters, None if place is None else buffered_hull([place], radius_m), span)


def _climb(parameters: FlightParameters) -> Volume:
    return way_to(parameters, parameters.vehicle.stop, parameters.span())


def _land(parameters: FlightParameters) -> Volume:
    if not parameters.vehicle.flies:
        return Volume()
    return Volume((Piece(parameters.vehicle.stop, -math.inf, parameters.vehicle.span.high_m),))


def _return(parameters: FlightParameters) -> Volume:
    vehicle = parameters.vehicle
    away_m = [math.dist(vehicle.place, home) for home in vehicle.homes]
    at_home = max(away_m, default=math.inf) <= AT_HOME_M
    if at_home and not vehicle.flies:
        return Volume()
    top_m = vehicle.span.high_m
    if vehicle.home_m is None:
        parameters.unknown, top_m = "the height of its home is not known", math.inf
    elif not at_home:
        top_m = max(top_m, vehicle.home_m + RETURN_HEIGHT_M)
    if not vehicle.homes:
        parameters.unknown = "where its home is is not known"
        return Volume((Piece(None, -math.inf, top_m),), unknown=parameters.unknown)
    low_m = vehicle.span.low_m if vehicle.flies else top_m
    pieces = [Piece(vehicle.stop, vehicle.span.low_m, top_m)]
    for home in vehicle.homes:
        pieces.append(Piece(convex_hull([*vehicle.stop, home]), low_m, top_m))
        pieces.append(Piece((home,), -math.inf, top_m))
    return Volume(tuple(pieces), unknown=parameters.unknown)


def _return_on_surface(parameters: FlightParameters) -> Volume:
    vehicle = parameters.vehicle
    if not vehicle.homes:
        parameters.unknown = "where its home is is not known"
        return way_to(parameters, None, ANY_HEIGHT)
    ways = [way_to(parameters, (home,), ANY_HEIGHT) for home in vehicle.homes]
    if len(ways) == 1:
        return ways[0]
    return Volume(tuple(piece for way in ways for piece in way.pieces))


def _reverse(parameters: FlightParameters) -> Volume:
    around = buffered_hull([parameters.vehicle.place], parameters.distance_m)
    return way_to(parameters, around, ANY_HEIGHT)


def survey_area(parameters: FlightParameters) -> tuple[Hull, Span] | None:
    """Where tracks over the parameter `area` may be; None: there is none."""
    area = parameters.area
    if area is None:
        return None
    spacing_m = parameters.spacing_m or SURVEY_SPACING_M
    reach_m = spacing_m / 2 + parameters.overshoot_m
    corner_m = area.rings[0][0][2]
    present = (
        parameters.span() if corner_m is None else parameters.span(corner_m, area.altitude_frame)
    )
    if corner_m is not None:  # not everybody heeds the heights of an area
        present = present.to(parameters.span())
    return buffered_hull(parameters.ring(area), reach_m), present


def _survey(parameters: FlightParameters) -> Volume:
    found = survey_area(parameters)
    return _anything(parameters) if found is None else way_to(parameters, *found)


def observed(parameters: FlightParameters, reach_m: float) -> tuple[Hull | None, Span]:
    """Around an area or a target, from `reach_m` away, or as far as its farthest corner."""
    if parameters.area is None:
        place, span = parameters.target_place()
        return None if place is None else buffered_hull([place], reach_m), span
    ring = parameters.ring(parameters.area)
    centre = middle_of(ring)
    reach_m = max(reach_m, *(math.dist(centre, corner) for corner in ring))
    return buffered_hull([centre], reach_m), parameters.span()


def _observe(parameters: FlightParameters) -> Volume:
    return way_to(parameters, *observed(parameters, ORBIT_RADIUS_M))


PLANS: Mapping[str, Callable[[FlightParameters], Volume]] = {
    "single_vehicle_routing": _route,
    "goto": _to_target,
    "hold": _stay,
    "drive_stop": _stay,
    "set_speed": _stay,
    "deploy": _stay,
    "land": _land,
    "return_to_launch": _return,
    "takeoff": _climb,
    "change_altitude": _climb,
    "area_survey": _survey,
    "orbit": _around,
    "area_observe": _observe,
    "follow": _to_target,
}
"""By behavior's name, of aircraft. Others may be anywhere."""

SURFACE_PLANS: Mapping[str, Callable[[FlightParameters], Volume]] = {
    **PLANS,
    "land": _stay,
    "takeoff": _stay,
    "return_to_launch": _return_on_surface,
    "reverse": _reverse,
}
"""The same of vehicles that do not fly."""
