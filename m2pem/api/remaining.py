"""What is left of a route or a survey, as parameters by which another vehicle would do it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import DIMENSIONS, ResolvedValue
from m2pem.geo.geojson import as_geojson, parse_geojson
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polyline import Polyline
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ParameterKind
from m2pem.mission.geometry import Area, Coordinate, Point, Route, VehiclePosition
from m2pem.mission.values import Value
from m2pem.units import UNITS

REPORTED_SHARE = 0.05
REPORTED_M = 10.0
"""Another report is worth its record when that much of the way was done since the last one."""

_STRAY_M = 30.0
_JOINS_M = 5.0
_ALONG_RAD = math.radians(20)
_REACH = 1.2
"""How much farther along the way a vehicle may come than it moves: it cuts corners."""

_DOUBT = 0.2
"""A place of the way is taken for where the vehicle is if it is nearer than others by so much for
each metre that it is farther from the expected one: a way may cross itself, or go back."""

_ANGLES: Mapping[str, ParameterKind] = {
    parameter.name: parameter.kind
    for spec in SHARED.values()
    for parameter in spec.parameters
    if spec.type is BehaviorType.VEHICLE
    and parameter.kind in (ParameterKind.ANGLE, ParameterKind.ANGULAR_SPEED)
}


def raw_parameters(parameters: Mapping[str, ResolvedValue]) -> dict[str, Value]:
    """Return the resolved parameters of a vehicle's behavior as missions give them, in JSON:
    geometries as GeoJSON, vehicles by name, angles with their unit."""
    raw: dict[str, Value] = {}
    for name, value in parameters.items():
        match value:
            case None:
                pass
            case Point() | Route() | Area():
                raw[name] = as_geojson(value)
            case VehiclePosition():
                raw[name] = value.vehicle
            case int() | float() if name in _ANGLES:
                raw[name] = f"{float(value)!r} {next(iter(UNITS[DIMENSIONS[_ANGLES[name]]]))}"
            case _:
                raw[name] = value
    return raw


class RemainingWork(ABC):
    """How far a vehicle has come along its way, and what is left of its behavior.

    `parameters`: of the behavior, as missions give them. `line`: the way in `frame`, in metres.
    `mark_m`: how far along it the vehicle has come; it never falls.
    """

    def __init__(self, parameters: Mapping[str, Value], frame: LocalFrame, line: Polyline) -> None:
        self.parameters = dict(parameters)
        self.frame = frame
        self.line = line
        self.mark_m = 0.0
        self._reported_m = 0.0
        self._seen: EastNorth | None = None
        self._followed: EastNorth | None = None
        self._moved_m = 0.0

    @property
    def next_report_m(self) -> float:
        """How far along the way the next report is worth its record."""
        return self._reported_m + max(REPORTED_SHARE * self.line.length_m, REPORTED_M)

    @abstractmethod
    def part(self, from_m: float, to_m: float = math.inf) -> Mapping[str, Value] | None:
        """Return the parameters for what is between two distances along the way; None: they cannot
        say it."""

    def left(self) -> Mapping[str, Value] | None:
        """Return the parameters of what is left now; None: they cannot say it."""
        return self.part(self.mark_m)

    def to_report(self, least_m: float | None = None) -> Mapping[str, Value] | None:
        """Return what is left now if it is worth a report: when `next_report_m` is reached, or
        when `least_m` have been done since the last report."""
        due_m = self.next_report_m if least_m is None else self._reported_m + least_m
        left = self.left() if self.mark_m >= due_m - 1e-6 else None
        if left is not None:
            self._reported_m = self.mark_m
        return left

    def reached(self, index: int) -> None:
        """The vehicle has reached a point of its way, by its index from 0."""
        self.mark_m = max(self.mark_m, self.line.marks_m[index])

    def moved(self, place: EastNorth, index: int) -> None:
        """The vehicle, at a place in `frame`, is on its way from the point before `index` to it."""
        if index > 0:
            low_m, high_m = self.line.marks_m[index - 1], self.line.marks_m[index]
            self.find(place, max(low_m, self.mark_m), low_m, high_m)

    def find(self, place: EastNorth, expected_m: float, low_m: float, high_m: float) -> None:
        """The vehicle, at a place in `frame`, is about `expected_m` along its way, within bounds.

        A place far from the way changes nothing.
        """
        feet = self.line.feet(place, low_m, high_m)
        found = min(
            (
                (off_m + _DOUBT * abs(along_m - expected_m), along_m)
                for along_m, off_m, _ in feet
                if off_m <= _STRAY_M
            ),
            default=None,
        )
        if found is not None:
            self.mark_m = max(self.mark_m, found[1])

    def follow(self, place: EastNorth, *, anywhere: bool = False) -> None:
        """The vehicle is at a place in `frame`, and all that is known are its places so far.

        It is on its way from where it comes near the beginning or moves along the first leg, or
        (`anywhere`: after a restart) near the way. It is never farther along than it may have moved
        since.
        """
        before, self._seen = self._seen, place
        if self._followed is None:
            if anywhere:
                near_m = min((off_m for _, off_m, _ in self.line.feet(place)), default=math.inf)
            else:
                near_m = self._to_begin_m(before, place)
            if near_m > _JOINS_M:
                return
            first_m = next((mark_m for mark_m in self.line.marks_m if mark_m > 0), 0.0)
            self.find(place, 0.0, 0.0, self.line.length_m if anywhere else first_m)
            self._followed = place
        self._moved_m += math.dist(self._followed, place)
        self._followed = place
        before_m = self.mark_m
        reach_m = _REACH * self._moved_m + _JOINS_M
        self.find(place, before_m + self._moved_m, before_m, before_m + reach_m)
        if self.mark_m > before_m:
            self._moved_m = 0.0

    def _to_begin_m(self, before: EastNorth | None, place: EastNorth) -> float:
        """Return how far the vehicle is from the beginning, or from the first leg along which it
        moves: who cuts the corner there does not come near the beginning."""
        away_m = math.dist(self.line.points[0], place)
        leg = next((each for each in self.line.segments if each.length_m > 0), None)
        if leg is None or before is None or math.dist(before, place) < 1e-3:
            return away_m
        yaw_rad = math.atan2(place[1] - before[1], place[0] - before[0])
        if abs(math.remainder(yaw_rad - leg.yaw_rad, math.tau)) > _ALONG_RAD:
            return away_m
        return min(away_m, leg.distance_m(place))

    def state(self) -> dict[str, Any]:
        """Return what `restored_work` reads, as JSON values."""
        return {"parameters": self.parameters, "mark": self.mark_m, "reported": self._reported_m}

    def go_on_from(self, state: Mapping[str, Any]) -> None:
        """Take up how far the vehicle had come."""
        self.mark_m, self._reported_m = float(state["mark"]), float(state["reported"])


class RemainingRoute(RemainingWork):
    """The rest of a route, from where the vehicle is on it to its end."""

    def __init__(self, parameters: Mapping[str, Value], route: Route, frame: LocalFrame) -> None:
        line = Polyline(frame.to_local(waypoint[:2]) for waypoint in route.waypoints)
        super().__init__(parameters, frame, line)
        self._route = route

    @classmethod
    def of(cls, parameters: Mapping[str, ResolvedValue]) -> "RemainingRoute | None":
        """Return the account of a route; None: there is none, or of a loop all is always left."""
        route = parameters.get("route")
        if not isinstance(route, Route) or parameters.get("loop") is True:
            return None
        return cls(raw_parameters(parameters), route, LocalFrame(route.waypoints[0][:2]))

    def part(self, from_m: float, to_m: float = math.inf) -> Mapping[str, Value] | None:
        """Return the parameters with that part of the route."""
        part = part_of_route(self._route, self.line, self.frame, from_m, to_m)
        return {**self.parameters, "route": as_geojson(part)}

    def state(self) -> dict[str, Any]:
        return {**super().state(), "route": as_geojson(self._route)}


def part_of_route(
    route: Route, line: Polyline, frame: LocalFrame, from_m: float, to_m: float = math.inf
) -> Route:
    """Return the part of a route between two distances along it. `line`: the route in `frame`."""
    to_m = min(to_m, line.length_m)
    kept = [
        index for index, mark_m in enumerate(line.marks_m) if from_m - 1e-6 <= mark_m <= to_m + 1e-6
    ]
    waypoints = [route.waypoints[index] for index in kept]
    frames = [route.frames[index] for index in kept]
    speeds = [route.speeds_m_s[index] if route.speeds_m_s else None for index in kept]
    for end_m, place in ((from_m, 0), (to_m, len(waypoints) + 1)):
        if all(abs(end_m - mark_m) >= 1e-6 for mark_m in line.marks_m):
            waypoints.insert(place, _between(route, line, frame, end_m))
            frames.insert(place, route.frames[line.segment_at(end_m) + 1])
            speeds.insert(place, None)
    before = sum(mark_m <= from_m + 1e-6 for mark_m in line.marks_m)
    if speeds:
        speeds[0] = route.speed_from(before - 1)
    given = tuple(speeds) if any(speed is not None for speed in speeds) else ()
    return Route.of(waypoints, frames, given)


def _between(route: Route, line: Polyline, frame: LocalFrame, along_m: float) -> Coordinate:
    """Return the place at a distance along a route, at an altitude between its neighbours'; at none
    where they are in different frames."""
    index = line.segment_at(along_m)
    before, after = route.waypoints[index][2], route.waypoints[index + 1][2]
    up_m = after
    if route.frames[index] != route.frames[index + 1]:
        up_m = None
    elif before is not None and after is not None:
        part = (along_m - line.marks_m[index]) / line.segments[index].length_m
        up_m = before + (after - before) * part
    return (*frame.to_latlon(line.at(along_m)), up_m)


class RemainingSurvey(RemainingWork):
    """The part of an area that is not surveyed yet.

    `tracks`: in the order in which they are passed. `up_m`: the altitude of the area's corners;
    None: they have none.
    """

    def __init__(
        self,
        parameters: Mapping[str, Value],
        tracks: SurveyTracks,
        frame: LocalFrame,
        up_m: float | None = None,
        altitude_frame: str = "relative",
    ) -> None:
        kept = {name: value for name, value in parameters.items() if name != "area"}
        super().__init__(kept, frame, tracks.line)
        self.tracks = tracks
        self._up_m = up_m
        self._altitude_frame = altitude_frame

    def part(self, from_m: float, to_m: float = math.inf) -> Mapping[str, Value] | None:
        """Return the parameters with what that part of the tracks covers; None: it is not one
        area."""
        rings = self.tracks.part(from_m, to_m)
        if not rings:
            return None
        area = Area(
            tuple(
                tuple((*self.frame.to_latlon(corner), self._up_m) for corner in ring)
                for ring in rings
            ),
            self._altitude_frame,
        )
        given = raw_parameters(
            {
                "area": area,
                "heading": (math.pi / 2 - self.tracks.yaw_rad) % math.tau,
                "spacing": self.tracks.spacing_m(rings),
            }
        )
        return {**self.parameters, **given}

    def state(self) -> dict[str, Any]:
        return {
            **super().state(),
            "tracks": [list(self.frame.to_latlon(point)) for point in self.line.points],
            "width": self.tracks.width_m,
            "overshoot": self.tracks.overshoot_m,
            "passes": [list(each) for each in self.tracks.passes],
            "holes": [
                [list(self.frame.to_latlon(corner)) for corner in ring]
                for ring in self.tracks.holes
            ],
            "up": self._up_m,
            "altitude_frame": self._altitude_frame,
        }


def restored_work(state: Mapping[str, Any], frame: LocalFrame) -> RemainingWork:
    """Return what `RemainingWork.state` has said.

    Raises:
        ValueError, TypeError, KeyError: it has not said this.
    """
    parameters: dict[str, Value] = dict(state["parameters"])
    work: RemainingWork
    if "route" in state:
        route = parse_geojson(state["route"])
        if not isinstance(route, Route):
            raise TypeError("the state of a route has no route")
        work = RemainingRoute(parameters, route, frame)
    else:
        points, *holes = (
            [frame.to_local((latitude, longitude)) for latitude, longitude in places]
            for places in (state["tracks"], *state.get("holes", ()))
        )
        passes = [(int(at), *metres) for at, *metres in state.get("passes", ())]
        width_m, overshoot_m = float(state["width"]), float(state["overshoot"])
        tracks = SurveyTracks(points, width_m, overshoot_m, passes, holes)
        work = RemainingSurvey(parameters, tracks, frame, state["up"], str(state["altitude_frame"]))
    work.go_on_from(state)
    return work
