"""What a single vehicle does for each behavior: a plan, and perhaps a pursuit after it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from m2pem.api.remaining import RemainingRoute, RemainingSurvey, RemainingWork, raw_parameters
from m2pem.fleet.behaviors import ORBIT_RADIUS_M, takeoff_first
from m2pem.geo.polygon import middle_of
from m2pem.geo.polyline import Polyline
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.simulation.course import Course, Craft, RefusedError, track_of
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.pursuit import Pursuit
from m2pem.simulation.segments import Pose, Vector
from m2pem.simulation.trajectory import Plan

STANDOFF_M = 20.0
FOLLOW_OFFSET_M = 15.0
ACTUATOR_S = 2.0
"""The defaults of a behavior's parameters."""


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """What a vehicle does. After `plan`, if any, it keeps up `pursuit`, if any, for ever.

    `cruise_m_s`: the vehicle's own speed from now on. `work`: what is left of it, if another
    vehicle could do that; the end of `plan` is the end of its way.
    """

    plan: Plan[Pose] | None
    pursuit: Pursuit | None = None
    cruise_m_s: float | None = None
    work: RemainingWork | None = None


def yaw_of(heading_rad: float) -> float:
    """Yaw (from east, counter-clockwise) of a heading (from north, clockwise)."""
    return math.pi / 2 - heading_rad


def flying_height(craft: Craft, parameters: LocalParameters) -> float:
    """The height to move at: as requested, else the present one."""
    requested = parameters.up_m(craft)
    return craft.pose.place[2] if requested is None else requested


def _route(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    """Along the route, round its corners; with a stop at each if the bends would leave the
    fence."""
    made, fence = _along(craft, parameters, None), parameters.fence
    if fence is not None and made.plan is not None and fence.leaves(track_of(made.plan)):
        return _along(craft, parameters, 0.0)
    return made


def _along(craft: Craft, parameters: LocalParameters, radius_m: float | None) -> Manoeuvre:
    route = parameters.route
    if route is None:
        raise RefusedError("parameter 'route': there is none")
    up = flying_height(craft, parameters)
    places = parameters.places(craft, route, up)
    speed = parameters.speed_m_s
    own = route.speeds_m_s and speed is None
    lap_speeds = [route.speed_from(index) for index in range(len(places))] if own else []
    course = Course(craft)
    course.through(places, speed, radius_m, [None, *lap_speeds[:-1]] if own else ())
    if not parameters.loop:
        work = RemainingRoute(raw_parameters(parameters.given), route, parameters.frame)
        return Manoeuvre(course.plan(), work=work)
    first_leg = next((p for p in places if math.dist(p[:2], places[0][:2]) > 0.1), None)
    if first_leg is None:
        raise RefusedError("parameter 'loop': a route of one place cannot be repeated")
    course.through([places[0]], speed, radius_m, lap_speeds[-1:])
    course.turn_to(math.atan2(first_leg[1] - places[0][1], first_leg[0] - places[0][0]))
    lap = course.steps
    course.through([*places[1:], places[0]], speed, radius_m, lap_speeds)
    course.turn_to(math.atan2(first_leg[1] - places[0][1], first_leg[0] - places[0][0]))
    return Manoeuvre(course.plan(cycle_from=lap))


def _goto(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    target = parameters.target_place(craft, flying_height(craft, parameters))
    course = Course(craft).through([target], parameters.speed_m_s)
    heading = parameters.heading_rad
    if heading is not None:
        course.turn_to(yaw_of(heading))
    return Manoeuvre(course.plan())


def _hold(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).stand(parameters.duration_s or 0.0).plan())


def _stop(craft: Craft, _: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).plan())


def _land(craft: Craft, _: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).climb_to(craft.home[2]).plan())


def _return(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    """Home, around what the fence keeps out if there is a way; a return is never refused."""
    course, fence = Course(craft), parameters.fence
    east, north, ground = craft.home
    around = [] if fence is None else fence.way(course.place[:2], (east, north)) or []
    radius_m = 0.0 if around else None
    way = [*around, (east, north)]
    if not craft.flies:
        return Manoeuvre(course.through([(*each, ground) for each in way], None, radius_m).plan())
    if math.dist(course.place[:2], (east, north)) > 0.1:
        if not craft.aloft:
            raise RefusedError(takeoff_first(craft.name))
        course.climb_to(max(course.place[2], ground + craft.kinematics.default_altitude_m))
        course.through([(*each, course.place[2]) for each in way], None, radius_m)
    return Manoeuvre(course.climb_to(ground).plan())


def _reverse(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).back_up(parameters.distance_m, parameters.speed_m_s).plan())


def _climb(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).climb_to(flying_height(craft, parameters)).plan())


def _survey(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    """Drive or fly the passes over an area; each is driven to its very end."""
    area = parameters.area
    if area is None:
        raise RefusedError("parameter 'area': there is none")
    rings = parameters.rings(area)
    shape = parameters.spacing_m, parameters.yaw_rad, parameters.overshoot_m
    try:
        tracks = SurveyTracks.over(rings, *shape)
        tracks = tracks.approached_from(craft.pose.place[:2])
    except ValueError as error:
        raise RefusedError(f"parameter {error}") from None
    up = flying_height(craft, parameters)
    places: list[Vector] = [(east, north, up) for east, north in tracks.line.points]
    course = Course(craft).through(places, parameters.speed_m_s, radius_m=0.0)
    work = RemainingSurvey(
        raw_parameters(parameters.given),
        tracks,
        parameters.frame,
        area.rings[0][0][2],
        area.altitude_frame,
    )
    return Manoeuvre(course.plan(), work=work)


def _orbit(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    centre = parameters.target_place(craft, flying_height(craft, parameters))
    radius = parameters.radius_m or ORBIT_RADIUS_M
    speed = parameters.speed_m_s
    course = _onto_circle(craft, centre, radius, speed)
    turns, seconds = parameters.turns, parameters.duration_s
    if turns is None and seconds is not None:
        course.circle(centre[:2], speed, seconds=seconds)
    else:
        course.circle(centre[:2], speed, sweep_rad=math.tau * (1.0 if turns is None else turns))
    return Manoeuvre(course.plan())


def _onto_circle(craft: Craft, centre: Vector, radius_m: float, speed_m_s: float | None) -> Course:
    """A course to the nearest point of a circle."""
    course = Course(craft)
    angle_rad = math.atan2(course.place[1] - centre[1], course.place[0] - centre[0])
    east = centre[0] + radius_m * math.cos(angle_rad)
    north = centre[1] + radius_m * math.sin(angle_rad)
    return course.through([(east, north, centre[2])], speed_m_s)


def _observe(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    """Watch an area: from a circle above it when flying, else standing at its edge."""
    up = flying_height(craft, parameters)
    area = parameters.area
    seconds = parameters.duration_s
    centre = (
        parameters.target_place(craft, up)
        if area is None
        else (*middle_of(parameters.rings(area)[0][:-1]), up)
    )
    if craft.flies:
        course = _onto_circle(craft, centre, ORBIT_RADIUS_M, None)
        course.circle(centre[:2], seconds=seconds)
        return Manoeuvre(course.plan(course.steps - 1 if seconds is None else None))
    if area is None:
        course = _onto_circle(craft, centre, STANDOFF_M, None)
    else:
        course = Course(craft)
        course.through([(*Polyline(parameters.rings(area)[0]).nearest(course.place[:2]), up)])
    course.turn_to(math.atan2(centre[1] - course.place[1], centre[0] - course.place[0]))
    return Manoeuvre(course.stand(math.inf if seconds is None else seconds).plan())


def _follow(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    vehicle = parameters.target_vehicle
    if vehicle is None or vehicle == craft.name:
        raise RefusedError("parameter 'target': another vehicle is expected")
    offset, bearing = parameters.offset_m, parameters.bearing_rad
    up = flying_height(craft, parameters)
    parameters.pose_of(vehicle)  # refused here if its position is not known
    pursuit = Pursuit(
        vehicle,
        FOLLOW_OFFSET_M if offset is None else offset,
        math.pi if bearing is None else bearing,
        up,
        craft.kinematics.max_speed_m_s,
    )
    return Manoeuvre(None, pursuit)


def _teleop(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    timeout = parameters.timeout_s
    return Manoeuvre(Course(craft).stand(math.inf if timeout is None else timeout).plan())


def _set_speed(craft: Craft, parameters: LocalParameters) -> Manoeuvre:
    speed = min(parameters.speed_m_s or math.inf, craft.kinematics.max_speed_m_s)
    return Manoeuvre(Course(craft).plan(), cruise_m_s=speed)


def _deploy(craft: Craft, _: LocalParameters) -> Manoeuvre:
    return Manoeuvre(Course(craft).stand(ACTUATOR_S).plan())


MANOEUVRES: Mapping[str, Callable[[Craft, LocalParameters], Manoeuvre]] = {
    "single_vehicle_routing": _route,
    "goto": _goto,
    "hold": _hold,
    "drive_stop": _stop,
    "land": _land,
    "return_to_launch": _return,
    "reverse": _reverse,
    "takeoff": _climb,
    "change_altitude": _climb,
    "area_survey": _survey,
    "orbit": _orbit,
    "area_observe": _observe,
    "follow": _follow,
    "teleop": _teleop,
    "set_speed": _set_speed,
    "deploy": _deploy,
}
"""By behavior's name, for one vehicle."""
