"""Estimates of a mission as it is drawn, by the kinematics of simulated vehicles.

The flow is followed once, from the start: each behavior's plan says how long it takes, how far it
goes and where it ends. Where branches meet, what took the longest counts. Loops count once, and
waits for operators, messages and detections take no time; all that is said in `left_out`.
"""

import copy
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from m2pem.api.arbiter import Connection
from m2pem.api.estimates import MissionEstimate, NotEstimated, TaskEstimate, VehicleEstimate
from m2pem.errors import FleetError, MissionError
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.endurance import RESERVE
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import ResolvedValue, examine
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    CallActivity,
    Container,
    EventBasedGateway,
    FlowNode,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    ManualTask,
    ReceiveTask,
    ScriptTask,
    SendTask,
    ServiceTask,
    SubProcess,
    UserTask,
)
from m2pem.mission.events import TimerEventDefinition
from m2pem.mission.mission import Mission
from m2pem.simulation.course import RefusedError
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.gimbals import GAZES
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.manoeuvres import MANOEUVRES
from m2pem.simulation.segments import Pose
from m2pem.simulation.settings import read_settings
from m2pem.simulation.vehicles import SimVehicle
from m2pem.units import US_PER_S
from m2pem.verify.translate.timers import fixed

_DEEPEST_CALL = 20
_MORE = 1_000.0
"""Batteries that each vehicle has besides, so that what lacks can be said."""

_AS_ROUTES = ("formation", "road_following_formation", "road_sweep", "bridge_crossing")
"""Team behaviors whose members go along the route."""


@dataclass(frozen=True, slots=True)
class _State:
    """The vehicles when a token is somewhere. `busy_s`, `distance_m`: of their tasks until then."""

    at_us: int
    vehicles: dict[ResourceId, SimVehicle]
    busy_s: dict[ResourceId, float] = field(default_factory=dict)
    distance_m: dict[ResourceId, float] = field(default_factory=dict)

    def merged(self, other: "_State") -> "_State":
        """Of each vehicle, the state in which it has done more."""
        at_us = max(self.at_us, other.at_us)
        chosen = {
            each: other if other.busy_s.get(each, 0.0) > self.busy_s.get(each, 0.0) else self
            for each in self.vehicles
        }
        return _State(
            at_us,
            {each: state.vehicles[each] for each, state in chosen.items()},
            {each: state.busy_s.get(each, 0.0) for each, state in chosen.items()},
            {each: state.distance_m.get(each, 0.0) for each, state in chosen.items()},
        )


def estimate_mission(mission: Mission, fleet: Fleet, process: str | None = None) -> MissionEstimate:
    """Return what a mission takes from the start of a process; None: its main one.

    Vehicles begin where they are simulated to stand, with the battery that the fleet file gives
    the simulation, else a full one.

    Raises:
        FleetError: a vehicle of the fleet cannot be simulated.
        MissionError: there is no such process.
    """
    return _Estimate(mission, fleet).of(process)


def endurance_findings(mission: Mission, fleet: Fleet) -> list[Finding]:
    """Return a warning for each vehicle whose battery would fall below the reserve, at the task
    after which it has; only of vehicles whose endurance the fleet states."""
    try:
        estimate = estimate_mission(mission, fleet)
    except (FleetError, MissionError):
        return []  # other checks say why
    short = {
        each.vehicle: each
        for each in estimate.vehicles
        if each.stated and each.battery_left < estimate.reserve
    }
    findings = []
    for name, vehicle in short.items():
        own = [each for each in estimate.tasks if each.vehicle == name]
        at = next((each for each in own if each.battery_left < estimate.reserve), own[-1])
        node = mission.elements[at.element]
        left = (
            "is empty before the mission's end"
            if vehicle.battery_left <= 0
            else f"would be at {vehicle.battery_left:.0%} at the mission's end"
        )
        findings.append(
            Finding(
                Severity.WARNING,
                mission.file_of(node) if isinstance(node, FlowNode) else mission.file,
                node.line,
                at.element,
                "endurance",
                f"{at.element} (line {node.line}): the battery of {name} {left}, below the reserve "
                f"of {estimate.reserve:.0%}: it goes {vehicle.distance_m:.0f} m, with an endurance "
                f"of {vehicle.endurance_s / 60:.0f} min",
                "shorten its way, share it with another vehicle, or charge it in between",
            )
        )
    return findings


class _Estimate:
    """One estimate in the making."""

    def __init__(self, mission: Mission, fleet: Fleet) -> None:
        self._mission = mission
        self._fleet = fleet
        self._frame = FlatFrame(fleet.origin)
        self._geometries = {**fleet.geometries, **mission.geometries}
        self._tasks: list[TaskEstimate] = []
        self._left_out: dict[NotEstimated, None] = {}
        self._calls: list[str] = []

    def of(self, process: str | None) -> MissionEstimate:
        try:
            start = self._mission.process(process)
        except KeyError:
            message, file = f"there is no process {process!r}", self._mission.file
            finding = Finding(Severity.ERROR, file, 0, process or "", "unknown-process", message)
            raise MissionError(f"{file} cannot be estimated", [finding]) from None
        state = self._container(start, _State(0, dict(self._simulated())))
        end_us = state.at_us
        vehicles = []
        acting = {each.vehicle for each in self._tasks}
        for name in (each for each in self._fleet.vehicles if each in acting):
            stated = self._fleet.vehicles[name].endurance_s is not None
            vehicle = state.vehicles[name]
            vehicles.append(
                VehicleEstimate(
                    name,
                    state.distance_m.get(name, 0.0),
                    state.busy_s.get(name, 0.0),
                    _battery_left(vehicle, end_us),
                    vehicle.kinematics.endurance_s,
                    stated,
                )
            )
        return MissionEstimate(
            end_us / US_PER_S,
            RESERVE,
            tuple(vehicles),
            tuple(sorted(self._tasks, key=lambda each: each.begins_s)),
            tuple(self._left_out),
        )

    def _simulated(self) -> Iterator[tuple[ResourceId, SimVehicle]]:
        for place, each in enumerate(self._fleet.vehicles.values()):
            connection = Connection(
                each.id,
                each.domain.value,
                each.settings,
                cruise_speed_m_s=each.cruise_speed_m_s,
                endurance_s=each.endurance_s,
            )
            settings = read_settings(connection, self._fleet.origin)
            vehicle = SimVehicle(connection, settings, self._frame, place, 0)
            vehicle.battery += _MORE  # a battery never shows less than nothing
            yield each.id, vehicle

    # --- the flow -------------------------------------------------------------------------------

    def _container(self, container: Container, state: _State) -> _State:
        """Follow the flow of a process or subprocess to its ends."""
        order = _in_order(container)
        place = {node: index for index, node in enumerate(order)}
        arrived: dict[FlowNode, _State] = dict.fromkeys(container.entries, state)
        ended: _State | None = None
        for each in container.event_subprocesses:
            self._leave_out(each, "what happens in between is not counted")
        for node in order:
            before = arrived.get(node)
            if before is None:
                continue
            after = self._node(node, before)
            followers = _followers(node)
            for to in followers:
                if place[to] <= place[node]:
                    self._leave_out(to, "a loop: counted once")
                else:
                    there = arrived.get(to)
                    arrived[to] = after if there is None else there.merged(after)
            if not node.outgoing and not isinstance(node, BoundaryEvent):
                ended = after if ended is None else ended.merged(after)
        return state if ended is None else ended

    def _node(self, node: FlowNode, state: _State) -> _State:
        if isinstance(node, Activity) and node.loop is not None:
            self._leave_out(node, "it repeats, or has several instances: counted once")
        match node:
            case ScriptTask() | ServiceTask() | SendTask() if node.behavior is not None:
                return self._behavior(node, node.behavior, state)
            case ServiceTask():
                self._leave_out(node, "how long its service takes is not known")
            case UserTask() | ManualTask():
                self._leave_out(node, "how long an operator takes is not known")
            case ReceiveTask() | EventBasedGateway():
                self._leave_out(node, "how long it waits is not known")
            case IntermediateCatchEvent() if not node.linked_from:
                return self._wait(node, state)
            case CallActivity() if node.called.id not in self._calls:
                if len(self._calls) < _DEEPEST_CALL:
                    self._calls.append(node.called.id)
                    state = self._container(node.called, state)
                    self._calls.pop()
            case CallActivity():
                self._leave_out(node, "it calls itself: counted once")
            case SubProcess():
                return self._container(node, state)
            case _:
                pass
        return state

    def _wait(self, node: IntermediateCatchEvent, state: _State) -> _State:
        for definition in node.definitions:
            if isinstance(definition, TimerEventDefinition):
                duration_us = fixed(definition)
                if duration_us is not None:
                    return _State(
                        state.at_us + duration_us,
                        state.vehicles,
                        state.busy_s,
                        state.distance_m,
                    )
        self._leave_out(node, "how long it waits is not known")
        return state

    def _leave_out(self, node: FlowNode, reason: str) -> None:
        self._left_out[NotEstimated(node.id, node.label, reason)] = None

    # --- behaviors ------------------------------------------------------------------------------

    def _behavior(self, task: Activity, behavior: Behavior, state: _State) -> _State:
        if any(not role.resource for role in behavior.roles):
            self._leave_out(task, "who does it is chosen when it starts")
            return state
        if behavior.type is BehaviorType.PAYLOAD:
            reason = "how long a payload takes is not counted"
            if behavior.name in GAZES:
                self._leave_out(task, reason)
            return state
        values = self._values(task, behavior)
        name = behavior.name
        if behavior.type is BehaviorType.TEAM and name in _AS_ROUTES and values is not None:
            name = "single_vehicle_routing"
        elif behavior.type is BehaviorType.TEAM:
            self._leave_out(task, "how a team shares its work is not known before")
            return state
        manoeuvre = MANOEUVRES.get(name)
        if values is None or manoeuvre is None:
            if manoeuvre is None:
                self._leave_out(task, f"how long '{behavior.name}' takes is not known")
            return state
        vehicles, busy_s = dict(state.vehicles), dict(state.busy_s)
        distance_m, end_us = dict(state.distance_m), state.at_us

        def pose_of(name: str) -> Pose | None:
            vehicle = vehicles.get(ResourceId(name))
            return None if vehicle is None else vehicle.pose(state.at_us)

        parameters = LocalParameters(values, self._frame, pose_of)
        for resource in self._vehicles(behavior):
            vehicle = copy.copy(vehicles[resource])
            try:
                made = manoeuvre(vehicle.craft(state.at_us), parameters)
            except RefusedError as error:
                self._leave_out(task, error.reason)
                return state
            duration_s = 0.0 if made.plan is None else made.plan.duration_s
            if made.pursuit is not None or math.isinf(duration_s):
                self._leave_out(task, "it does not end by itself")
                continue
            if made.plan is not None:
                vehicle.take(made.plan, state.at_us)
            if made.cruise_m_s is not None:
                vehicle.cruise_m_s = made.cruise_m_s
            vehicles[resource] = vehicle
            ends_us = state.at_us + round(duration_s * US_PER_S)
            end_us = max(end_us, ends_us)
            length_m = 0.0 if made.plan is None else made.plan.level_m_left(0.0)
            busy_s[resource] = busy_s.get(resource, 0.0) + duration_s
            distance_m[resource] = distance_m.get(resource, 0.0) + length_m
            self._tasks.append(
                TaskEstimate(
                    task.id,
                    task.label,
                    resource,
                    state.at_us / US_PER_S,
                    length_m,
                    duration_s,
                    _battery_left(vehicle, ends_us),
                )
            )
        return _State(end_us, vehicles, busy_s, distance_m)

    def _vehicles(self, behavior: Behavior) -> Iterable[ResourceId]:
        for role in behavior.roles:
            for resource in resources_of(role, self._fleet):
                if resource in self._fleet.vehicles:
                    yield resource

    def _values(self, task: Activity, behavior: Behavior) -> dict[str, ResolvedValue] | None:
        spec = SHARED.get((behavior.name, behavior.type))
        if spec is None:
            return None
        literal = {p.name: p.value for p in behavior.parameters if isinstance(p.value, str)}
        deferred = [p.name for p in behavior.parameters if not isinstance(p.value, str)]
        if deferred:
            names = ", ".join(f"'{each}'" for each in deferred)
            self._leave_out(task, f"{names} is known only when it starts")
            return None
        values, problems = examine(
            spec,
            literal,
            self._geometries.get,
            self._fleet.vehicles,
            origin=self._fleet.origin,
        )
        if problems:
            self._leave_out(task, problems[0].message)
            return None
        return values


def _battery_left(vehicle: SimVehicle, at_us: int) -> float:
    """Return what is left of its battery; below 0 if that does not last."""
    return vehicle.battery_at(at_us) - _MORE


def _followers(node: FlowNode) -> Sequence[FlowNode]:
    found = [flow.target for flow in node.outgoing]
    if isinstance(node, Activity):
        found += node.boundary
    if isinstance(node, IntermediateThrowEvent) and node.links_to is not None:
        found.append(node.links_to)
    return found


def _in_order(container: Container) -> list[FlowNode]:
    """Return the nodes that the flow reaches, each before those after it, except around loops."""
    seen: set[FlowNode] = set()
    done: list[FlowNode] = []
    for entry in reversed(container.entries):
        stack = [(entry, iter(_followers(entry)))] if entry not in seen else []
        seen.add(entry)
        while stack:
            node, following = stack[-1]
            to = next((each for each in following if each not in seen), None)
            if to is None:
                done.append(node)
                stack.pop()
            else:
                seen.add(to)
                stack.append((to, iter(_followers(to))))
    return done[::-1]
