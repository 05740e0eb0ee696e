"""Routes and areas from ground-control files: `.plan`, and `.waypoints` (QGC WPL 110).

Places, and speeds between them, are read. What else such a file commands (camera triggers) belongs
into the mission. MAVLink's MAV_CMD and MAV_FRAME numbers:
https://mavlink.io/en/messages/common.html.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from m2pem.geo.geojson import GeometryError, checked, coordinate
from m2pem.mission.geometry import Area, Coordinate, Route

PLACE_COMMANDS = frozenset({16, 17, 18, 19, 21, 22, 31, 82, 84, 85})
"""MAV_CMD_NAV_: waypoint, loiter (three kinds), land, takeoff, loiter to altitude, spline, VTOL."""

_GROUND_COMMANDS = frozenset({21, 22, 84, 85})
"""Take-off and landing: (0, 0) means "here", and is no place on the route."""

CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED: param 1 is the type of the speed, param 2 the speed in m/s, or -1 for no
change."""

_SPEED_TYPES = (0, 1)
"""Of air and ground; the others are of climbing and descending."""

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
    read = RouteItems()
    for index, item in enumerate(items):
        where = f"mission.items[{index}]"
        if item.get("type") != "SimpleItem":
            kind = item.get("complexItemType", item.get("type"))
            raise GeometryError(f"{where}: a {kind!r} item is no waypoint; use it as an area")
        read.add(item, where)
    return read.route()


@dataclass(slots=True)
class RouteItems:
    """The items of a mission that make a route, one after the other."""

    places: list[tuple[int, Coordinate]] = field(default_factory=list)
    """With their MAV_FRAMEs."""

    speeds_m_s: dict[int, float] = field(default_factory=dict)
    """By the place from which on the vehicle is as fast; one that is set earlier: by the first."""

    def add(self, item: Mapping[str, Any], where: str) -> bool:
        """Add a simple item of a `.plan`; return whether it is a place or a speed.

        Raises:
            GeometryError: it has not seven numbers, or an unknown frame.
        """
        params = item.get("params")
        if not isinstance(params, list) or len(params) != 7:
            raise GeometryError(f"{where}.params: seven numbers are expected")
        return self.add_command(item.get("command"), item.get("frame"), params, where)

    def add_command(
        self, command: object, frame: object, params: Sequence[object], where: str
    ) -> bool:
        """Add an item of any file; return whether it is a place or a speed.

        Raises:
            GeometryError: it has an unknown frame, or a place out of range.
        """
        if command == CHANGE_SPEED:
            type_, speed = params[0], params[1]
            if type_ in _SPEED_TYPES and isinstance(speed, int | float) and speed > 0:
                self.speeds_m_s[max(len(self.places) - 1, 0)] = float(speed)
                return True
            return False
        place = _place(command, params[4], params[5], params[6], where)
        if place is None:
            return False
        self.places.append((_frame(frame, where), place))
        return True

    def route(self) -> Route:
        """Return the route.

        Raises:
            GeometryError: there is no place, or their altitude frames differ.
        """
        if not self.places:
            raise GeometryError("has no waypoint")
        frames = sorted({_FRAMES[frame] for frame, _ in self.places})
        if len(frames) > 1:
            raise GeometryError(f"mixes altitude frames ({', '.join(frames)}); one is expected")
        speeds = tuple(self.speeds_m_s.get(index) for index in range(len(self.places)))
        waypoints = tuple(place for _, place in self.places)
        return Route(waypoints, frames[0], speeds if self.speeds_m_s else ())


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
    read = RouteItems()
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        where = f"line {number}"
        columns = line.split()
        if len(columns) != _WPL_COLUMNS:
            raise GeometryError(f"{where}: has {len(columns)} columns, not {_WPL_COLUMNS}")
        try:
            index, frame, command = int(columns[0]), int(columns[2]), int(float(columns[3]))
            params = [float(column) for column in columns[4:11]]
        except (ValueError, OverflowError):
            raise GeometryError(f"{where}: a number is expected in every column") from None
        home = index == 0 and frame == 0 and command == 16
        if not home:
            read.add_command(command, frame, params, where)
    return read.route()


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
