"""The fleet's fence and simulated vehicles: what is refused, and what `check` finds beforehand.

A vehicle begins where its last task before ends, if that is one and the same on all ways of tokens,
or at its home. Otherwise it is not known where it begins.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from typing import TypeAlias

from m2pem.api.arbiter import Connection
from m2pem.api.fence_check import find_breach
from m2pem.errors import FleetError
from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import ALONG_ROUTES, SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import ResolvedValue, examine_behavior
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.fence import Breach, Fence
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import Activity, Process
from m2pem.mission.mission import Mission
from m2pem.mission.token_flow import TokenFlow
from m2pem.simulation.course import Craft, RefusedError, track_of
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.manoeuvres import MANOEUVRES, Manoeuvre
from m2pem.simulation.segments import Pose
from m2pem.simulation.settings import read_settings
from m2pem.simulation.trajectory import Plan
from m2pem.simulation.vehicles import SimVehicle

_BY_TRACK = ("area_observe", "area_survey", "orbit")
"""Behaviors whose way is not in their parameters."""

_ENDS_AT_A_PLACE = ("area_survey", "goto", "single_vehicle_routing")
"""Behaviors that end at the same place wherever they begin."""

_Start: TypeAlias = tuple[Pose, bool] | None


def breach_of(
    behavior: str, parameters: LocalParameters, craft: Craft, made: Manoeuvre, start: bool = True
) -> Breach | None:
    """Return where a manoeuvre would leave the fence, in the words of all arbiters; None: it does
    not. `start`: whether the craft is where it will begin."""
    fence = parameters.fence
    if fence is None:
        return None
    place = fence.frame.to_latlon(craft.pose.place[:2]) if start else None
    found = find_breach(fence, behavior, parameters, place, craft.pose.yaw, parameters.stance)
    if found or made.plan is None or behavior not in _BY_TRACK:
        return found
    track = track_of(made.plan)
    if not start:
        there = (at for at, each in enumerate(track) if math.dist(each, track[0]) > 1e-3)
        track = track[next(there, 0) :]
    return fence.leaves(track)


def fence_findings(mission: Mission, fleet: Fleet) -> list[Finding]:
    """Return an error for each behavior that the fence refuses, or a warning where it does if the
    vehicle begins at its home; and where a return would leave it, once for each vehicle."""
    return list(_Fenced(mission, fleet).found())


class _Fenced:
    def __init__(self, mission: Mission, fleet: Fleet) -> None:
        self._mission = mission
        self._flow = TokenFlow(mission)
        self._frame = FlatFrame(fleet.origin)
        self._fences: dict[ResourceId, Fence] = {}
        self._vehicles: dict[ResourceId, SimVehicle] = {}
        for place, each in enumerate(fleet.vehicles):
            connection = Connection.of(fleet, each)
            if connection.fence is not None:
                self._fences[each] = connection.fence.in_frame(self._frame)
            with suppress(FleetError):  # other checks say why
                settings = read_settings(connection, fleet.origin)
                self._vehicles[each] = SimVehicle(connection, settings, self._frame, place, 0)
        self._poses = {str(each): vehicle.pose(0) for each, vehicle in self._vehicles.items()}
        self._tasks: dict[Activity, Behavior] = {}
        self._named: dict[Activity, list[ResourceId]] = {}
        self._values: dict[Activity, Mapping[str, ResolvedValue]] = {}
        geometry = {**fleet.geometries, **mission.geometries}.get
        for task, behavior in mission.commands():
            if behavior.type is BehaviorType.PAYLOAD:
                continue
            self._tasks[task] = behavior
            named = chain.from_iterable(resources_of(role, fleet) for role in behavior.roles)
            self._named[task] = [each for each in named if each in self._vehicles]
            if (spec := SHARED.get((behavior.name, behavior.type))) is not None:
                values, problems = examine_behavior(behavior, spec, geometry, fleet)
                if not problems and behavior.name in (*MANOEUVRES, *ALONG_ROUTES):
                    self._values[task] = values

    def found(self) -> Iterator[Finding]:
        starts = {name: self._starts(name) for name in {*chain(*self._named.values())}}
        returned: set[ResourceId] = set()
        for task in self._values:
            behavior, findings = self._tasks[task], TaskFindings(self._mission.file_of(task), task)
            for name in self._named[task] or [*self._vehicles][:1]:  # of a role by need, one
                start = starts.get(name, {}).get(task)
                plan, breach = self._planned(task, name, start)
                if breach is not None:
                    certain = start is None or start[1] or self._planned(task, name, None)[1]
                    findings.add(
                        "outside-fence",
                        f"{name}: {breach}",
                        "move it inside, or widen the fleet's `fence`",
                        line=behavior.line,
                        severity=Severity.ERROR if certain else Severity.WARNING,
                        place=breach.place,
                    )
                elif plan is not None and name not in returned:
                    returned.update(self._crossing(name, plan, behavior.line, findings))
                if behavior.type is BehaviorType.TEAM and findings.found:
                    break  # of the others is the same
            yield from findings.found

    def _crossing(
        self, name: ResourceId, plan: Plan[Pose], line: int, findings: TaskFindings
    ) -> list[ResourceId]:
        """Find where a return of a vehicle leaves the fence; return the vehicle, if it does."""
        home = self._frame.to_latlon(self._vehicles[name].home[:2])
        fence = self._fences.get(name)
        for at in map(self._frame.to_latlon, track_of(plan)):
            if fence and (breach := fence.find_breach([home], at, lambda _: "its home")):
                findings.add(
                    "return-leaves-fence",
                    f"{name}: on a straight return from [{at[0]:.6f}, {at[1]:.6f}], as after a "
                    f"failsafe, {breach}",
                    "move its home or its way, or set rally points",
                    line=line,
                    severity=Severity.WARNING,
                    place=breach.place,
                )
                return [name]
        return []

    def _starts(self, name: ResourceId) -> Mapping[Activity, _Start]:
        """Return where a vehicle is when its tasks begin, and whether that is certain: it may not
        begin at its home. None: it is not known."""
        own = [
            task
            for task, behavior in self._tasks.items()
            if name in self._named[task] or not all(role.resource for role in behavior.roles)
        ]
        main = self._mission.process()
        last = self._flow.last_of(own, main)
        ends: dict[Activity | Process | None, _Start] = {None: None}
        ends[main] = self._vehicles[name].pose(0), False
        starts: dict[Activity, _Start] = {}
        while ready := [each for each in own if each not in starts and last[each] in ends]:
            for task in ready:
                behavior, end = self._tasks[task], None
                alone = behavior.type is BehaviorType.VEHICLE and name in self._named[task]
                starts[task] = start = ends[last[task]] if alone else None
                if start is not None and task in self._values:
                    plan, _ = self._planned(task, name, start)
                    if plan is not None and plan.duration_s < math.inf:
                        sure = start[1] or behavior.name in _ENDS_AT_A_PLACE
                        end = plan.at(plan.duration_s), sure
                ends[task] = end
        return starts

    def _planned(
        self, task: Activity, name: ResourceId, start: _Start
    ) -> tuple[Plan[Pose] | None, Breach | None]:
        """Return what the vehicle would do from a start, and why the fence refuses that."""
        craft, does = self._vehicles[name].craft(0), self._tasks[task].name
        if start is not None:
            craft = replace(craft, pose=start[0])
        if does in ALONG_ROUTES:
            does = "single_vehicle_routing"
        parameters = LocalParameters(
            self._values[task], self._frame, self._poses.get, self._fences.get(name)
        )
        try:
            made = MANOEUVRES[does](craft, parameters)
        except RefusedError:
            return None, None
        if parameters.target_vehicle is not None:  # where that is then is not known
            return made.plan, None
        return made.plan, breach_of(does, parameters, craft, made, start is not None)
