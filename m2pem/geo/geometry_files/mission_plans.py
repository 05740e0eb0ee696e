"""Files of ground stations: QGroundControl's `.plan`, and `.waypoints` (QGC WPL 110).

Places and speeds are read: other commands (camera triggers) belong into the mission.
https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

from m2pem.geo.file_text import decoded, parsed_json
from m2pem.geo.geojson import GeometryError, coordinate
from m2pem.geo.geometry_files.contents import Contents, FeatureProblemError, NamedGeometry
from m2pem.geo.qgroundcontrol import (
    CHANGE_SPEED,
    PLACE_COMMANDS,
    WPL_HEADER,
    RouteItems,
    parse_waypoints,
    plan_items,
    plan_polygon,
)
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_WAYPOINT = 16
"""MAV_CMD_NAV_WAYPOINT."""

_GROUND_SPEED = 1
"""SPEED_TYPE_GROUNDSPEED."""

_MISSION_FRAME = 2
"""MAV_FRAME_MISSION: of commands without a place."""

_FRAME_NUMBERS = {"amsl": 0, "relative": 3, "terrain": 10}
"""MAV_FRAME_GLOBAL, _RELATIVE_ALT, _TERRAIN_ALT."""

_ALTITUDE_MODES = {"relative": 1, "amsl": 2, "terrain": 4}
"""QGroundControl's AltitudeMode."""

_SURVEYS = {"survey": "polygon", "StructureScan": "polygon"}
_CORRIDOR = "CorridorScan"


def read_plan(content: bytes, contents: Contents) -> None:
    """Collect a plan's waypoints as a route, surveys and fences as areas, rally points as points.

    Raises:
        GeometryError: it is not a plan.
    """
    plan = parsed_json(decoded(content))
    if not isinstance(plan, Mapping):
        raise GeometryError("a JSON object is expected")
    items = plan_items(plan)
    _read_waypoints(items, contents)
    for index, item in enumerate(items):
        if item.get("type") != "SimpleItem":
            _read_complex(item, f"mission.items[{index}]", contents)
    for index, polygon in enumerate(_members(plan, "geoFence", "polygons")):
        where = f"geoFence.polygons[{index}]"
        with contents.feature(where):
            if not isinstance(polygon, Mapping):
                raise GeometryError("an object with 'polygon' is expected")
            name = "fence" if polygon.get("inclusion", True) else "keep_out"
            contents.add(name, plan_polygon(polygon.get("polygon"), f"{where}.polygon"))
    for index, _ in enumerate(_members(plan, "geoFence", "circles")):
        with contents.feature(f"geoFence.circles[{index}]"):
            raise FeatureProblemError("a circle is no area", "draw it as a polygon")
    for index, place in enumerate(_members(plan, "rallyPoints", "points")):
        where = f"rallyPoints.points[{index}]"
        with contents.feature(where):
            if not isinstance(place, list) or len(place) != 3:
                raise GeometryError("a rally point is [latitude, longitude, altitude]")
            contents.add("rally", Point(coordinate(place[0], place[1], place[2], where)))


def _read_waypoints(items: Sequence[Mapping[str, Any]], contents: Contents) -> None:
    with contents.feature("mission"):
        read = RouteItems()
        others: Counter[object] = Counter()
        for index, item in enumerate(items):
            if item.get("type") != "SimpleItem":
                continue
            is_read = read.add(item, f"mission.items[{index}]")
            if not is_read and item.get("command") not in PLACE_COMMANDS:
                others[item.get("command")] += 1
        if others:
            numbers = ", ".join(str(command)[:20] for command in sorted(others, key=str)[:10])
            contents.warn(
                "mission",
                f"{others.total()} items with other commands than places and speeds (MAV_CMD "
                f"{numbers})",
                "draw what they do as tasks of the mission",
            )
        if read.places:
            contents.add("", read.route())


def _read_complex(item: Mapping[str, Any], where: str, contents: Contents) -> None:
    kind = item.get("complexItemType")
    with contents.feature(where):
        if kind in _SURVEYS:
            contents.add("survey", plan_polygon(item.get("polygon"), f"{where}.polygon"))
        elif kind == _CORRIDOR:
            line = item.get("polyline")
            if not isinstance(line, list) or len(line) < 2:
                raise GeometryError("polyline: at least two positions are expected")
            contents.add(
                "corridor",
                Route(tuple(_flat(each, f"polyline[{n}]") for n, each in enumerate(line))),
            )
        else:
            raise FeatureProblemError(
                f"a {str(kind or item.get('type'))[:40]!r} item has no waypoints that are read",
                "draw what it does as tasks of the mission",
            )


def _flat(value: object, where: str) -> Coordinate:
    if not isinstance(value, list) or len(value) != 2:
        raise GeometryError(f"{where}: a position is [latitude, longitude]")
    return coordinate(value[0], value[1], None, where)


def _members(plan: Mapping[str, Any], section: str, key: str) -> list[Any]:
    found = plan.get(section)
    members = found.get(key) if isinstance(found, Mapping) else None
    return members if isinstance(members, list) else []


def read_waypoints(content: bytes, contents: Contents) -> None:
    """Collect the route of a file.

    Raises:
        GeometryError: a row cannot be read, or the rows have different frames.
    """
    contents.add("", parse_waypoints(decoded(content)))


def write_plan(geometries: Sequence[NamedGeometry], altitude_m: float | None) -> bytes:
    """Return a plan: the one route as its mission, areas as fences, points as rally points.

    Holes of areas become fences that keep out. Names are not kept.

    Raises:
        GeometryError: there are two routes, or a waypoint has no altitude.
    """
    route = _only_route(geometries)
    waypoints = list(_waypoints(route, altitude_m)) if route is not None else []
    frame = route.geometry.altitude_frame if route is not None else "relative"
    polygons = [
        {
            "polygon": [list(corner[:2]) for corner in ring[:-1]],
            "inclusion": index == 0,
            "version": 1,
        }
        for each in geometries
        if isinstance(each.geometry, Area)
        for index, ring in enumerate(each.geometry.rings)
    ]
    rally = [_rally(each, altitude_m) for each in geometries if isinstance(each.geometry, Point)]
    home = next((place[:2] for place in waypoints), None) or next(_places(geometries))[:2]
    plan = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "m2pem",
        "mission": {
            "version": 2,
            "firmwareType": 12,
            "vehicleType": 2,
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "globalPlanAltitudeMode": _ALTITUDE_MODES[frame],
            "plannedHomePosition": [*home, 0],
            "items": [
                _simple_item(number, command, params, frame)
                for number, (command, params) in enumerate(_items(route, waypoints), start=1)
            ],
        },
        "geoFence": {"version": 2, "circles": [], "polygons": polygons},
        "rallyPoints": {"version": 2, "points": rally},
    }
    return (json.dumps(plan, indent=4) + "\n").encode()


def write_waypoints(geometries: Sequence[NamedGeometry], altitude_m: float | None) -> bytes:
    """Return the one route as rows, after the home position, which is its first waypoint at 0 m.

    Raises:
        GeometryError: there is not one route alone, or a waypoint has no altitude.
    """
    route = _only_route(geometries)
    others = [each.name for each in geometries if not isinstance(each.geometry, Route)]
    if others or route is None:
        raise GeometryError(
            "holds one route and nothing else: choose a route, or .plan or .geojson"
        )
    waypoints = list(_waypoints(route, altitude_m))
    frame = _FRAME_NUMBERS[route.geometry.altitude_frame]
    rows: list[tuple[float, ...]] = [(0, 1, 0, _WAYPOINT, 0, 0, 0, 0, *waypoints[0][:2], 0.0, 1)]
    for index, (command, params) in enumerate(_items(route, waypoints), start=1):
        own = frame if command == _WAYPOINT else _MISSION_FRAME
        rows.append((index, 0, own, command, *(each or 0 for each in params), 1))
    lines = ("\t".join(str(number) for number in row) for row in rows)
    return "\n".join((WPL_HEADER, *lines, "")).encode()


def _items(
    route: NamedGeometry | None, waypoints: Sequence[tuple[float, float, float]]
) -> Iterator[tuple[int, tuple[float | None, ...]]]:
    """Yield the commands of a route with their seven parameters: waypoints, and the speed behind
    each that has one."""
    geometry = route.geometry if route is not None else None
    speeds = geometry.speeds_m_s if isinstance(geometry, Route) else ()
    for place, speed in zip_longest(waypoints, speeds):
        yield _WAYPOINT, (0, 0, 0, None, *place)
        if speed is not None:
            yield CHANGE_SPEED, (_GROUND_SPEED, speed, -1, 0, 0, 0, 0)


def _simple_item(
    number: int, command: int, params: Sequence[float | None], frame: str
) -> dict[str, Any]:
    item = {
        "type": "SimpleItem",
        "command": command,
        "frame": _FRAME_NUMBERS[frame] if command == _WAYPOINT else _MISSION_FRAME,
        "params": list(params),
        "autoContinue": True,
        "doJumpId": number,
    }
    if command != _WAYPOINT:
        return item
    return {
        **item,
        "AltitudeMode": _ALTITUDE_MODES[frame],
        "Altitude": params[6],
        "AMSLAltAboveTerrain": None,
    }


def _only_route(geometries: Sequence[NamedGeometry]) -> NamedGeometry | None:
    routes = [each for each in geometries if isinstance(each.geometry, Route)]
    if len(routes) > 1:
        names = ", ".join(each.name for each in routes[:5])
        raise GeometryError(f"holds one route, not {len(routes)} ({names}): choose one")
    return routes[0] if routes else None


def _waypoints(
    route: NamedGeometry, altitude_m: float | None
) -> Iterator[tuple[float, float, float]]:
    positions = route.geometry.waypoints if isinstance(route.geometry, Route) else ()
    for number, (latitude, longitude, altitude) in enumerate(positions, start=1):
        height = altitude_m if altitude is None else altitude
        if height is None:
            raise GeometryError(
                f"{route.name}: waypoint {number} has no altitude, and one is needed: give it one, "
                "or say which those without one get (altitude_m)"
            )
        yield latitude, longitude, height


def _rally(point: NamedGeometry, altitude_m: float | None) -> list[float]:
    place = point.geometry.position if isinstance(point.geometry, Point) else (0.0, 0.0, None)
    if point.geometry.altitude_frame != "relative":
        raise GeometryError(
            f"{point.name}: a rally point is {point.geometry.altitude_frame}, and only altitudes "
            "above home can be written"
        )
    ((latitude, longitude, height),) = _waypoints(
        NamedGeometry(point.name, Route((place,))), altitude_m
    )
    return [latitude, longitude, height]


def _places(geometries: Sequence[NamedGeometry]) -> Iterator[Coordinate]:
    for each in geometries:
        geometry = each.geometry
        if isinstance(geometry, Point):
            yield geometry.position
        else:
            yield from geometry.waypoints if isinstance(geometry, Route) else geometry.rings[0]
