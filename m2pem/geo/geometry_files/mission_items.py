"""Reads the items of a mission, one after the other: its route, its fences and rally points.

An item is carried over, left out with a warning, or refused: then there is no route, because the
vehicle would fly another way than the file says. `mission_commands` says which.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from m2pem.findings import Severity
from m2pem.geo.geojson import GeometryError, checked, closed_ring, coordinate
from m2pem.geo.geometry_files.contents import Contents, FileProblem
from m2pem.geo.geometry_files.mission_commands import (
    ENDINGS,
    FENCES,
    LANDING_SECTION,
    POLYGONS,
    RALLY_POINT,
    Command,
    Treatment,
    command_of,
)
from m2pem.geo.local_frame import LatLon
from m2pem.geo.polygon import circle_ring
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_FRAMES = {0: "amsl", 5: "amsl", 3: "relative", 6: "relative", 10: "terrain", 11: "terrain"}
"""MAV_FRAME_GLOBAL, _RELATIVE_ALT and _TERRAIN_ALT, with and without integers."""

_NAMED = 8
"""Items that a problem names; of more, only their number is said."""

LARGEST_M = 100_000.0

_BETWEEN = "between one route up to there and one from there on"
_NO_TASK = "no task does it: set it in the autopilot"
_SPEED_TYPES = {0.0: "", 1.0: "", 2.0: "climbing ", 3.0: "descending "}
"""SPEED_TYPE; through the air and over ground are the same here."""
_HEADING = 3
_ASIDE = (
    ("a hold time", "{:g} s", f"a task `hold`, {_BETWEEN}"),
    ("an acceptance radius", "{:g} m", _NO_TASK),
    ("a pass radius", "{:g} m", "draw the curve as waypoints"),
    ("a heading", "{:g} deg", f"`heading` of a task `goto`, {_BETWEEN}"),
)
"""Parameters 1 to 4 of MAV_CMD_NAV_WAYPOINT, which are not its place."""


@dataclass(frozen=True, slots=True)
class MissionItem:
    """`number`: as ground stations show it; `where`: it is, for errors; `params`: the seven, None:
    not given (null or NaN); `auto_continue`: whether the vehicle goes on from there by itself."""

    number: int
    where: str
    command: int
    frame: object
    params: Sequence[float | None]
    auto_continue: bool = True


def parameters(values: Sequence[object], where: str) -> tuple[float | None, ...]:
    """Return the parameters of an item.

    Raises:
        GeometryError: they are not seven numbers or nulls.
    """
    given = [math.nan if each is None else each for each in values]
    known = [each for each in given if isinstance(each, int | float) and each is not True]
    if len(given) != 7 or len(known) != 7:
        raise GeometryError(f"{where}: seven numbers are expected as its parameters")
    try:
        numbers = [float(each) for each in known]
    except OverflowError:
        raise GeometryError(f"{where}: a parameter is too large") from None
    return tuple(None if math.isnan(each) else each for each in numbers)


@dataclass(frozen=True, slots=True)
class _Ending:
    """Where waypoints would be another way: the vehicle lands there, stays, or flies elsewhere.

    `is_over`: the mission ends there, in any case. `says`: what the warning is if none follow.
    """

    label: str
    title: str
    remedy: str
    is_over: bool = False
    says: str = ""


@dataclass(slots=True)
class MissionReader:
    """Adds what a mission's items are to the contents of a file.

    `zero_is_north`: a waypoint's heading of 0 is one; else it means that there is none.
    `has_tasks`: tasks do what a route cannot, and warnings have no remedy.
    """

    contents: Contents
    zero_is_north: bool = False
    has_tasks: bool = False
    _places: list[Coordinate] = field(default_factory=list)
    _frames: list[str] = field(default_factory=list)
    _speeds_m_s: dict[int, float] = field(default_factory=dict)
    """By the place from which on the vehicle is as fast; one that is set earlier: by the first."""
    _is_up: bool = False
    """Whether an item before has an altitude."""
    _endings: list[_Ending] = field(default_factory=list)
    _landing: list[int] = field(default_factory=list)
    """The items of a landing that the mission does not come to."""
    _corners: list[LatLon] = field(default_factory=list)
    """Of a fence polygon of which more corners follow."""
    _polygon: int = 0
    """The command of its corners."""
    _first_corner: str = ""
    _notes: dict[tuple[Severity, str, str], list[str]] = field(default_factory=dict)

    def add(self, item: MissionItem) -> tuple[Coordinate, str] | None:
        """Add the next item; return the waypoint that it is, with its altitude frame.

        Raises:
            GeometryError: its frame is unknown, or its place out of range.
        """
        command = command_of(item.command, item.params)
        value = command.said(item.params)
        label = f"{item.number} ({value})" if value else str(item.number)
        ended = any(each.is_over for each in self._endings)
        if self._landing or (ended and item.command in LANDING_SECTION):
            self._landing.append(item.number)
            return None
        before = len(self._places)
        match command.treatment:
            case Treatment.FENCE:
                with self.contents.feature(item.where):
                    self._add_fence(item)
            case Treatment.WAYPOINT | Treatment.WAIT | Treatment.STAY:
                self._add_place(item, command, label)
            case Treatment.SPEED:
                self._add_speed(item)
            case Treatment.END:
                self._end(item, command, label)
            case Treatment.LEFT_OUT:
                self._warn(label, f"{command.title} is left out", command.remedy)
            case Treatment.BEGIN if not self._places:
                self._is_up = bool(item.params[6])
                self._warn(label, f"{command.title} is left out", command.remedy)
            case _:
                message = f"{command.title} cannot be flown as part of a route"
                self._note(Severity.ERROR, label, message, command.remedy)
        is_place = len(self._places) > before
        return (self._places[-1], self._frames[-1]) if is_place else None

    def add_pattern(self, number: int, name: str) -> None:
        """Add an item that is flown by waypoints of its own, which are not read."""
        if self._places:
            self._endings.append(_Ending(str(number), name, "do that by a task"))

    def finish(self) -> Route | None:
        """Add the route, if there is one, and say what was left out of it; return it."""
        self._end_polygon()
        for each in self._endings:
            if each.says:
                self._warn(each.label, each.says, each.remedy)
        for number in self._landing:
            what = "of a landing that the mission does not come to, left out"
            self._warn(str(number), what, "a task `land` or `return_to_launch`")
        for (severity, message, remedy), labels in self._notes.items():
            more = f" and {len(labels) - _NAMED} more" if len(labels) > _NAMED else ""
            items = f"item{'s' if len(labels) > 1 else ''} {', '.join(labels[:_NAMED])}{more}"
            self.contents.note(FileProblem(severity, items, message, remedy, "route"))
        refused = any(severity is Severity.ERROR for severity, *_ in self._notes)
        if self._places and not refused:
            own = self._speeds_m_s
            speeds = tuple(own.get(index) for index in range(len(self._places))) if own else ()
            route = Route.of(self._places, self._frames, speeds)
            self.contents.add("", route)
            return route
        return None

    def _add_place(self, item: MissionItem, command: Command, label: str) -> None:
        for each in self._endings:
            message = f"{each.title}, with waypoints behind it, is no part of a route"
            remedy = f"make one file of what is before it, one of what is behind it; {each.remedy}"
            self._note(Severity.ERROR, each.label, message, remedy)
        self._endings.clear()
        latitude, longitude, altitude = item.params[4:]
        place, frame = None, frame_of(item)
        if latitude or longitude:
            place = coordinate(latitude, longitude, altitude, item.where)
            if altitude == 0 and frame != "amsl" and self._is_up:
                what = "is at 0 m, which to a copter of ArduPilot is the altitude that it has"
                self._warn(str(item.number), what, "give it the altitude that is meant")
        elif self._places:  # "here": the place before, at an altitude of its own if it has one
            before, its_frame = self._places[-1], self._frames[-1]
            place, frame = ((*before[:2], altitude), frame) if altitude else (before, its_frame)
            place = None if (place, frame) == (before, its_frame) else place
        if place is None and (command.treatment is Treatment.WAYPOINT or not self._places):
            what = "is where the vehicle is then, which is no waypoint, and is left out"
            remedy = "" if self._places else "a task `change_altitude` before the route"
            self._warn(str(item.number), what, remedy)
        self._is_up = self._is_up or bool(altitude)
        if place is not None:
            self._places.append(place)
            self._frames.append(frame)
        if command.treatment is Treatment.STAY:
            self._end(item, command, label)
        elif command.treatment is Treatment.WAIT:
            self._warn(label, f"{command.title}: the wait is left out", command.remedy)
        else:
            self._warn_of_parameters(item)
        if not item.auto_continue:
            what = "does not go on by itself (autoContinue), which is left out"
            self._warn(str(item.number), what, f"a user task, {_BETWEEN}")

    def _end(self, item: MissionItem, command: Command, label: str) -> None:
        what = ": that it stays there" if command.treatment is Treatment.STAY else ""
        says = f"{command.title}{what} is left out"
        is_over = item.command in ENDINGS
        self._endings.append(_Ending(label, command.title, command.remedy, is_over, says))

    def _add_speed(self, item: MissionItem) -> None:
        kind, speed, throttle, relative = item.params[:4]
        what = "relative " if relative else _SPEED_TYPES.get(kind or 0.0, "unknown ")
        if speed and speed > 0 and not what:
            self._speeds_m_s[max(len(self._places) - 1, 0)] = speed
        elif speed is not None and speed != -1:
            label = f"{item.number} ({what}{speed:g} m/s)"
            remedy = "`speed` of a task, or a number that is the speed"
            self._warn(label, "MAV_CMD_DO_CHANGE_SPEED is left out", remedy)
        if throttle and throttle > 0:
            label = f"{item.number} ({throttle:g} %)"
            self._warn(label, "MAV_CMD_DO_CHANGE_SPEED: the throttle is left out", _NO_TASK)

    def _warn_of_parameters(self, item: MissionItem) -> None:
        for index, (what, value, remedy) in enumerate(_ASIDE):
            given = item.params[index]
            if given is not None and (given != 0 or (index == _HEADING and self.zero_is_north)):
                label = f"{item.number} ({value.format(given)})"
                self._warn(label, f"MAV_CMD_NAV_WAYPOINT: {what} is left out", remedy)

    def _add_fence(self, item: MissionItem) -> None:
        latitude, longitude, altitude = item.params[4:]
        place = coordinate(latitude, longitude, altitude, item.where)
        name = FENCES.get(item.command, "")
        if item.command != self._polygon:
            self._end_polygon()
            self._polygon = item.command
        if not self._corners:
            self._first_corner = item.where
        if item.command in POLYGONS:
            self._corners.append(place[:2])
            if len(self._corners) == item.params[0]:
                corners, self._corners = self._corners, []
                self.contents.add(name, polygon(corners, partial(self.contents.warn, item.where)))
        elif name:
            self.contents.add(name, circle(place[:2], item.params[0], name == "fence"))
        else:
            name = "rally" if item.command == RALLY_POINT else "fence_return"
            self.contents.add(name, Point(place, frame_of(item)))

    def _end_polygon(self) -> None:
        if self._corners:
            message = f"a fence of {len(self._corners)} corners, where parameter 1 says another"
            self.contents.note(
                FileProblem(Severity.ERROR, self._first_corner, message, kind="area")
            )
            self._corners.clear()

    def _warn(self, label: str, message: str, remedy: str) -> None:
        self._note(Severity.WARNING, label, message, remedy)

    def _note(self, severity: Severity, label: str, message: str, remedy: str) -> None:
        remedy = "" if self.has_tasks else remedy
        self._notes.setdefault((severity, message, remedy), []).append(label)


def frame_of(item: MissionItem) -> str:
    """Return the altitude frame of an item.

    Raises:
        GeometryError: its MAV_FRAME has none.
    """
    if not isinstance(item.frame, int) or item.frame not in _FRAMES:
        raise GeometryError(
            f"{item.where}: MAV_FRAME {item.frame!r} is not global, relative or terrain"
        )
    return _FRAMES[item.frame]


def polygon(corners: Sequence[LatLon], said: Callable[[str], object] | None = None) -> Area:
    """Return an area with these corners. `said`: takes what was mended.

    Raises:
        GeometryError: there are less than three, or they bound no area.
    """
    return Area(checked((closed_ring([(*corner, None) for corner in corners]),), said))


def circle(center: LatLon, radius_m: float | None, is_inside: bool) -> Area:
    """Return a circle as an area of 64 corners: within it, or else around it.

    Raises:
        GeometryError: the radius is not above 0, or the circle meets the antimeridian.
    """
    if radius_m is None or not 0 < radius_m < LARGEST_M:
        raise GeometryError(f"a radius of {radius_m} m is not between 0 and {LARGEST_M:g} m")
    return polygon(circle_ring(center, radius_m, is_around=not is_inside))
