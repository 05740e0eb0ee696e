"""The fleet's fence and simulated vehicles: what is refused, and what `check` finds beforehand.

Where a vehicle begins is followed back along the flow while there is one way: to a task of the
vehicle, whose plan says where it ends, or to the start of the mission, at the vehicle's home.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias

from m2pem.api.arbiter import Connection
from m2pem.api.fence_check import FenceCheck
from m2pem.errors import FleetError
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import ResolvedValue, examine
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.fence import Breach, Fence
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import Activity, CallActivity, FlowNode, StartEvent, SubProcess
from m2pem.mission.geometry import Area
from m2pem.mission.mission import Mission
from m2pem.simulation.course import Craft, RefusedError, track_of
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.manoeuvres import MANOEUVRES, Manoeuvre
from m2pem.simulation.segments import Pose
from m2pem.simulation.settings import read_settings
from m2pem.simulation.vehicles import SimVehicle

_BY_TRACK = ("area_observe", "area_survey", "orbit")
"""Behaviors whose way is not in their parameters."""

_MOST_TASKS = 100
"""So many tasks of a vehicle are followed back at once; later ones begin where these end."""

_ENDS_AT_A_PLACE = ("area_survey", "goto", "single_vehicle_routing")
"""Behaviors that end at the same place wherever they begin."""

_Start: TypeAlias = tuple[Pose, bool] | None

_AS_ROUTES = ("formation", "road_following_formation", "road_sweep", "bridge_crossing")


def refusal(
    behavior: str, parameters: LocalParameters, craft: Craft, made: Manoeuvre, start: bool = True
) -> Breach | None:
    """Return where a manoeuvre would leave the fence, in the words of all arbiters; None: it does
    not. `start`: whether the craft is where it will begin."""
    fence = parameters.fence
    if fence is None:
        return None
    place = fence.frame.to_latlon(craft.pose.place[:2]) if start else None
    check = FenceCheck(fence, parameters.stance)
    found = check.find_breach(behavior, parameters.given, place, craft.pose.yaw)
    if found or made.plan is None or behavior not in _BY_TRACK:
        return found
    track = track_of(made.plan)
    if not start:
        there = (at for at, each in enumerate(track) if math.dist(each, track[0]) > 1e-3)
        track = track[next(there, 0) :]
    return fence.leaves(track)


def crossed(parameters: LocalParameters, made: Manoeuvre) -> str:
    """Return what a way home crosses, which is never refused; "" if nothing."""
    fence = parameters.fence
    if fence is None or made.plan is None:
        return ""
    track = track_of(made.plan)
    way = [to for at, to in pairwise(track) if math.dist(at, to) > 1e-3]
    start, *places = map(fence.frame.to_latlon, (track[0], *way))
    return fence.breach(
        places, start, lambda at: "its home" if at == len(way) - 1 else "a corner of its way home"
    )


def fence_findings(mission: Mission, fleet: Fleet) -> list[Finding]:
    """Return an error for each behavior that the fence refuses, or a warning where it does if the
    vehicle begins at its home; and where a return would leave it, once for each vehicle."""
    area = fleet.geometries.get(fleet.fence)
    return list(_Fenced(mission, fleet, area).found()) if isinstance(area, Area) else []


class _Fenced:
    def __init__(self, mission: Mission, fleet: Fleet, area: Area) -> None:
        self._mission = mission
        self._fleet = fleet
        self._frame = FlatFrame(fleet.origin)
        self._fence = Fence(area, frame=self._frame)
        self._geometries = {**fleet.geometries, **mission.geometries}
        self._vehicles: dict[ResourceId, SimVehicle] = {}
        for place, each in enumerate(fleet.vehicles):
            connection = Connection.of(fleet, each)
            try:
                settings = read_settings(connection, fleet.origin)
            except FleetError:
                continue  # other checks say why
            self._vehicles[each] = SimVehicle(connection, settings, self._frame, place, 0)
        self._returned: set[ResourceId] = set()
        self._ends: dict[tuple[FlowNode, ResourceId], _Start] = {}

    def found(self) -> Iterator[Finding]:
        for task in self._mission.activities():
            behavior = _behavior(task)
            values = None if behavior is None else self._values(behavior)
            if behavior is None or values is None:
                continue
            findings = TaskFindings(self._mission.file_of(task), task)
            for name in self._who(behavior):
                self._check(task, behavior, values, name, findings)
                if behavior.type is BehaviorType.TEAM and findings.found:
                    break  # of the others is the same
            yield from findings.found

    def _check(
        self,
        task: Activity,
        behavior: Behavior,
        values: Mapping[str, ResolvedValue],
        name: ResourceId,
        findings: TaskFindings,
    ) -> None:
        alone = behavior.type is BehaviorType.VEHICLE and any(r.resource for r in behavior.roles)
        start, certain = (self._start(task, name) if alone else None) or (None, True)
        craft, made, breach = self._made(behavior, values, name, start)
        if breach is not None:
            certain = certain or bool(self._made(behavior, values, name, None)[2])
            findings.add(
                "outside-fence",
                f"{name}: {breach}",
                "move it inside, or widen the fleet's `fence`",
                line=behavior.line,
                severity=Severity.ERROR if certain else Severity.WARNING,
                place=breach.place,
            )
        elif made is not None and made.plan is not None and name not in self._returned:
            home = self._frame.to_latlon(craft.home[:2])
            for place in track_of(made.plan):
                at = self._frame.to_latlon(place)
                if breach := self._fence.find_breach([home], at, lambda _: "its home"):
                    self._returned.add(name)
                    findings.add(
                        "return-leaves-fence",
                        f"{name}: on a straight return from [{at[0]:.6f}, {at[1]:.6f}], as after a "
                        f"failsafe, {breach}",
                        "move its home or its way, or set rally points",
                        line=behavior.line,
                        severity=Severity.WARNING,
                        place=breach.place,
                    )
                    return

    def _made(
        self,
        behavior: Behavior,
        values: Mapping[str, ResolvedValue],
        name: ResourceId,
        start: Pose | None,
    ) -> tuple[Craft, Manoeuvre | None, Breach | None]:
        """Return what the vehicle would do from a start, and why the fence refuses that."""
        craft = self._vehicles[name].craft(0)
        if craft.flies:  # whether it has taken off is another check
            east, north, up = craft.home
            aloft = Pose((east, north, up + craft.kinematics.default_altitude_m), craft.pose.yaw)
            craft = replace(craft, pose=aloft)
        if start is not None:
            craft = replace(craft, pose=start)
        does = "single_vehicle_routing" if behavior.name in _AS_ROUTES else behavior.name
        poses = {str(each): vehicle.pose(0) for each, vehicle in self._vehicles.items()}
        parameters = LocalParameters(values, self._frame, poses.get, self._fence)
        try:
            made = MANOEUVRES[does](craft, parameters)
        except RefusedError:
            return craft, None, None
        if parameters.target_vehicle is not None:  # where that is then is not known
            return craft, made, None
        return craft, made, refusal(does, parameters, craft, made, start is not None)

    def _start(self, node: FlowNode, name: ResourceId, depth: int = 0) -> _Start:
        """Return where a vehicle is when a task begins, and whether that is certain: it may not
        begin at its home. None: it is not known."""
        seen: set[FlowNode] = set()
        while node not in seen:
            seen.add(node)
            if isinstance(node, StartEvent) and not node.definitions:
                if isinstance(node.container, SubProcess):
                    node = node.container
                    continue
                is_main = node.container is self._mission.process()
                return (self._vehicles[name].pose(0), False) if is_main else None
            if len(node.incoming) != 1:
                return None
            node = node.incoming[0].source
            behavior = _behavior(node)
            if isinstance(node, SubProcess | CallActivity):
                return None
            if behavior is not None and name in self._who(behavior):
                if (node, name) not in self._ends and depth < _MOST_TASKS:
                    self._ends[node, name] = self._end(node, behavior, name, depth + 1)
                return self._ends.get((node, name))
        return None

    def _end(self, task: FlowNode, behavior: Behavior, name: ResourceId, depth: int) -> _Start:
        values, start = self._values(behavior), self._start(task, name, depth)
        if values is None or start is None or behavior.type is not BehaviorType.VEHICLE:
            return None
        _, made, _ = self._made(behavior, values, name, start[0])
        if made is None or made.plan is None or math.isinf(made.plan.duration_s):
            return None
        return made.plan.at(made.plan.duration_s), start[1] or behavior.name in _ENDS_AT_A_PLACE

    def _who(self, behavior: Behavior) -> list[ResourceId]:
        """Return the vehicles that perform a behavior; of a role by need, one of them."""
        named = [
            resource
            for role in behavior.roles
            for resource in resources_of(role, self._fleet)
            if resource in self._vehicles
        ]
        return named or list(self._vehicles)[: behavior.type is not BehaviorType.PAYLOAD]

    def _values(self, behavior: Behavior) -> dict[str, ResolvedValue] | None:
        spec = SHARED.get((behavior.name, behavior.type))
        known = behavior.name in (*MANOEUVRES, *_AS_ROUTES)
        if spec is None or not known or behavior.type is BehaviorType.PAYLOAD:
            return None
        literal = {p.name: p.value for p in behavior.parameters if isinstance(p.value, str)}
        values, problems = examine(
            spec,
            literal,
            self._geometries.get,
            self._fleet.vehicles,
            [p.name for p in behavior.parameters if p.name not in literal],
            self._fleet.origin,
        )
        return None if problems else values


def _behavior(node: FlowNode) -> Behavior | None:
    return getattr(node, "behavior", None)
