"""Files of ground stations: QGroundControl's `.plan`, and mission files with the header QGC WPL.

https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html,
https://mavlink.io/en/file_formats/.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import count, zip_longest
from typing import Any

from m2pem.geo.geojson import GeometryError, coordinate, decoded, parsed_json
from m2pem.geo.geometry_files.contents import Contents, NamedGeometry
from m2pem.geo.geometry_files.mission_commands import KEEP_OUT
from m2pem.geo.geometry_files.mission_items import (
    LARGEST_M,
    MissionItem,
    MissionReader,
    circle,
    parameters,
    polygon,
)
from m2pem.geo.local_frame import LatLon, LocalFrame
from m2pem.geo.polyline import shifted
from m2pem.geo.positions import positions
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_WAYPOINT = 16
"""MAV_CMD_NAV_WAYPOINT."""

_CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED: param 1 is the type of the speed, param 2 the speed in m/s."""

_TAKE_OFFS = (22, 84)
"""MAV_CMD_NAV_TAKEOFF, MAV_CMD_NAV_VTOL_TAKEOFF."""

_GROUND_SPEED = 1
"""SPEED_TYPE_GROUNDSPEED."""

_MISSION_FRAME = 2
"""MAV_FRAME_MISSION: of commands without a place."""

_FRAME_NUMBERS = {"amsl": 0, "relative": 3, "terrain": 10}
"""MAV_FRAME_GLOBAL, _RELATIVE_ALT, _TERRAIN_ALT."""

_ALTITUDE_MODES: Mapping[object, int] = {3: 1, 0: 2, 10: 4}
"""QGroundControl's AltitudeMode, by MAV_FRAME."""
_CALCULATED = 3
"""AltitudeMode of a height above ground that QGroundControl has made an altitude above sea level:
the altitude is null until it knows the ground."""
_MIXED = 0

_PX4 = 12
"""MAV_AUTOPILOT_PX4: its waypoints have null where they have no heading."""

WPL_HEADER = "QGC WPL 110"
_WPL_COLUMNS = 12
_WITHOUT_HOME = "QGC WPL 120"
"""QGroundControl's own of old: its first row is the first item."""

_LANDINGS = ("fwLandingPattern", "vtolLandingPattern")
_PATTERNS = ("survey", "CorridorScan")
_FLOWN = (
    *("angle", "AdjustedFootprintSide", "DistanceToSurface", "DistanceMode", "TurnAroundDistance"),
    *("FollowTerrain", "Refly90Degrees", "flyAlternateTransects", "entryLocation", "EntryPoint"),
    *("CameraName", "spacing", "altitude", "relativeAltitude", "turnAroundDistance"),
)
"""How a pattern is flown, by QGroundControl's keys; the last four are its old ones."""


def read_plan(content: bytes, contents: Contents) -> None:
    """Collect a plan's waypoints as a route, surveys and fences as areas, rally points as points.

    Raises:
        GeometryError: it is not a plan.
    """
    plan = parsed_json(decoded(content))
    if not isinstance(plan, Mapping):
        raise GeometryError("a JSON object is expected")
    if plan.get("fileType") != "Plan":
        raise GeometryError("is not a QGroundControl plan: 'fileType' is not 'Plan'")
    mission = _mapping(plan.get("mission"))
    versions = plan.get("version", 1), mission.get("version", 2)
    if versions != (1, 2):
        raise GeometryError(
            f"has the versions {versions} of the plan and its mission; (1, 2) are known",
            "open it in QGroundControl and save it again",
        )
    items = mission.get("items")
    reader = MissionReader(contents, zero_is_north=mission.get("firmwareType") == _PX4)
    with contents.feature("mission", "route"):
        if not isinstance(items, list) or not all(isinstance(item, Mapping) for item in items):
            raise GeometryError("items: a list of items is expected")
        number = 0
        for index, item in enumerate(items):
            given = item.get("doJumpId")
            number = given if isinstance(given, int) else number + 1
            where = f"item {number} (mission.items[{index}])"
            if item.get("type") == "SimpleItem":
                reader.add(_simple_item_of(item, number, where))
            else:
                _read_complex(item, number, contents, reader)
        reader.finish()
    _read_fence(plan, contents)
    for index, place in enumerate(_members(plan, "rallyPoints", "points")):
        where = f"rallyPoints.points[{index}]"
        with contents.feature(where, "point"):
            contents.add("rally", Point(_place_of(place, where)))


def _simple_item_of(item: Mapping[str, Any], number: int, where: str) -> MissionItem:
    params, place, command = item.get("params"), item.get("coordinate"), item.get("command")
    if not isinstance(params, list) or type(command) is not int:
        raise GeometryError(f"{where}: 'command', a number, and 'params', seven, are expected")
    if isinstance(place, list) and len(params) == 4:
        params = [*params, *place]  # as QGroundControl wrote it at first
    if item.get("AltitudeMode") == _CALCULATED and params[6:] == [None]:
        raise GeometryError(
            f"{where}: its altitude above the terrain is not calculated",
            "save the plan again in QGroundControl, once it has the heights of the ground",
        )
    known, goes_on = parameters(params, where), item.get("autoContinue") is not False
    return MissionItem(number, where, command, item.get("frame"), known, goes_on)


def _read_complex(
    item: Mapping[str, Any], number: int, contents: Contents, reader: MissionReader
) -> None:
    kind = str(item.get("complexItemType") or item.get("type") or "no 'type'")[:40]
    where = f"item {number} ({kind})"
    reader.add_pattern(number, f"a {kind}")
    with contents.feature(where):
        if kind in _PATTERNS:
            is_corridor = kind == "CorridorScan"
            area = _corridor(item) if is_corridor else _polygon(item, where, contents)
            contents.add("corridor" if is_corridor else kind, area)
            style = _mapping(item.get("TransectStyleComplexItem"))
            old, camera = _mapping(item.get("grid")), _mapping(style.get("CameraCalc"))
            given = {**old, **item, **style, **camera}
            flown = [f"{key} {given[key]}" for key in _FLOWN if given.get(key) is not None]
            message = f"only its area is read, not {', '.join(flown)[:300] or 'more'}"
            remedy = "set heading, spacing, altitude and overshoot of a task `area_survey`"
            contents.warn(where, message, remedy)
        elif kind in _LANDINGS:
            remedy = "a task `land` or `return_to_launch`"
            contents.warn(where, "a landing is left out", remedy, "route")
        elif kind == "StructureScan":
            remedy = "a task `orbit` around its middle, or a route around it at each height"
            raise GeometryError("its polygon is a building, no area to survey", remedy)
        else:
            raise GeometryError("is not read", "draw what it does as tasks of the mission")


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _corridor(item: Mapping[str, Any]) -> Area:
    """Return the corridor along a line as an area.

    Raises:
        GeometryError: it has no line or width, or its sides cross.
    """
    line, width_m = item.get("polyline"), item.get("CorridorWidth")
    if not isinstance(line, list) or len(line) < 2:
        raise GeometryError("polyline: at least two positions are expected")
    if not isinstance(width_m, int | float) or not 0 < width_m < LARGEST_M:
        raise GeometryError("its CorridorWidth is no width", "give it one in metres")
    places = [_corner(each, f"polyline[{index}]") for index, each in enumerate(line)]
    frame = LocalFrame(places[0])
    middle = [(*frame.to_local(place), 0.0) for place in places]
    sides = [*shifted(middle, width_m / 2), *reversed(shifted(middle, -width_m / 2))]
    try:
        return polygon([frame.to_latlon(each[:2]) for each in sides])
    except GeometryError as error:
        remedy = f"draw it as an area, {width_m:g} m wide"
        raise GeometryError(f"its sides cross: {error}", remedy) from None


def _read_fence(plan: Mapping[str, Any], contents: Contents) -> None:
    for section, key in (("polygons", "polygon"), ("circles", "circle")):
        for index, each in enumerate(_members(plan, "geoFence", section)):
            where = f"geoFence.{section}[{index}]"
            with contents.feature(where, "area"):
                shape = _mapping(each).get(key)
                name = "fence" if _mapping(each).get("inclusion", True) else KEEP_OUT
                if isinstance(shape, Mapping):
                    contents.add(name, _circle(shape, where, name))
                else:
                    contents.add(name, _polygon(_mapping(each), where, contents))
    fence = _mapping(plan.get("geoFence"))
    if fence.get("polygon"):  # as QGroundControl wrote it at first
        with contents.feature("geoFence.polygon", "area"):
            contents.add("fence", _polygon(fence, "geoFence", contents))
    if fence.get("breachReturn"):
        with contents.feature("geoFence.breachReturn", "point"):
            contents.add("fence_return", Point(_place_of(fence["breachReturn"], "breachReturn")))


def _circle(shape: Mapping[str, Any], where: str, name: str) -> Area:
    radius = shape.get("radius")
    radius_m = radius if isinstance(radius, int | float) else None
    return circle(_corner(shape.get("center"), where), radius_m, name == "fence")


def _polygon(shape: Mapping[str, Any], where: str, contents: Contents) -> Area:
    corners = shape.get("polygon")
    if not isinstance(corners, list) or len(corners) < 3:
        raise GeometryError("polygon: at least three corners are expected")
    places = [_corner(each, f"polygon[{index}]") for index, each in enumerate(corners)]
    return polygon(places, partial(contents.warn, where))


def _corner(value: object, where: str) -> LatLon:
    if not isinstance(value, list) or len(value) != 2:
        raise GeometryError(f"{where}: [latitude, longitude] is expected")
    return coordinate(value[0], value[1], None, where)[:2]


def _place_of(value: object, where: str) -> Coordinate:
    if not isinstance(value, list) or len(value) not in (2, 3):
        raise GeometryError(f"{where}: [latitude, longitude, altitude] is expected")
    return coordinate(value[0], value[1], value[2] if len(value) == 3 else None, where)


def _members(plan: Mapping[str, Any], section: str, key: str) -> list[Any]:
    members = _mapping(plan.get(section)).get(key)
    return members if isinstance(members, list) else []


def read_waypoints(content: bytes, contents: Contents) -> None:
    """Collect the route, the fences and the rally points of a file with the header `QGC WPL`.

    The first row is the home position, which is no waypoint; in version 120 only if it is absolute
    and a take-off follows.

    Raises:
        GeometryError: another header, or a row that cannot be read.
    """
    lines = [line.split() for line in decoded(content).splitlines()]
    rows = [(number, line) for number, line in enumerate(lines, 1) if line and line[0][0] != "#"]
    header = " ".join(rows[0][1]) if rows else ""
    if header not in (WPL_HEADER, _WITHOUT_HOME):
        raise GeometryError(
            f"is not a waypoint file: line {rows[0][0] if rows else 1} is not '{WPL_HEADER}'",
            "save the mission, fence or rally points again by the ground station",
        )
    contents.expect(rows[1:])
    items = [_row_item(columns, line) for line, columns in rows[1:]]
    first, after = (items[0] if items else None), items[1:2]
    is_absolute = first is not None and first.frame == _FRAME_NUMBERS["amsl"]
    takes_off = is_absolute and any(each.command in _TAKE_OFFS for each in after)
    if first and first.command == _WAYPOINT and (header == WPL_HEADER or takes_off):
        del items[0]
        if header == _WITHOUT_HOME or not is_absolute or first.number != 0:
            remedy = f"'{_WITHOUT_HOME}' is the header of files without it"
            contents.warn(first.where, "is taken as the home position", remedy, "route")
    reader = MissionReader(contents)
    for item in items:
        reader.add(item)
    reader.finish()


def _row_item(columns: Sequence[str], line: int) -> MissionItem:
    if len(columns) != _WPL_COLUMNS:
        raise GeometryError(f"line {line}: has {len(columns)} columns, not {_WPL_COLUMNS}")
    try:
        numbers = [float(each) for each in columns]
        index, _, frame, command = (int(each) for each in numbers[:4])
    except (ValueError, OverflowError):
        raise GeometryError(f"line {line}: a number is expected in every column") from None
    where, params = f"item {index} (line {line})", numbers[4:11]
    return MissionItem(index, where, command, frame, parameters(params, where), bool(numbers[11]))


def write_plan(geometries: Sequence[NamedGeometry], altitude_m: float | None) -> bytes:
    """Return a plan: the one route as its mission, areas as fences, points as rally points.

    Holes of areas become fences that keep out. Names are not kept.

    Raises:
        GeometryError: there are two routes, or a waypoint has no altitude.
    """
    name, route = _only_route(geometries)
    items = [_simple_item(item) for item in _items(name, route, altitude_m)]
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
    rally = [
        _rally(each.name, each.geometry, altitude_m)
        for each in geometries
        if isinstance(each.geometry, Point)
    ]
    home = next(positions(route if route.waypoints else geometries[0].geometry))[:2]
    is_mixed = len(set(route.frames)) > 1
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
            "globalPlanAltitudeMode": _MIXED
            if is_mixed
            else _ALTITUDE_MODES[_FRAME_NUMBERS[route.altitude_frame]],
            "plannedHomePosition": [*home, 0],
            "items": items,
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
    name, route = _only_route(geometries)
    if len(geometries) > 1 or not route.waypoints:
        raise GeometryError(
            "holds one route and nothing else: choose a route, or .plan or .geojson"
        )
    home = route.waypoints[0][:2]
    rows: list[tuple[object, ...]] = [(0, 1, 0, _WAYPOINT, 0, 0, 0, 0, *home, 0.0, 1)]
    for item in _items(name, route, altitude_m):
        params = (each or 0 for each in item.params)
        rows.append((item.number, 0, item.frame, item.command, *params, 1))
    lines = ("\t".join(str(number) for number in row) for row in rows)
    return "\n".join((WPL_HEADER, *lines, "")).encode()


def _items(name: str, route: Route, altitude_m: float | None) -> Iterator[MissionItem]:
    """Yield the waypoints of a route, and the speed behind each that has one."""
    number = count(1)
    places = _with_altitudes(name, route.waypoints, altitude_m)
    for place, frame, speed in zip_longest(places, route.frames, route.speeds_m_s):
        params = (0, 0, 0, None, *place)
        yield MissionItem(next(number), "", _WAYPOINT, _FRAME_NUMBERS[frame], params)
        if speed is not None:
            params = (_GROUND_SPEED, speed, -1, 0, 0, 0, 0)
            yield MissionItem(next(number), "", _CHANGE_SPEED, _MISSION_FRAME, params)


def _simple_item(item: MissionItem) -> dict[str, Any]:
    simple = {
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "params": list(item.params),
        "autoContinue": True,
        "doJumpId": item.number,
    }
    if item.command == _WAYPOINT:
        simple["AltitudeMode"] = _ALTITUDE_MODES[item.frame]
        simple["Altitude"] = item.params[6]
        simple["AMSLAltAboveTerrain"] = None
    return simple


def _only_route(geometries: Sequence[NamedGeometry]) -> tuple[str, Route]:
    """Return the one route and its name; one without waypoints: there is none."""
    routes = [(each.name, each.geometry) for each in geometries if isinstance(each.geometry, Route)]
    if len(routes) > 1:
        names = ", ".join(name for name, _ in routes[:5])
        raise GeometryError(f"holds one route, not {len(routes)} ({names}): choose one")
    return routes[0] if routes else ("", Route(()))


def _with_altitudes(
    name: str, waypoints: Sequence[Coordinate], altitude_m: float | None
) -> Iterator[tuple[float, float, float]]:
    for number, (latitude, longitude, altitude) in enumerate(waypoints, start=1):
        height = altitude_m if altitude is None else altitude
        if height is None:
            raise GeometryError(
                f"{name}: waypoint {number} has no altitude, and one is needed: give it one, "
                "or say which those without one get (altitude_m)"
            )
        if not latitude and not longitude:
            raise GeometryError(
                f"{name}: waypoint {number} is at 0, 0, which in such files means where the "
                "vehicle is: move it by a little"
            )
        yield latitude, longitude, height


def _rally(name: str, point: Point, altitude_m: float | None) -> list[float]:
    if point.altitude_frame != "relative":
        raise GeometryError(
            f"{name}: a rally point is {point.altitude_frame}, and only altitudes "
            "above home can be written"
        )
    (place,) = _with_altitudes(name, (point.position,), altitude_m)
    return list(place)
