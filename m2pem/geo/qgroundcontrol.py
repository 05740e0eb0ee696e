"""Routes and areas from ground-control files: `.plan`, and `.waypoints` (QGC WPL 110).

Only places are read. What else such a file commands (camera triggers, speed changes) belongs into
the mission. MAVLink's MAV_CMD and MAV_FRAME numbers: https://mavlink.io/en/messages/common.html.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from m2pem.geo.geojson import GeometryError, checked, coordinate
from m2pem.mission.geometry import Area, Coordinate, Route

PLACE_COMMANDS = frozenset({16, 17, 18, 19, 21, 22, 31, 82, 84, 85})
"""MAV_CMD_NAV_: waypoint, loiter (three kinds), land, takeoff, loiter to altitude, spline, VTOL."""

_GROUND_COMMANDS = frozenset({21, 22, 84, 85})
"""Take-off and landing: (0, 0) means "here", and is no place on the route."""

_FRAMES = {0: "amsl", 5: "amsl", 3: "relative", 6: "relative", 10: "terrain", 11: "terrain"}

WPL_HEADER = "QGC WPL 110"
_WPL_COLUMNS = 12


def parse_plan(plan: Mapping[str, Any], area: bool) -> Route | Area:
    """Read a `.plan`: its waypoints as a route, or (`area`) its one survey or fence polygon.

    Raises:
        GeometryError: not a plan, waypoints of different altitude frames, no or several polygons.
    """
    items = plan_items(plan)
    return _plan_area(plan, items) if area else _plan_route(items)


def plan_items(plan: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Return the mission items of a `.plan`.

    Raises:
        GeometryError: it is not a plan.
    """
    if plan.get("fileType") != "Plan":
        raise GeometryError("is not a QGroundControl plan: 'fileType' is not 'Plan'")
    mission = plan.get("mission")
    items = mission.get("items") if isinstance(mission, Mapping) else None
    if not isinstance(items, list) or not all(isinstance(item, Mapping) for item in items):
        raise GeometryError("mission.items: a list of items is expected")
    return items


def _plan_route(items: Sequence[Mapping[str, Any]]) -> Route:
    places: list[tuple[int, Coordinate]] = []
    for index, item in enumerate(items):
        where = f"mission.items[{index}]"
        if item.get("type") != "SimpleItem":
            kind = item.get("complexItemType", item.get("type"))
            raise GeometryError(f"{where}: a {kind!r} item is no waypoint; use it as an area")
        place = simple_item_place(item, where)
        if place is not None:
            places.append(place)
    return route_of_items(places)


def simple_item_place(item: Mapping[str, Any], where: str) -> tuple[int, Coordinate] | None:
    """Return the MAV_FRAME and the place of a simple item; None if it commands no place.

    Raises:
        GeometryError: it has not seven numbers, or an unknown frame.
    """
    params = item.get("params")
    if not isinstance(params, list) or len(params) != 7:
        raise GeometryError(f"{where}.params: seven numbers are expected")
    place = _place(item.get("command"), params[4], params[5], params[6], where)
    return None if place is None else (_frame(item.get("frame"), where), place)


def _plan_area(plan: Mapping[str, Any], items: Sequence[Mapping[str, Any]]) -> Area:
    polygons = [
        (f"mission.items[{index}].polygon", item["polygon"])
        for index, item in enumerate(items)
        if "polygon" in item
    ]
    fence = plan.get("geoFence")
    fenced = fence.get("polygons") if isinstance(fence, Mapping) else None
    for index, polygon in enumerate(fenced if isinstance(fenced, list) else []):
        if isinstance(polygon, Mapping) and polygon.get("inclusion", True):
            polygons.append((f"geoFence.polygons[{index}].polygon", polygon.get("polygon")))
    if len(polygons) != 1:
        raise GeometryError(
            f"has {len(polygons)} survey and inclusion-fence polygons; exactly one is expected"
        )
    where, corners = polygons[0]
    return plan_polygon(corners, where)


def plan_polygon(corners: object, where: str) -> Area:
    """Return a list of [latitude, longitude] as an area.

    Raises:
        GeometryError: there are less than three, or they bound no area.
    """
    if not isinstance(corners, list) or len(corners) < 3:
        raise GeometryError(f"{where}: at least three corners are expected")
    ring = tuple(_corner(corner, f"{where}[{index}]") for index, corner in enumerate(corners))
    return Area(checked(((*ring, ring[0]),)))


def _corner(value: object, where: str) -> Coordinate:
    if not isinstance(value, list) or len(value) != 2:
        raise GeometryError(f"{where}: a corner is [latitude, longitude]")
    return coordinate(value[0], value[1], None, where)


def parse_waypoints(text: str) -> Route:
    """Read a `.waypoints` file: tab-separated lines under the header `QGC WPL 110`.

    Row 0 in the global frame is the home position, as ground stations write it, and is left out.

    Raises:
        GeometryError: another header, a row that cannot be read, rows of different frames.
    """
    lines = text.splitlines()
    if not lines or lines[0].strip() != WPL_HEADER:
        raise GeometryError(f"is not a waypoint file: line 1 is not '{WPL_HEADER}'")
    places: list[tuple[int, Coordinate]] = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        where = f"line {number}"
        columns = line.split()
        if len(columns) != _WPL_COLUMNS:
            raise GeometryError(f"{where}: has {len(columns)} columns, not {_WPL_COLUMNS}")
        try:
            index, frame, command = int(columns[0]), int(columns[2]), int(float(columns[3]))
            latitude, longitude, altitude = (float(column) for column in columns[8:11])
        except (ValueError, OverflowError):
            raise GeometryError(f"{where}: a number is expected in every column") from None
        home = index == 0 and frame == 0 and command == 16
        place = None if home else _place(command, latitude, longitude, altitude, where)
        if place is not None:
            places.append((_frame(frame, where), place))
    return route_of_items(places)


def _place(
    command: object, latitude: object, longitude: object, altitude: object, where: str
) -> Coordinate | None:
    if not isinstance(command, int) or command not in PLACE_COMMANDS:
        return None
    if command in _GROUND_COMMANDS and not (latitude or longitude):
        return None
    return coordinate(latitude, longitude, altitude, where)


def _frame(frame: object, where: str) -> int:
    if not isinstance(frame, int) or frame not in _FRAMES:
        raise GeometryError(f"{where}: MAV_FRAME {frame!r} is not global, relative or terrain")
    return frame


def route_of_items(places: Sequence[tuple[int, Coordinate]]) -> Route:
    """Return places with their MAV_FRAMEs as a route.

    Raises:
        GeometryError: there is none, or their altitude frames differ.
    """
    if not places:
        raise GeometryError("has no waypoint")
    frames = sorted({_FRAMES[frame] for frame, _ in places})
    if len(frames) > 1:
        raise GeometryError(f"mixes altitude frames ({', '.join(frames)}); one is expected")
    return Route(tuple(place for _, place in places), frames[0])
