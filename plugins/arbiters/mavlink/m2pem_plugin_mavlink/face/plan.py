"""The plan of a vehicle by the mission protocol: what a station has uploaded and the run of it, or
what the vehicle carries out now."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from m2pem.api import (
    Area,
    Dimension,
    LatLon,
    LocalFrame,
    MissionTask,
    Point,
    Polyline,
    Route,
    RunId,
    RunStatus,
    SurveyTracks,
    UnitError,
    Value,
    distance_m,
    parse_geojson,
    quantity,
)
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.plan_messages import plan_id
from m2pem_plugin_mavlink.protocol.messages import Message

MOST_ITEMS = 1_000
REACHED_M = 5.0
ON_LEG_M = 10.0

Geometries: TypeAlias = Callable[[str], object]
"""Returns the geometry of a name; None: there is none."""

_FRAMES = {"relative": 6, "amsl": 5, "terrain": 11}
"""MAV_FRAME with integer coordinates."""


class Item(NamedTuple):
    """A waypoint; `altitude_m` in the MAV_FRAME `frame`."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    frame: int

    @classmethod
    def of(cls, place: tuple[float, float, float | None], frame: str) -> "Item":
        """Return the waypoint at a place in an altitude frame."""
        return cls(*place[:2], place[2] or 0.0, _FRAMES.get(frame, 6))


@dataclass(slots=True)
class Plan:
    """`current`: the number of the waypoint that the vehicle is on the way to. `is_under_way`: it
    began before m2pem did, so that the vehicle may be anywhere on its way."""

    items: Sequence[Item] = ()
    current: int = 0
    is_under_way: bool = False

    def replace(self, items: Sequence[Item], *, is_under_way: bool = False) -> None:
        """Another plan; none if there are no items."""
        self.items, self.current, self.is_under_way = items[:MOST_ITEMS], 0, is_under_way

    @property
    def is_found(self) -> bool:
        """Whether `current` is known of a plan."""
        return bool(self.items) and not self.is_under_way

    def _find(self, position: LatLon) -> None:
        """Have a vehicle that is on a leg be on the way to the end of that leg."""
        frame = LocalFrame(position)
        line = Polyline([frame.to_local(each[:2]) for each in self.items])
        feet = [(away_m, line.segments.index(leg)) for _, away_m, leg in line.feet((0.0, 0.0))]
        away_m, index = min(feet, default=(math.inf, 0))
        if away_m <= ON_LEG_M:
            self.current = index + 1

    def advance(self, position: LatLon) -> None:
        """The vehicle is at a position: waypoints that it has reached are past."""
        if self.is_under_way and self.items:
            self.is_under_way = False
            self._find(position)
        while self.current < len(self.items) - 1:
            here, after = self.items[self.current : self.current + 2]
            reached = distance_m(position, here[:2]) <= REACHED_M
            leg_m = distance_m(here[:2], after[:2])
            if not reached and distance_m(position, after[:2]) >= max(leg_m - REACHED_M, REACHED_M):
                return
            self.current += 1


@dataclass(slots=True)
class UploadedPlan:
    """`items`: as they were uploaded; `tasks`: what they are."""

    items: Sequence[Message] = ()
    tasks: Sequence[MissionTask] = ()
    id: int = field(init=False)

    def __post_init__(self) -> None:
        self.id = plan_id(self.items)


@dataclass(slots=True)
class PlanRun:
    """A run of a plan. `tasks`: by the ids of the mission's elements. `element`: the task under
    way. `done`: items that are behind the vehicle, in their order. `is_taken_up`: it began before
    m2pem did, and where the vehicle is on its way is not known yet."""

    run: RunId
    by: str
    plan: UploadedPlan
    tasks: Mapping[str, MissionTask]
    element: str = ""
    done: list[int] = field(default_factory=list)
    status: RunStatus = RunStatus.RUNNING
    is_taken_up: bool = False

    @property
    def current(self) -> int:
        """The number of the item that is under way."""
        task = self.tasks.get(self.element)
        left = [each for each in (task.items if task is not None else ()) if each not in self.done]
        return left[0] if left else (self.done[-1] if self.done else 0)


def plan_of(behavior: str, parameters: Mapping[str, Value], geometries: Geometries) -> list[Item]:
    """Return the waypoints of a behavior, given its parameters as the mission has them; none if it
    has none, or if they cannot be read. `geometries`: those of its run by name."""
    try:
        return _items(behavior, parameters, geometries)
    except (M2pemError, UnitError, ValueError, TypeError, KeyError):
        return []


def _items(behavior: str, parameters: Mapping[str, Value], geometries: Geometries) -> list[Item]:
    altitude_m = _number(parameters.get("altitude"))
    own_frame = parameters.get("altitude_frame")

    def item(latitude: float, longitude: float, own_m: float | None, frame: str) -> Item:
        if altitude_m is not None:
            frame = str(own_frame or "relative")
        height_m = altitude_m if altitude_m is not None else own_m or 0.0
        return Item(latitude, longitude, height_m, _FRAMES.get(frame, 6))

    if behavior == "single_vehicle_routing":
        route = _geometry(parameters["route"], geometries)
        if isinstance(route, Route):
            of_each = zip(route.waypoints, route.frames, strict=True)
            return [item(*place, frame) for place, frame in of_each]
    elif behavior == "area_survey":
        area = _geometry(parameters["area"], geometries)
        if isinstance(area, Area):
            tracks = _tracks(area, parameters)
            return [item(*each, None, area.altitude_frame) for each in tracks]
    elif "target" in parameters:
        target = _geometry(parameters["target"], geometries)
        if isinstance(target, Point):
            return [item(*target.position, target.altitude_frame)]
    return []


def _geometry(value: Value, geometries: Geometries) -> object:
    if isinstance(value, str):
        return geometries(value)
    if isinstance(value, dict):
        return parse_geojson(value)
    if isinstance(value, list) and len(value) in (2, 3):
        latitude, longitude, *height = (float(each) for each in value)  # type: ignore[arg-type]
        return Point((latitude, longitude, height[0] if height else None))
    return None


def _tracks(area: Area, parameters: Mapping[str, Value]) -> list[LatLon]:
    frame = LocalFrame(area.rings[0][0][:2])
    rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings]
    heading = parameters.get("heading")
    yaw_rad = None if heading is None else math.pi / 2 - quantity(heading, Dimension.ANGLE)
    tracks = SurveyTracks.over(rings, _number(parameters.get("spacing")), yaw_rad)
    return [frame.to_latlon(point) for point in tracks.line.points]


def _number(value: Value) -> float | None:
    return None if value is None else quantity(value, Dimension.DISTANCE)
