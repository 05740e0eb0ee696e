"""What the map shows: the places of the fleet and of the runs, and where the vehicles are."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from m2pem.api import (
    Area,
    EastNorth,
    LocalFrame,
    PayloadState,
    Point,
    ResourceId,
    Route,
    RunId,
    Telemetry,
    VehicleState,
    parse_geojson,
)
from m2pem.api import records as r
from m2pem.errors import M2pemError

if TYPE_CHECKING:
    from m2pem.api import Fleet
    from m2pem.mission.geometry import Geometry


@dataclass(frozen=True, slots=True)
class Shape:
    """A geometry in metres of the local frame. `kind`: fence, space, area, route or point."""

    name: str
    kind: str
    lines: tuple[tuple[EastNorth, ...], ...]

    @property
    def anchor(self) -> EastNorth:
        """Where its name is written."""
        return self.lines[0][0]


@dataclass(frozen=True, slots=True)
class Goal:
    """A vehicle is on its way to a target."""

    vehicle: EastNorth
    target: EastNorth


@dataclass(frozen=True, slots=True)
class _Commanded:
    resources: tuple[str, ...]
    parameters: Mapping[str, Any]


class Scene:
    """Follows telemetry and records. `version` changes with the shapes, not with the vehicles."""

    def __init__(self, fleet: "Fleet") -> None:
        self._fleet = fleet
        self._frame: LocalFrame | None = LocalFrame(fleet.origin) if any(fleet.origin) else None
        self._geometries: dict[str, Geometry] = dict(fleet.geometries)
        self._behaviors: dict[str, _Commanded] = {}
        self._shapes: list[Shape] | None = None
        self.version = 0
        self.vehicles: dict[ResourceId, VehicleState] = {}
        self.payloads: dict[ResourceId, PayloadState] = {}

    # --- what happens ---------------------------------------------------------------------------

    def update(self, state: Telemetry) -> None:
        """Keep a state as the latest."""
        if isinstance(state, VehicleState):
            self.vehicles[state.resource] = state
        elif isinstance(state, PayloadState):
            self.payloads[state.resource] = state

    def hand_over(self, name: str, geometry: Mapping[str, Any]) -> None:
        """An operator has handed a geometry over; one that cannot be read is left out."""
        try:
            self._geometries[name] = parse_geojson(geometry)
        except M2pemError:
            return
        self._changed()

    def record(self, run: RunId, record: object) -> None:
        """Keep what a record says of places, and of where vehicles go."""
        match record:
            case r.GeometryReceived(name=name, geometry=geometry):
                self.hand_over(name, geometry)
            case r.BehaviorRequested():
                self._behaviors[record.behavior] = _Commanded(record.resources, record.parameters)
                self._changed()
            case r.BehaviorEnded():
                if self._behaviors.pop(record.behavior, None) is not None:
                    self._changed()
            case r.RunEnded():
                own = [each for each in self._behaviors if each.startswith(f"{run}.")]
                for each in own:
                    del self._behaviors[each]
                self._changed()

    def _changed(self) -> None:
        self._shapes = None
        self.version += 1

    # --- what is shown --------------------------------------------------------------------------

    def position(self, resource: str) -> EastNorth | None:
        """Return where a vehicle is; None: it has not said it, or has no fix."""
        state = self.vehicles.get(ResourceId(resource))
        if state is None or state.position is None or not any(state.position.latlon):
            return None
        return self._local(state.position.latlon)

    def shapes(self) -> list[Shape]:
        """Return all geometries; those that are drawn last come last."""
        if self._shapes is None:
            found = [self._shape(name, each) for name, each in self._geometries.items()]
            found += [
                self._shape(behavior, each)
                for behavior, commanded in self._behaviors.items()
                for each in _inline(commanded.parameters)
            ]
            order = ("fence", "space", "area", "route", "point")
            self._shapes = sorted(
                (each for each in found if each), key=lambda each: order.index(each.kind)
            )
        return self._shapes

    def active_names(self) -> set[str]:
        """Return the names of the geometries that vehicles move along or work in now."""
        return {
            value
            for behavior, commanded in self._behaviors.items()
            for value in (behavior, *commanded.parameters.values())
            if isinstance(value, str)
        }

    def goals(self) -> Iterator[Goal]:
        """Yield where vehicles go, of those whose behavior has a target."""
        for commanded in self._behaviors.values():
            target = self._target(commanded.parameters.get("target"))
            for resource in commanded.resources:
                vehicle = self.position(resource)
                if target is not None and vehicle is not None:
                    yield Goal(vehicle, target)

    def footprints(self) -> Iterator[tuple[EastNorth, ...]]:
        """Yield what cameras see of the ground."""
        for state in self.payloads.values():
            if state.footprint:
                corners = [self._local(each.latlon) for each in state.footprint]
                yield (*corners, corners[0])

    def points(self) -> Iterator[EastNorth]:
        """Yield all that has to be in the picture when it shows everything."""
        for shape in self.shapes():
            for line in shape.lines:
                yield from line
        for resource in self.vehicles:
            if (place := self.position(resource)) is not None:
                yield place

    def _target(self, value: object) -> EastNorth | None:
        if isinstance(value, str) and value.lstrip()[:1] in ("[", "{"):
            with suppress(ValueError):  # a run refuses it
                return self._target(json.loads(value))
        if isinstance(value, str):
            named = self._geometries.get(value)
            if isinstance(named, Point):
                return self._local(named.position[:2])
            return self.position(value)
        if isinstance(value, (list, tuple)) and len(value) >= 2:
            latitude, longitude = value[:2]
            if isinstance(latitude, (int, float)) and isinstance(longitude, (int, float)):
                return self._local((latitude, longitude))
        if isinstance(value, Mapping):
            found = _parsed(value)
            return self._local(found.position[:2]) if isinstance(found, Point) else None
        return None

    def _shape(self, name: str, geometry: "Geometry") -> Shape | None:
        if isinstance(geometry, Area):
            kind = "fence" if name == self._fleet.fence else "area"
            kind = "space" if name in self._fleet.shared_space else kind
            return Shape(name, kind, tuple(self._line(ring) for ring in geometry.rings))
        if isinstance(geometry, Route):
            return Shape(name, "route", (self._line(geometry.waypoints),))
        if isinstance(geometry, Point):
            return Shape(name, "point", (self._line([geometry.position]),))
        return None

    def _line(self, places: Iterable[tuple[float, float, float | None]]) -> tuple[EastNorth, ...]:
        return tuple(self._local(each[:2]) for each in places)

    def _local(self, place: tuple[float, float]) -> EastNorth:
        if self._frame is None:
            self._frame = LocalFrame((*place, 0.0))
        return self._frame.to_local(place)


def _inline(parameters: Mapping[str, Any]) -> "Iterator[Geometry]":
    """Yield the routes and areas that are written out in parameters."""
    for value in parameters.values():
        if isinstance(value, Mapping):
            found = _parsed(value)
            if isinstance(found, (Route, Area)):
                yield found


def _parsed(value: Mapping[str, Any]) -> "Geometry | None":
    try:
        return parse_geojson(value)
    except M2pemError:
        return None
