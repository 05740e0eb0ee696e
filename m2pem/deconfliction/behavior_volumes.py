"""The operational volume of a behavior of one aircraft, by its meaning in the shared catalogue.

Whichever arbiter executes the behavior, the aircraft stays in the volume. Each way is as wide as
its bends may be, and as high as from its beginning to its end. An aircraft on the ground is assumed
to climb vertically first.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

from m2pem.deconfliction.aircraft import FlightParameters, Span
from m2pem.deconfliction.operational_volume import NOTHING_M, Piece, Volume
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import Hull, buffered_hull, convex_hull, middle_of

BEND_M = 4.0
"""How far from a route's corner a bend may pass it."""

RADIUS_M = 30.0
SURVEY_SPACING_M = 20.0
"""Of circles and surveys that give no radius or spacing."""

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
    return PLANS.get(behavior, _anything)(parameters)


def ascent(parameters: FlightParameters, span: Span) -> tuple[list[Piece], Span]:
    """How it comes from where it is to its way at some height: the column in which it takes off, if
    it must, and at which heights the way to the first place is flown."""
    aircraft = parameters.aircraft
    column = aircraft.span.to(span) if not aircraft.flies else aircraft.span
    pieces = [Piece(aircraft.stop, column.low_m, column.high_m)]
    return pieces, span if not aircraft.flies else aircraft.span.to(span)


def way_to(parameters: FlightParameters, area: Hull | None, span: Span) -> Volume:
    """From where it is into an area, and anywhere in it."""
    pieces, flown = ascent(parameters, span)
    there = None if area is None else convex_hull([*parameters.aircraft.stop, *area])
    pieces.append(Piece(there, flown.low_m, flown.high_m))
    return Volume(tuple(pieces), _end(span), parameters.unknown)


def along(
    parameters: FlightParameters, places: Sequence[EastNorth], spans: Sequence[Span], wide_m: float
) -> Volume:
    """From where it is to the first of some places, and on from each to the next."""
    pieces, flown = ascent(parameters, spans[0])
    pieces.append(
        Piece(
            buffered_hull([*parameters.aircraft.stop, places[0]], wide_m), flown.low_m, flown.high_m
        )
    )
    legs = zip(pairwise(places), pairwise(spans), strict=True)
    for (begin, end), (first, second) in legs:
        over = first.to(second)
        pieces.append(Piece(buffered_hull([begin, end], wide_m), over.low_m, over.high_m))
    return Volume(tuple(pieces), _end(spans[-1]), parameters.unknown)


def _end(span: Span) -> float | None:
    return span.low_m if span.exact and math.isfinite(span.low_m) else None


def _scheduled(behavior: str, parameters: FlightParameters, start_s: float) -> Volume | None:
    """A route or a way at one height, at a speed that is given; None: it is not one."""
    aircraft, speed_m_s = parameters.aircraft, parameters.speed_m_s
    if behavior == "single_vehicle_routing" and parameters.route is not None:
        places = [parameters.to_local(each) for each in parameters.route.waypoints]
        spans = parameters.waypoint_spans(parameters.route)
    elif behavior == "goto" and parameters.target_vehicle is None:
        place, span = parameters.target_place()
        places, spans = ([] if place is None else [place]), [span]
    else:
        return None
    level = all(
        span.exact and aircraft.span.exact and abs(span.low_m - aircraft.span.low_m) <= NOTHING_M
        for span in spans
    )
    ready = aircraft.flies and aircraft.stands and not parameters.loop
    if not (places and level and ready and speed_m_s and not parameters.unknown):
        return None
    height_m, now_s = spans[0].low_m, start_s
    wide_m = BEND_M if len(places) > 1 else 0.0
    pieces = [Piece((aircraft.place,), height_m, height_m, to_s=start_s)]
    for begin, end in pairwise([aircraft.place, *places]):
        then_s = now_s + math.dist(begin, end) / speed_m_s
        area = buffered_hull([begin, end], wide_m)
        pieces.append(Piece(area, height_m, height_m, now_s, then_s, (begin, end), wide_m))
        now_s = then_s
    pieces.append(Piece((places[-1],), height_m, height_m, from_s=now_s))
    return Volume(tuple(pieces), height_m)


# --- one each -----------------------------------------------------------------------------------


def _anything(parameters: FlightParameters) -> Volume:
    parameters.unknown = "where it flies is not known"
    return Volume((Piece(None, -math.inf, math.inf),), unknown=parameters.unknown)


def _stay(parameters: FlightParameters) -> Volume:
    if not parameters.aircraft.flies:
        return Volume()
    span = parameters.aircraft.span
    return Volume((Piece(parameters.aircraft.stop, span.low_m, span.high_m),), _end(span))


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
    return along(parameters, places, spans, BEND_M if len(places) > 1 else 0.0)


def _to_target(parameters: FlightParameters) -> Volume:
    place, span = parameters.target_place()
    return way_to(parameters, None if place is None else (place,), span)


def _around(parameters: FlightParameters) -> Volume:
    place, span = parameters.target_place()
    radius_m = parameters.radius_m or RADIUS_M
    return way_to(parameters, None if place is None else buffered_hull([place], radius_m), span)


def _climb(parameters: FlightParameters) -> Volume:
    return way_to(parameters, parameters.aircraft.stop, parameters.span())


def _land(parameters: FlightParameters) -> Volume:
    if not parameters.aircraft.flies:
        return Volume()
    return Volume((Piece(parameters.aircraft.stop, -math.inf, parameters.aircraft.span.high_m),))


def _return(parameters: FlightParameters) -> Volume:
    aircraft = parameters.aircraft
    away_m = [math.dist(aircraft.place, home) for home in aircraft.homes]
    at_home = max(away_m, default=math.inf) <= AT_HOME_M
    if at_home and not aircraft.flies:
        return Volume()
    top_m = aircraft.span.high_m
    if aircraft.home_m is None:
        parameters.unknown, top_m = "the height of its home is not known", math.inf
    elif not at_home:
        top_m = max(top_m, aircraft.home_m + RETURN_HEIGHT_M)
    if not aircraft.homes:
        parameters.unknown = "where its home is is not known"
        return Volume((Piece(None, -math.inf, top_m),), unknown=parameters.unknown)
    low_m = aircraft.span.low_m if aircraft.flies else top_m
    pieces = [Piece(aircraft.stop, aircraft.span.low_m, top_m)]
    for home in aircraft.homes:
        pieces.append(Piece(convex_hull([*aircraft.stop, home]), low_m, top_m))
        pieces.append(Piece((home,), -math.inf, top_m))
    return Volume(tuple(pieces), unknown=parameters.unknown)


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
    return way_to(parameters, *observed(parameters, RADIUS_M))


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
"""By behavior's name. Others may be anywhere."""
