"""What the shared behaviors command a vehicle, derived from the request (docs/fleets.md)."""

from collections.abc import Callable, Mapping

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.commanded import Commanded, ExpectedEnd, LatLonLine
from m2pem.geo.local_frame import LocalFrame
from m2pem.geo.survey_tracks import SURVEY_SPACING_M, SurveyTracks
from m2pem.mission.geometry import Area, Point

COVERING_SHARE = 0.75
"""Of the spacing: passes that lie otherwise than those derived here cover them all the same."""


def commanded_by(
    request: BehaviorRequest, *, flies: bool = False, straight: bool = True
) -> Commanded:
    """Return what a request commands its vehicle; of a behavior that is not shared, and of a team's
    for each member, only that safety is watched.

    `straight`: whether its arbiter moves it along straight lines between waypoints.
    """
    if len([each for each in request.resources if "/" not in each]) != 1:
        return Commanded()
    derive = _DERIVED.get(request.behavior)
    if derive is None:
        return Commanded()
    return derive(BehaviorParameters(request.parameters), flies, straight)


def _routing(given: BehaviorParameters, flies: bool, straight: bool) -> Commanded:
    route = given.route
    if route is None:
        return Commanded()
    way, frames = [], []
    for (latitude, longitude, up_m), frame in zip(route.waypoints, route.frames, strict=True):
        way.append((latitude, longitude, given.altitude_m if up_m is None else up_m))
        frames.append(given.altitude_frame if up_m is None else frame)
    return Commanded(
        tuple(way),
        tuple(frames),
        straight=straight,
        loop=given.loop,
        end=ExpectedEnd.NONE if given.loop else ExpectedEnd.PLACE,
        speed_m_s=given.speed_m_s,
        in_air=flies,
    )


def _goto(given: BehaviorParameters, flies: bool, straight: bool) -> Commanded:
    target = given.target
    if not isinstance(target, Point):  # a vehicle that may move
        return Commanded(in_air=flies, speed_m_s=given.speed_m_s)
    latitude, longitude, up_m = target.position
    own = up_m is not None
    return Commanded(
        ((latitude, longitude, up_m if own else given.altitude_m),),
        (target.altitude_frame if own else given.altitude_frame,),
        straight=straight,
        end=ExpectedEnd.PLACE,
        tolerance_m=given.tolerance_m,
        speed_m_s=given.speed_m_s,
        in_air=flies,
    )


def _survey(given: BehaviorParameters, flies: bool, straight: bool) -> Commanded:
    if given.area is None:
        return Commanded()
    spacing_m = given.spacing_m or SURVEY_SPACING_M
    lines = survey_lines(given.area, spacing_m, given.yaw_rad)
    return Commanded(
        lines=lines,
        reach_m=COVERING_SHARE * spacing_m,
        end=ExpectedEnd.COVERED if lines else ExpectedEnd.NONE,
        speed_m_s=given.speed_m_s,
        in_air=flies,
    )


def survey_lines(area: Area, spacing_m: float, yaw_rad: float | None) -> tuple[LatLonLine, ...]:
    """Return the passes over an area, without the ways between them; none where there are none."""
    frame = LocalFrame(area.rings[0][0][:2])
    rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings]
    try:
        tracks = SurveyTracks.over(rings, spacing_m, yaw_rad)
    except ValueError:  # its arbiter refuses it
        return ()
    points = [frame.to_latlon(point) for point in tracks.line.points]
    return tuple((points[index], points[index + 1]) for index, *_ in tracks.passes)


def _height(given: BehaviorParameters, flies: bool, straight: bool) -> Commanded:
    del straight
    end = ExpectedEnd.HEIGHT if flies else ExpectedEnd.NONE
    return Commanded(end=end, height_m=given.altitude_m, height_frame=given.altitude_frame)


def _reverse(given: BehaviorParameters, flies: bool, straight: bool) -> Commanded:
    del flies, straight
    return Commanded(end=ExpectedEnd.MOVED, distance_m=given.distance_m, speed_m_s=given.speed_m_s)


def _constant(commanded: Commanded) -> "_Derive":
    return lambda given, flies, straight: commanded


_Derive = Callable[[BehaviorParameters, bool, bool], Commanded]

_DERIVED: Mapping[str, _Derive] = {
    "single_vehicle_routing": _routing,
    "goto": _goto,
    "area_survey": _survey,
    "takeoff": _height,
    "change_altitude": _height,
    "reverse": _reverse,
    "hold": _constant(Commanded(end=ExpectedEnd.REST)),
    "drive_stop": _constant(Commanded(end=ExpectedEnd.REST)),
    "land": _constant(Commanded(end=ExpectedEnd.LANDED, comes_down=True)),
    "return_to_launch": _constant(Commanded(end=ExpectedEnd.HOME, comes_down=True)),
}
