"""Waylines of WPML, the KML of DJI and others (DJI Cloud API, `waylines.wpml`).

A wayline is a route: its points in the order of `wpml:index`, with heights and speeds that are
beside their coordinates. What it commands besides is left out, with a warning that names the
waypoints. A `template.kml`, of what was planned and not of what is executed, is refused.
"""

from collections import defaultdict
from math import isfinite, nan

from m2pem.geo.geojson import GeometryError
from m2pem.geo.geometry_files.contents import Contents
from m2pem.geo.geometry_files.kml_elements import Element, child_text, coordinates
from m2pem.mission.geometry import Coordinate, Route

_FRAME_OF = {
    "relativeToStartPoint": "relative",
    "EGM96": "amsl",
    "WGS84": "ellipsoid",
    "aboveGroundLevel": "terrain",
    "realTimeFollowSurface": "terrain",
}
_OF_MISSION = (
    "flyToWaylineMode",
    "finishAction",
    "exitOnRCLost",
    "executeRCLostAction",
    "takeOffSecurityHeight",
    "globalRTHHeight",
)
"""Of `missionConfig`: what commands the vehicle."""

_STRAIGHT = ("", "toPointAndStopWithDiscontinuityCurvature")
_AS_ROUTES = ("", "followWayline")


def has_waylines(root: Element) -> bool:
    return next(root.iter("{*}waylineId", "{*}templateType", "{*}executeHeight"), None) is not None


def read_waylines(root: Element, contents: Contents) -> None:
    """Collect the waylines of a document, each as a route."""
    for config in root.iter("{*}missionConfig"):
        given = {name: child_text(config, name) for name in _OF_MISSION}
        left = [f"{name} {text}" for name, text in given.items() if text not in ("", "noAction")]
        if left:
            contents.warn("missionConfig", f"not read: {', '.join(left)}", "draw it in the mission")
    for folder in root.iter("{*}Folder"):
        name, kind = child_text(folder, "waylineId"), child_text(folder, "templateType")
        if not (name or kind):
            continue
        where = f"wayline {name or child_text(folder, 'templateId')}"
        with contents.feature(where):
            if kind:
                remedy = "export the KMZ with its waylines.wpml"
                raise GeometryError(f"is a template of {kind!r}", remedy)
            route = _route(folder)
            _warn_of_commands(folder, where, contents)
            contents.add(f"wayline_{name}", route)


def _route(folder: Element) -> Route:
    mode = child_text(folder, "executeHeightMode")
    if mode not in _FRAME_OF:
        known = ", ".join(_FRAME_OF)
        raise GeometryError(f"its height mode {mode!r} is not known", f"one of {known}")
    waypoints: list[Coordinate] = []
    speeds: list[float] = []
    for number, placemark in _in_order(folder):
        height_m = _number(child_text(placemark, "executeHeight"), "height", number)
        found = [each for point in placemark.iter("{*}Point") for each in coordinates(point, False)]
        if len(found) != 1:
            raise GeometryError(f"waypoint {number}: has {len(found)} positions")
        latitude, longitude, _ = found[0]
        waypoints.append((latitude, longitude, height_m))
        speed = child_text(placemark, "waypointSpeed") or child_text(folder, "autoFlightSpeed")
        speeds.append(_number(speed, "speed", number))
    if not waypoints:
        raise GeometryError("has no waypoint")
    return Route(tuple(waypoints), _FRAME_OF[mode], tuple(speeds))


def _in_order(folder: Element) -> list[tuple[int, Element]]:
    """Return the waypoints by their `wpml:index`, which is how messages name them."""
    placemarks = [each for each in folder if child_text(each, "index")]
    indices = [child_text(each, "index") for each in placemarks]
    if not all(each.isdecimal() and len(each) < 10 for each in indices):
        raise GeometryError(f"wpml:index {', '.join(indices)[:60]} is not one whole number each")
    numbered = dict(zip(map(int, indices), placemarks, strict=True))
    if len(numbered) < len(placemarks):
        raise GeometryError("two waypoints have the same wpml:index")
    return sorted(numbered.items(), key=lambda each: each[0])


def _number(text: str, what: str, waypoint: int) -> float:
    try:
        number = float(text)
    except ValueError:
        number = nan
    if not isfinite(number) or (what == "speed" and number <= 0):
        raise GeometryError(f"waypoint {waypoint}: {what} {text[:20]!r} cannot be flown")
    return number


def _warn_of_commands(folder: Element, where: str, contents: Contents) -> None:
    at: dict[str, list[str]] = defaultdict(list)
    for group in folder.iter("{*}startActionGroup"):
        for each in group.iter("{*}actionActuatorFunc"):
            at[f"action {each.text}"].append("before the first one")
    for number, placemark in _in_order(folder):
        turn = _first(placemark, "waypointTurnMode")
        heading = _first(placemark, "waypointHeadingMode")
        commands = {f"action {each.text}" for each in placemark.iter("{*}actionActuatorFunc")}
        pitch = _first(placemark, "waypointGimbalPitchAngle")
        commands |= set() if pitch in ("", "0") else {f"gimbal pitch {pitch}"}
        commands |= set() if turn in _STRAIGHT else {f"turn mode {turn}"}
        commands |= set() if heading in _AS_ROUTES else {f"heading mode {heading}"}
        for command in commands:
            at[command[:60]].append(str(number))
    for command, numbers in sorted(at.items()):
        message = f"{command} is not read: of waypoint {', '.join(numbers)[:200]}"
        contents.warn(where, message, "draw it in the mission")


def _first(element: Element, name: str) -> str:
    return (element.findtext(f".//{{*}}{name}") or "").strip()
