"""The items of a ground station's mission as behaviors, one after the other.

Waypoints in a row are one route, read as that of a file (`mission_items`). What a route has no
place for is a behavior between two routes, or is refused: a vehicle must not fly another way than
the items say.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from m2pem.findings import Severity
from m2pem.geo.geojson import GeometryError, coordinate
from m2pem.geo.geometry_files.contents import Contents, FileProblem
from m2pem.geo.geometry_files.mission_commands import (
    LANDING_SECTION,
    RALLY_POINT,
    Treatment,
    command_of,
)
from m2pem.geo.geometry_files.mission_items import MissionItem, MissionReader, frame_of
from m2pem.mission.geometry import Area, Coordinate, Point, Route

TaskValue: TypeAlias = str | int | Point | Route

_WAYPOINT, _STAY, _TURNS, _RETURN, _DELAY = 16, 17, 18, 20, 93
_LANDINGS = frozenset({21, 85})
_TAKE_OFFS = frozenset({22, 84})
_PICTURES = 2000
"""MAV_CMD_NAV_WAYPOINT, NAV_LOITER_UNLIM, NAV_LOITER_TURNS, NAV_RETURN_TO_LAUNCH, NAV_DELAY,
NAV_LAND and NAV_VTOL_LAND, NAV_TAKEOFF and NAV_VTOL_TAKEOFF, IMAGE_START_CAPTURE."""

_SAME_PLACE_DEG = 1e-6
_FRAME_NUMBERS = {"amsl": 0, "relative": 3, "terrain": 10}
"""MAV_FRAME."""


@dataclass(frozen=True, slots=True)
class MissionTask:
    """A behavior of items. `items`: their numbers; of a route and a `goto`, one for each waypoint.
    `parameters`: as in a mission file; points and routes as they are. `of_payload`: a camera of the
    vehicle does it."""

    behavior: str
    items: tuple[int, ...]
    parameters: dict[str, TaskValue] = field(default_factory=dict)
    of_payload: bool = False

    @property
    def places(self) -> list[tuple[Coordinate, str]]:
        """The places that it leads to with their altitude frames, one for each item; empty: it
        leads to none."""
        route, target = self.parameters.get("route"), self.parameters.get("target")
        if isinstance(route, Route):
            return list(zip(route.waypoints, route.frames, strict=True))
        if isinstance(target, Point):
            return [(target.position, target.altitude_frame)]
        return []


@dataclass(frozen=True, slots=True)
class MissionTasks:
    """`problems`: an ERROR refuses the mission; a WARNING says what of it is left out, and does not
    change the way. Each names its item."""

    tasks: tuple[MissionTask, ...]
    problems: tuple[FileProblem, ...]


def read_mission_tasks(items: Iterable[MissionItem]) -> MissionTasks:
    """Read the items of a mission. Nothing is raised for bad ones."""
    reader = _Reader(Contents("mission"))
    for item in items:
        with reader.contents.feature(f"item {item.number}"):
            reader.add(_called(item))
    reader.end_route()
    problems = tuple(each for each in reader.contents.whole().problems if each.feature)
    return MissionTasks(tuple(reader.tasks), problems)


def read_fence_items(items: Iterable[MissionItem]) -> tuple[dict[str, Area], list[FileProblem]]:
    """Return the areas of a fence's items by their names, `fence...` and `keep_out...`, and what is
    wrong with them."""
    contents = Contents("fence")
    reader = MissionReader(contents)
    for item in items:
        with contents.feature(f"item {item.number}"):
            if command_of(item.command, item.params).treatment is not Treatment.FENCE:
                raise GeometryError("is no part of a fence")
            if any(item.params[4:6]) or any(item.params[:1]):  # else MAVSDK's way to say "none"
                reader.add(_called(item))
    reader.finish()
    read = contents.whole()
    areas = {each.name: each.geometry for each in read.geometries}
    problems = [each for each in read.problems if each.feature]
    return {name: each for name, each in areas.items() if isinstance(each, Area)}, problems


def read_rally_items(items: Iterable[MissionItem]) -> tuple[list[Point], list[FileProblem]]:
    """Return the rally points of items, and what is wrong with them."""
    contents = Contents("rally points")
    points: list[Point] = []
    for item in items:
        with contents.feature(f"item {item.number}"):
            if item.command != RALLY_POINT:
                raise GeometryError("is no rally point")
            called = _called(item)
            latitude, longitude, altitude = item.params[4:]
            place = coordinate(latitude, longitude, altitude, called.where)
            points.append(Point(place, frame_of(called)))
    return points, [each for each in contents.whole().problems if each.feature]


def _called(item: MissionItem) -> MissionItem:
    """Return an item that errors call by its command: its number is said already."""
    return replace(item, where=command_of(item.command, item.params).title)


@dataclass(slots=True)
class _Reader:
    contents: Contents
    tasks: list[MissionTask] = field(default_factory=list)
    _route: MissionReader | None = None
    _numbers: list[int] = field(default_factory=list)
    """Of the items that are waypoints of the route."""
    _place: tuple[Coordinate, str] | None = None
    """The last waypoint and its frame."""
    _speed: MissionItem | None = None
    _over: str = ""
    """What the mission has ended with."""
    _is_landing: bool = False

    def add(self, item: MissionItem) -> None:
        command = command_of(item.command, item.params)
        if self._is_landing or (self._over and item.command in LANDING_SECTION):
            self._is_landing = True
            self._leave_out(item, "part of a landing that the mission does not come to")
            return
        moves = command.treatment not in (Treatment.SPEED, Treatment.LEFT_OUT)
        if self._over and (moves or item.command == _DELAY):
            raise GeometryError(f"{command.title} comes after {self._over}, which is the end")
        match command.treatment:
            case Treatment.BEGIN if item.command in _TAKE_OFFS and not self.tasks:
                self._take_off(item)
            case Treatment.WAYPOINT | Treatment.WAIT:
                self._add_waypoint(item)
            case Treatment.STAY if item.command == _TURNS:
                self._circle(item)
            case Treatment.STAY:
                self._add_waypoint(replace(item, params=(None, *item.params[1:])))
                self._end("hold", item, command.title)
            case Treatment.END if item.command == _RETURN:
                self._end("return_to_launch", item, command.title)
            case Treatment.END if item.command in _LANDINGS:
                self._land(item, command.title)
            case Treatment.SPEED:
                self._speed = item
                self._reader().add(item)
            case Treatment.LEFT_OUT if item.command == _DELAY:
                if (delay_s := item.params[0] or 0.0) <= 0:
                    raise GeometryError("a delay until a time of the day is not done")
                self._wait(item, delay_s)
            case Treatment.LEFT_OUT if item.command == _PICTURES:
                self._take_pictures(item)
            case Treatment.LEFT_OUT:
                self._leave_out(item, f"{command.title} is left out")
            case _:
                remedy = f"; {command.remedy}" if command.remedy else ""
                raise GeometryError(f"{command.title} cannot be carried out{remedy}")

    def end_route(self) -> None:
        """Make a task of the waypoints so far."""
        reader, self._route = self._route, None
        numbers, self._numbers = tuple(self._numbers), []
        route = reader.finish() if reader is not None else None
        if route is None or len(numbers) != len(route.waypoints):
            return
        if len(numbers) > 1:
            self._do("single_vehicle_routing", numbers, route=route)
            return
        speed = route.speed_from(0)
        also: dict[str, TaskValue] = {} if speed is None else {"speed": f"{speed} m/s"}
        self._do("goto", numbers, target=Point(route.waypoints[0], route.altitude_frame), **also)

    def _do(self, behavior: str, numbers: Sequence[int], **parameters: TaskValue) -> None:
        self.tasks.append(MissionTask(behavior, tuple(numbers), parameters))

    def _reader(self) -> MissionReader:
        if self._route is None:
            self._route = MissionReader(self.contents, has_tasks=True)
            if self._speed is not None:
                self._route.add(self._speed)
        return self._route

    def _add_waypoint(self, item: MissionItem) -> None:
        """Add a waypoint, and the time for which the vehicle waits there (parameter 1)."""
        wait_s = item.params[0]
        if not item.auto_continue:
            raise GeometryError("it does not go on by itself (autocontinue 0), which is not done")
        plain = replace(item, command=_WAYPOINT, params=(None, *item.params[1:]))
        latitude, longitude, altitude = item.params[4:]
        if not (latitude or longitude) and self._place is not None:
            here, frame = self._place
            if not altitude:  # its own is that of the place before
                plain, altitude = replace(plain, frame=_FRAME_NUMBERS[frame]), here[2]
            plain = replace(plain, params=(*plain.params[:4], *here[:2], altitude))
        place = self._reader().add(plain)
        if place is not None:
            self._numbers.append(item.number)
            self._place = place
        if wait_s:
            self._wait(item, wait_s)

    def _wait(self, item: MissionItem, wait_s: float | None) -> None:
        self.end_route()
        if wait_s is not None and wait_s > 0:
            self._do("hold", [item.number], duration=f"{wait_s} s")

    def _take_off(self, item: MissionItem) -> None:
        if self._numbers:
            raise GeometryError("a take-off comes after a waypoint")
        altitude = item.params[6]
        if altitude is None or altitude <= 0:
            raise GeometryError("a take-off needs an altitude above 0")
        self._do("takeoff", [item.number], altitude=f"{altitude} m", altitude_frame=frame_of(item))

    def _circle(self, item: MissionItem) -> None:
        turns, _, radius_m = item.params[:3]
        latitude, longitude, altitude = item.params[4:]
        if not turns or turns < 0:
            raise GeometryError("circles need a number of turns above 0 (parameter 1)")
        if not radius_m or radius_m < 0:
            raise GeometryError("circles need a radius above 0 (parameter 3): clockwise")
        self.end_route()
        place: Coordinate | None = None
        if latitude and longitude:
            place = coordinate(latitude, longitude, altitude, item.where)
        elif self._place is not None:
            place = self._place[0]
        if place is None:
            raise GeometryError("circles need a place")
        target = Point(place, frame_of(item))
        self._place = place, target.altitude_frame
        self._do("orbit", [item.number], target=target, radius=f"{radius_m} m", turns=f"{turns:g}")

    def _land(self, item: MissionItem, title: str) -> None:
        latitude, longitude = item.params[4:6]
        if latitude and longitude:
            altitude, frame = None, "relative"
            if self._place is not None:
                (*_, altitude), frame = self._place
                here = self._place[0][:2]
                near = max(abs(here[0] - latitude), abs(here[1] - longitude)) < _SAME_PLACE_DEG
            if self._place is None or not near:
                self.end_route()
                place = coordinate(latitude, longitude, altitude, item.where)
                point = Point(place, frame)
                self._do("goto", [item.number], target=point)
        self._end("land", item, title)

    def _end(self, behavior: str, item: MissionItem, title: str) -> None:
        self.end_route()
        self._do(behavior, [item.number])
        self._over = f"item {item.number} ({title})"

    def _take_pictures(self, item: MissionItem) -> None:
        interval_s, count = item.params[1:3]
        if not count or count < 1:
            self._leave_out(item, "pictures without a number are left out")
            return
        self.end_route()
        pictures: dict[str, TaskValue] = {"count": int(count)}
        if interval_s and interval_s > 0:
            pictures["interval"] = f"{interval_s} s"
        self.tasks.append(MissionTask("take_picture", (item.number,), pictures, of_payload=True))

    def _leave_out(self, item: MissionItem, message: str) -> None:
        self.contents.note(FileProblem(Severity.WARNING, f"item {item.number}", message))
