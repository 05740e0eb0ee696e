"""The facts of vehicles and payloads at one moment (`m2pem.mission.candidate_facts`)."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.fleet.facts import fleet_facts, of_kind, vehicle_of
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Fleet, Vehicle
from m2pem.fleet.graph import ResourceGraph
from m2pem.fleet.parameters import ResolvedValue
from m2pem.geo.local_frame import LatLon, LocalFrame
from m2pem.mission.behavior import RoleKind
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition
from m2pem.mission.values import Value

if TYPE_CHECKING:
    import numpy as np

    Numbers: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
    Places: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.intp]]

LatestState = Callable[[ResourceId], VehicleState | PayloadState | None]
"""The newest telemetry of a resource; None before the first."""

NO_SPEED_M_S = 1.0
"""Speed of a vehicle for which neither the task nor the fleet file says one: it is compared with
others of the same kind by its distance alone."""

Facts = Mapping[str, Value]
"""The facts of one candidate by their names in expressions."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a task begins. `corners`: places in WGS-84 degrees, of which the vehicle goes to the
    nearest; empty: anywhere. `speed_m_s`: of the task; None: it says none."""

    corners: tuple[LatLon, ...] = ()
    speed_m_s: float | None = None


@dataclass(frozen=True, slots=True)
class Group:
    """All vehicles, or all payloads, in the order of the fleet file.

    The arrays have a number for each of them: `east_m` and `north_m` of the fleet's origin, the
    `charge` from 0 to 1, and the cruise speed; NaN: not known.
    """

    resources: tuple[ResourceId, ...]
    index: Mapping[ResourceId, int]
    east_m: "Numbers"
    north_m: "Numbers"
    charge: "Numbers"
    cruise_speed_m_s: "Numbers"


class Candidates:
    """A snapshot of the fleet: what is known of each resource. It holds for one decision: before
    the next one, `look_again` takes over what has changed."""

    def __init__(self, fleet: Fleet, graph: ResourceGraph, latest: LatestState) -> None:
        self.fleet = fleet
        self.graph = graph
        self._newest = latest
        self._states: dict[ResourceId, VehicleState | PayloadState | None] = {}
        self._frame = LocalFrame(fleet.origin)
        self._fleet_facts: dict[ResourceId, dict[str, Value]] = {}
        self._facts: dict[ResourceId, dict[str, Value]] = {}
        self._groups: dict[bool, Group] = {}
        self._distances_m: dict[tuple[object, ...], Numbers] = {}

    def look_again(self) -> Collection[ResourceId]:
        """Take over the newest telemetry. Returns what has changed: vehicles and their payloads."""
        newest, changed = self._newest, list[ResourceId]()
        for resource, before in self._states.items():
            state = newest(resource)
            if state is not before:
                self._states[resource] = state
                vehicle = self.fleet.vehicles.get(resource)
                changed += [resource, *(() if vehicle is None else vehicle.payloads)]
        if changed:
            self._distances_m.clear()
        for resource in changed:
            self._facts.pop(resource, None)
            for group in self._groups.values():
                if (place := group.index.get(resource)) is not None:
                    numbers = self._numbers(vehicle_of(self.fleet, resource))
                    group.east_m[place], group.north_m[place], group.charge[place], _ = numbers
        return changed

    def _latest(self, resource: ResourceId) -> VehicleState | PayloadState | None:
        if resource not in self._states:
            self._states[resource] = self._newest(resource)
        return self._states[resource]

    def facts(self, resource: ResourceId) -> Facts:
        """Return the facts of a vehicle or payload that hold wherever its task is."""
        known = self._facts.get(resource)
        if known is None:
            of_fleet = self._fleet_facts.get(resource)
            if of_fleet is None:
                of_fleet = fleet_facts(self.fleet, self.graph, resource)
                self._fleet_facts[resource] = of_fleet
            known = of_fleet | self._telemetry_facts(vehicle_of(self.fleet, resource))
            self._facts[resource] = known
        return known

    def _telemetry_facts(self, vehicle: Vehicle) -> dict[str, Value]:
        state = self._latest(vehicle.id)
        if not isinstance(state, VehicleState):
            return {}
        battery = state.battery_fraction
        facts: dict[str, Value] = {
            "vehicle.battery": battery,
            "vehicle.mode": state.mode or None,
            "vehicle.armed": state.armed,
            "vehicle.ready": state.ready,
        }
        if vehicle.endurance_s is not None and battery is not None:
            facts["vehicle.endurance"] = vehicle.endurance_s * battery
        if state.position is not None:
            place = state.position
            facts["vehicle.position"] = [place.latitude_deg, place.longitude_deg, place.altitude_m]
        return facts

    def breach(self, resource: ResourceId, place: Place) -> str:
        """Return where the straight way to a task leaves the fence; "": not, or it is not known."""
        vehicle = vehicle_of(self.fleet, resource)
        fence, state = fence_of(self.fleet, vehicle.domain), self._latest(vehicle.id)
        if fence is None or not isinstance(state, VehicleState) or state.position is None:
            return ""
        found, start = "", state.position.latlon
        for each in place.corners:
            if not (found := fence.breach([each], start, lambda _: "where the task begins")):
                break
        return found

    def group(self, kind: RoleKind) -> Group:
        """Return what roles of a kind choose from: payloads, or vehicles."""
        payloads = kind is RoleKind.PAYLOAD
        if payloads not in self._groups:
            self._groups[payloads] = self._grouped(tuple(of_kind(kind, self.fleet)))
        return self._groups[payloads]

    def _grouped(self, resources: tuple[ResourceId, ...]) -> Group:
        import numpy as np  # noqa: PLC0415  # only a mission with roles by need has to load it

        rows = [self._numbers(vehicle_of(self.fleet, each)) for each in resources]
        columns = np.array(rows, dtype=float).reshape(len(rows), 4)
        return Group(
            resources,
            {resource: place for place, resource in enumerate(resources)},
            *(columns[:, place] for place in range(4)),
        )

    def _numbers(self, vehicle: Vehicle) -> tuple[float, float, float, float]:
        unknown = float("nan")
        east_m = north_m = charge = unknown
        state = self._latest(vehicle.id)
        if isinstance(state, VehicleState):
            if state.position is not None:
                east_m, north_m = self._frame.to_local(state.position.latlon)
            charge = unknown if state.battery_fraction is None else state.battery_fraction
        return east_m, north_m, charge, vehicle.cruise_speed_m_s or NO_SPEED_M_S

    def distances_m(self, group: Group, place: Place) -> "Numbers":
        """Return the horizontal distance of each resource to where a task begins.

        It is 0 for a task that has no place, and NaN where the position is not known.
        """
        import numpy as np  # noqa: PLC0415

        key = (id(group), place)
        if key not in self._distances_m:
            found = np.zeros(len(group.resources)) if not place.corners else None
            for corner in place.corners:
                east_m, north_m = self._frame.to_local(corner)
                way_m = np.hypot(group.east_m - east_m, group.north_m - north_m)
                found = way_m if found is None else np.minimum(found, way_m)
            assert found is not None
            self._distances_m[key] = found
        return self._distances_m[key]

    def place_of(self, parameters: Mapping[str, ResolvedValue]) -> Place:
        """Return where a task with these parameters begins."""
        speed = parameters.get("speed")
        speed_m_s = float(speed) if isinstance(speed, int | float) and speed > 0 else None
        for value in parameters.values():
            corners: Sequence[LatLon] = ()
            if isinstance(value, Route):
                corners = [value.waypoints[0][:2]]
            elif isinstance(value, Area):
                corners = [corner[:2] for corner in value.rings[0][:-1]]
            elif isinstance(value, Point):
                corners = [value.position[:2]]
            elif isinstance(value, VehiclePosition):
                state = self._latest(ResourceId(value.vehicle))
                if isinstance(state, VehicleState) and state.position is not None:
                    corners = [state.position.latlon]
            if corners:
                return Place(tuple(corners), speed_m_s)
        return Place((), speed_m_s)
