"""A fleet made up from a mission (`--fleet sim`), so that any mission can be rehearsed at once.

Everything has its place near one origin, by the order in which the mission names it; the same
mission always gives the same fleet. The origin is a fixed one, or where the mission itself has
drawn.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from m2pem.fleet.allocation import asked_by
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import DETECTOR_SERVICE
from m2pem.fleet.fleet import SIMULATED, Domain, Fleet, Payload, Team, Vehicle
from m2pem.geo.local_frame import Origin, distance_m, offset
from m2pem.geo.positions import is_local, positions
from m2pem.mission.behavior import Behavior, BehaviorType, Need, Role, RoleKind, ServiceCall
from m2pem.mission.catalogue import ParameterKind, ResourceId
from m2pem.mission.concurrency import instances_at_once
from m2pem.mission.elements import Activity, SubProcess
from m2pem.mission.expression import Expression
from m2pem.mission.expression.tree import Compare, Comparison, In, Literal, Name, walk
from m2pem.mission.geometry import Area, Coordinate, Geometry, Point, Route
from m2pem.mission.mission import Mission

ORIGIN = (38.1075, -77.3192, 60.0)
TEAM_SIZE = 3
SPACING_M = 10.0
NEAR_M = 10_000.0
"""Vehicles reach geometries at this distance from the fixed origin."""
MOST_INSTANCES = 100
"""Instances of a task that get vehicles of their own."""

_AIR_BEHAVIORS = frozenset({"takeoff", "land", "change_altitude", "orbit"})
_KIND_BY_NAME = {
    "route": ParameterKind.ROUTE,
    "area": ParameterKind.AREA,
    "target": ParameterKind.POSITION,
}
"""For behaviors that only some arbiter knows."""


def fleet_for(mission: Mission) -> Fleet:
    """A fleet of simulated vehicles, payloads, teams and geometries that fits a mission.

    A vehicle flies if one of its behaviors only makes sense in the air, or takes an altitude; it
    drives otherwise. A team has members of its own (`section_1`, ...). A role by need gets vehicles
    of its own for each task and parallel instance, with the domain, tags and payloads that its
    condition names. A name that the mission reads from its data while it runs cannot be known here.
    Aircraft begin on the ground if the mission has a take-off, else in the air.
    """
    draft = _Draft(_origin(mission))
    tasks = list(asked_by(mission))
    for task in tasks:
        for role in task.roles:
            draft.add_role(role, task)
    for activity, behavior in mission.commands():
        draft.add_instances(behavior, _at_once(activity))
    for task in tasks:
        if isinstance(task, Behavior):
            draft.add_targets(task)
    for task in tasks:
        if isinstance(task, Behavior):
            draft.add_geometries(task, mission.geometries)
        elif task.service == DETECTOR_SERVICE and not task.roles:
            draft.add_any_detector()
    take_off = any(isinstance(each, Behavior) and each.name == "takeoff" for each in tasks)
    return draft.fleet({} if take_off else {"altitude": "30 m"})


def _origin(mission: Mission) -> Origin:
    """Return the fixed origin, or the first place that the mission's own geometries have, if all
    of them are out of reach of it."""
    places = [place for each in mission.geometries.values() for place in positions(each)]
    if not places or any(distance_m(ORIGIN[:2], each[:2]) <= NEAR_M for each in places):
        return ORIGIN
    return (*places[0][:2], ORIGIN[2])


def _at_once(activity: Activity) -> int:
    """Return how many instances of a task run at once, with those of the subprocesses around."""
    count, container = instances_at_once(activity), activity.container
    while isinstance(container, SubProcess):
        count *= instances_at_once(container)
        container = container.container
    return count


@dataclass(slots=True)
class _Draft:
    origin: Origin
    domains: dict[str, Domain] = field(default_factory=dict)
    payloads: dict[str, bool] = field(default_factory=dict)  # id -> whether it is a detector
    tags: dict[str, list[str]] = field(default_factory=dict)
    needed: Counter[str] = field(default_factory=Counter)  # vehicles made for roles of a name
    teams: dict[str, tuple[str, ...]] = field(default_factory=dict)
    geometries: dict[str, Geometry] = field(default_factory=dict)

    def add_role(self, role: Role, task: Behavior | ServiceCall) -> None:
        if role.need is not None and not role.resource:
            self._add_needed(role, role.need, task)
            return
        if role.kind is RoleKind.PAYLOAD:
            vehicle, _, payload = role.resource.partition("/")
            self.domains.setdefault(vehicle, Domain.GROUND)
            if payload:
                detects = isinstance(task, ServiceCall) and task.service == DETECTOR_SERVICE
                self.payloads[role.resource] = self.payloads.get(role.resource, False) or detects
            return
        names: tuple[str, ...] = (role.resource,)
        if role.kind is RoleKind.TEAM:
            names = tuple(f"{role.resource}_{number}" for number in range(1, TEAM_SIZE + 1))
            self.teams[role.resource] = names
        for name in names:
            if _is_flown(task):
                self.domains[name] = Domain.AIR
            self.domains.setdefault(name, Domain.GROUND)

    def _add_needed(self, role: Role, need: Need, task: Behavior | ServiceCall) -> None:
        """Add vehicles for a role by need, as far as its condition says literally what they are.

        A role that means an earlier one's resources needs none of its own.
        """
        if need.same and need.condition is None:
            return
        wanted = _literals(need.condition)
        domain = next(iter(wanted["vehicle.domain"]), "air" if _is_flown(task) else "ground")
        first = self.needed[role.name] + 1
        self.needed[role.name] += need.most
        names = wanted["vehicle.name"] or [
            f"{role.name}_{number}" for number in range(first, first + need.most)
        ]
        for name in names:
            self.domains[name] = Domain(domain) if domain in list(Domain) else Domain.GROUND
            self.tags.setdefault(name, []).extend(wanted["vehicle.tags"])
            payloads = wanted["vehicle.payloads"] or wanted["payload.name"]
            if role.kind is RoleKind.PAYLOAD and not payloads:
                payloads = [role.name]
            for payload in payloads:
                self.payloads.setdefault(f"{name}/{payload}", False)

    def add_instances(self, behavior: Behavior, count: int) -> None:
        """Add vehicles for all instances of a task that run at once, but the first."""
        for _ in range(min(count, MOST_INSTANCES) - 1):
            for role in behavior.roles:
                if role.need is not None and not role.resource:
                    self._add_needed(role, role.need, behavior)

    def add_any_detector(self) -> None:
        if not any(self.payloads.values()):
            vehicle = next(iter(self.domains), "vehicle_1")
            self.domains.setdefault(vehicle, Domain.GROUND)
            self.payloads[f"{vehicle}/detector"] = True

    def add_targets(self, behavior: Behavior) -> None:
        for name, kind in _names(behavior):
            if kind is ParameterKind.VEHICLE:
                self.domains.setdefault(name, Domain.GROUND)

    def add_geometries(self, behavior: Behavior, known: Container[str]) -> None:
        for name, kind in _names(behavior):
            if name in self.geometries or name in known:
                continue
            if kind is ParameterKind.ROUTE:
                self.geometries[name] = Route(self._route())
            elif kind is ParameterKind.AREA:
                self.geometries[name] = Area((self._square(),))
            elif kind is ParameterKind.POSITION and name not in self.domains:
                self.geometries[name] = Point(self._far(150.0))

    def _route(self) -> tuple[Coordinate, ...]:
        return (self._at(0.0, 20.0), self._far(100.0), self._far(200.0), self._far(300.0))

    def _square(self) -> tuple[Coordinate, ...]:
        east, north = self._far_m(200.0)
        corners = ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0), (-50.0, -50.0))
        return tuple(self._at(east + x, north + y) for x, y in corners)

    def _far(self, distance_m: float) -> Coordinate:
        return self._at(*self._far_m(distance_m))

    def _far_m(self, distance_m: float) -> tuple[float, float]:
        """(east, north) of a place in the next geometry's own direction, 40 degrees further on."""
        heading_rad = math.radians(40.0 * len(self.geometries))
        return distance_m * math.sin(heading_rad), distance_m * math.cos(heading_rad)

    def fleet(self, aircraft: Mapping[str, Any]) -> Fleet:
        """Return the fleet. `aircraft`: settings of each aircraft, besides its place."""
        payloads = {
            ResourceId(name): Payload(
                ResourceId(name),
                ResourceId(name.partition("/")[0]),
                SIMULATED,
                {},
                detector=detector,
            )
            for name, detector in self.payloads.items()
        }
        vehicles: dict[ResourceId, Vehicle] = {}
        for number, (name, domain) in enumerate(self.domains.items()):
            latitude_deg, longitude_deg, _ = self._at(SPACING_M * number, 0.0)
            vehicle, settings = ResourceId(name), aircraft if domain is Domain.AIR else {}
            vehicles[vehicle] = Vehicle(
                vehicle,
                domain,
                SIMULATED,
                {"home": [latitude_deg, longitude_deg], **settings},
                payloads=tuple(p.id for p in payloads.values() if p.vehicle == vehicle),
                tags=tuple(self.tags.get(name, ())),
            )
        teams = {
            name: Team(name, tuple(map(ResourceId, members)), ResourceId(members[0]))
            for name, members in self.teams.items()
        }
        return Fleet("sim", "sim", vehicles, payloads, teams, self.geometries, self.origin)

    def _at(self, east_m: float, north_m: float) -> Coordinate:
        latitude_deg, longitude_deg = offset(self.origin[:2], east_m, north_m)
        return (round(latitude_deg, 7), round(longitude_deg, 7), None)


def _literals(condition: Expression | None) -> dict[str, list[str]]:
    """Return the texts that a condition compares facts with, by the name of the fact."""
    found: dict[str, list[str]] = defaultdict(list)
    for node, _ in walk(condition.tree) if condition is not None else ():
        match node:
            case (
                Compare(Comparison.EQUAL, Name(name), Literal(str(text)))
                | Compare(Comparison.EQUAL, Literal(str(text)), Name(name))
                | In(Literal(str(text)), Name(name))
            ):
                found[name].append(text)
    return found


def _is_flown(task: Behavior | ServiceCall) -> bool:
    if not isinstance(task, Behavior) or task.type is BehaviorType.PAYLOAD:
        return False
    altitude = any(parameter.name == "altitude" for parameter in task.parameters)
    return altitude or task.name in _AIR_BEHAVIORS


def _names(behavior: Behavior) -> Iterator[tuple[str, ParameterKind | None]]:
    """Parameter values that may be names (no expressions, no coordinates), and of what."""
    spec = SHARED.get((behavior.name, behavior.type))
    for parameter in behavior.parameters:
        value = parameter.value
        if not isinstance(value, str) or value.lstrip().startswith("[") or is_local(value):
            continue
        if spec is None:
            yield value, _KIND_BY_NAME.get(parameter.name)
        elif parameter.name in spec.by_name:
            yield value, spec.by_name[parameter.name].kind
