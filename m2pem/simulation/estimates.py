"""Estimates of a mission as it is drawn, by simulated vehicles.

The flow is followed once, from the start: each behavior is simulated alone, which says how long it
takes, how far its vehicles go and where they are then. Where branches meet, what took the longest
counts. Loops count once, and waits for operators, messages and detections take no time; all that is
said in `left_out`.
"""

import copy
from dataclasses import dataclass, field, replace
from typing import cast

from m2pem.api.arbiter import BehaviorRequest, Connection
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.estimates import MissionEstimate, NotEstimated, TaskEstimate, VehicleEstimate
from m2pem.errors import FleetError, MissionError
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.endurance import RESERVE
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.fleet.parameters import ResolvedValue, examine_behavior
from m2pem.fleet.space import may_wait_for_space
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
    ManualTask,
    ReceiveTask,
    ScriptTask,
    SendTask,
    ServiceTask,
    SubProcess,
    UserTask,
)
from m2pem.mission.events import (
    ConditionalEventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following
from m2pem.simulation.arbiters import bodies_at_home
from m2pem.simulation.executions import Body
from m2pem.simulation.single_behavior import simulate_behavior
from m2pem.simulation.vehicles import SimVehicle, carrier_of
from m2pem.units import US_PER_S
from m2pem.verify.translate.timers import fixed

_DEEPEST_CALL = 20
_ROUNDING_S = 1e-3
_SPARE = 1_000.0
"""Batteries that each vehicle has besides, so that what lacks can be said."""

_SETTINGS = {
    **{"telemetry_hz": 0, "footprints": False, "reports_left": False, "state": ""},
    **dict.fromkeys(("faults", "link_lost", "detections", "targets"), ()),
}
"""Of every simulated resource: nothing fails, and nothing is published."""

_WHENEVER = SignalEventDefinition, MessageEventDefinition, ConditionalEventDefinition

_LOOKS = ("target", "area", "heading")
"""What a payload does with these depends on where its vehicle is."""


@dataclass(frozen=True, slots=True)
class _State:
    """The resources when a token is somewhere. `busy_s`: the time of their tasks until then."""

    at_us: int
    bodies: dict[ResourceId, Body]
    busy_s: dict[ResourceId, float] = field(default_factory=dict)

    def vehicle(self, name: ResourceId) -> SimVehicle:
        """Return a vehicle; it is known that it is one."""
        return cast("SimVehicle", self.bodies[name])

    def merged(self, other: "_State") -> "_State":
        """Of each resource, the state in which it has done more."""
        at_us = max(self.at_us, other.at_us)
        chosen = {
            each: other if other.busy_s.get(each, 0.0) > self.busy_s.get(each, 0.0) else self
            for each in self.bodies
        }
        return _State(
            at_us,
            {each: state.bodies[each] for each, state in chosen.items()},
            {each: state.busy_s.get(each, 0.0) for each, state in chosen.items()},
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
        own = [each for each in estimate.tasks if carrier_of(ResourceId(each.vehicle)) == name]
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
        self._fleet = simulated_fleet(fleet, _SETTINGS)
        self._connections = {
            each: Connection.of(self._fleet, each) for each in (*fleet.vehicles, *fleet.payloads)
        }
        self._depending: list[tuple[Activity, ResourceId, float, float]] = []
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
        bodies = bodies_at_home(self._connections, self._fleet.origin, 0)
        for body in bodies.values():
            if isinstance(body, SimVehicle):
                body.spare = _SPARE
                body.battery += _SPARE  # a battery never shows less than nothing
        state = self._container(start, _State(0, bodies))
        self._leave_out_where_others_move()
        end_us = state.at_us
        vehicles = []
        acting = {carrier_of(ResourceId(each.vehicle)) for each in self._tasks}
        for name in (each for each in self._fleet.vehicles if each in acting):
            stated = self._fleet.vehicles[name].endurance_s is not None
            vehicle = state.vehicle(name)
            vehicles.append(
                VehicleEstimate(
                    name,
                    vehicle.driven_m(end_us),
                    state.busy_s.get(name, 0.0),
                    vehicle.battery_at(end_us) - _SPARE,
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
            if isinstance(node, Activity):
                self._leave_out_interruptions(node, after.at_us - before.at_us)
            for to in following(node):
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
                    return replace(state, at_us=state.at_us + duration_us)
        self._leave_out(node, "how long it waits is not known")
        return state

    def _leave_out_interruptions(self, activity: Activity, duration_us: int) -> None:
        for event in activity.boundary:
            for definition in event.definitions if event.interrupting else ():
                due_us = duration_us
                if isinstance(definition, TimerEventDefinition):
                    due_us = fixed(definition) or 0
                if due_us < duration_us or isinstance(definition, _WHENEVER):
                    self._leave_out(event, "what it interrupts is counted to its end")

    def _leave_out(self, node: FlowNode, reason: str) -> None:
        self._left_out[NotEstimated(node.id, node.label, reason)] = None

    # --- behaviors ------------------------------------------------------------------------------

    def _behavior(self, task: Activity, behavior: Behavior, state: _State) -> _State:
        if any(not role.resource for role in behavior.roles):
            self._leave_out(task, "who does it is chosen when it starts")
            return state
        values = self._values(task, behavior)
        if values is None:
            return state
        if not behavior.roles and behavior.name == "hold":
            seconds = BehaviorParameters(values).duration_s or 0.0
            return replace(state, at_us=state.at_us + round(seconds * US_PER_S))
        try:
            found = allocate(behavior, self._fleet)
        except AllocationError as error:
            self._leave_out(task, str(error))
            return state
        acting, is_payload = set(found.resources), behavior.type is BehaviorType.PAYLOAD
        target = BehaviorParameters(values).target_vehicle
        others = {ResourceId(target)} if target is not None else set()
        if is_payload and any(each in values for each in _LOOKS):
            others |= set(map(carrier_of, acting))
        others -= acting
        needed = (*found.resources, *sorted(others))
        bodies = {each: copy.copy(state.bodies[each]) for each in needed}
        for body in bodies.values():
            body.rest(state.at_us, 0)
        end = simulate_behavior(
            self._fleet,
            {each: self._connections[each] for each in bodies},
            bodies,
            BehaviorRequest("e.1", 1, behavior.name, values, found.resources, found.roles),
            behavior.type,
        )
        if end.at_us is None:
            self._leave_out(task, end.reason)
            return state
        if may_wait_for_space(self._fleet, behavior.type, behavior.name, found.resources):
            self._leave_out(task, "how long it waits for space is not counted")
        after = _State(state.at_us + end.at_us, dict(state.bodies), dict(state.busy_s))
        begins_s, time_s = state.at_us / US_PER_S, end.at_us / US_PER_S
        for resource in found.resources:
            if ("/" in resource) is not is_payload:
                continue  # it is only held
            body = after.bodies[resource] = copy.copy(end.bodies[resource])
            body.rest(end.at_us, after.at_us)
            after.busy_s[resource] = after.busy_s.get(resource, 0.0) + time_s
            vehicle = after.vehicle(carrier_of(resource))
            before_m = state.vehicle(carrier_of(resource)).driven_m(state.at_us)
            way_m = vehicle.driven_m(after.at_us) - before_m
            left = vehicle.battery_at(after.at_us) - _SPARE
            self._tasks.append(
                TaskEstimate(task.id, task.label, resource, begins_s, way_m, time_s, left)
            )
        for other in others:
            busy_s = state.busy_s.get(other, 0.0)
            self._depending.append((task, other, busy_s, begins_s + time_s))
        return after

    def _leave_out_where_others_move(self) -> None:
        for task, other, busy_s, end_s in self._depending:
            acts_s = (t.time_s for t in self._tasks if t.vehicle == other and t.begins_s < end_s)
            if sum(acts_s) > busy_s + _ROUNDING_S:
                reason = f"it depends on where {other} is, which another branch moves"
                self._leave_out(task, reason)

    def _values(self, task: Activity, behavior: Behavior) -> dict[str, ResolvedValue] | None:
        spec = SHARED.get((behavior.name, behavior.type))
        if spec is None:
            self._leave_out(task, f"how long '{behavior.name}' takes is not known")
            return None
        values, problems = examine_behavior(behavior, spec, self._geometries.get, self._fleet)
        deferred = [f"'{p.name}'" for p in behavior.parameters if not isinstance(p.value, str)]
        if deferred or problems:
            late = f"{', '.join(deferred)} is known only when it starts"
            self._leave_out(task, late if deferred else problems[0].message)
            return None
        return values


def _in_order(container: Container) -> list[FlowNode]:
    """Return the nodes that the flow reaches, each before those after it, except around loops."""
    seen: set[FlowNode] = set()
    done: list[FlowNode] = []
    for entry in reversed(container.entries):
        stack = [(entry, iter(following(entry)))] if entry not in seen else []
        seen.add(entry)
        while stack:
            node, rest = stack[-1]
            to = next((each for each in rest if each not in seen), None)
            if to is None:
                done.append(node)
                stack.pop()
            else:
                seen.add(to)
                stack.append((to, iter(following(to))))
    return done[::-1]
