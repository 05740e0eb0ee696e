"""Plans that ground stations have uploaded, checked and carried out as runs of m2pem.

A plan becomes a mission with one task after the other, which is checked, journaled, approved,
stopped and kept apart from others as every mission is. It begins in the name of the station that
starts it.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import (
    Area,
    BehaviorType,
    LatLon,
    MissionControl,
    MissionFiles,
    MissionTask,
    Point,
    ResourceId,
    Route,
    RunId,
    RunStatus,
    RunSummary,
    Severity,
    TaskOf,
    Value,
    as_geojson,
    own_areas,
    own_fences,
    read_fence_items,
    read_mission_tasks,
    shown_geometries,
    tasks_in_a_row,
)
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.commands import RefusedCommandError
from m2pem_plugin_mavlink.face.plan import PlanRun, UploadedPlan
from m2pem_plugin_mavlink.face.requests import FENCE, MISSION, Request, Say, acknowledge_plan
from m2pem_plugin_mavlink.face.uploads import ALL_PLANS, PLAN_TYPES, mission_items
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Message, message_type

ACCEPTED: int = dialect.MAV_MISSION_ACCEPTED
DENIED: int = dialect.MAV_MISSION_DENIED
UNSUPPORTED: int = dialect.MAV_MISSION_UNSUPPORTED

TAKEOFF_M = 10.0
"""The height of a take-off that a plan does not say: of one whose altitudes are above sea level."""

_HEIGHTS = ("air", "subsurface")
WARNINGS_SAID = 4


class PlanRuns:
    """`say` tells a station why something is refused; `send` sends a message of a vehicle to all
    stations."""

    def __init__(
        self,
        control: MissionControl,
        say: Say,
        send: Callable[[ShownVehicle, Message], None],
    ) -> None:
        self._control = control
        self._say = say
        self._send = send

    # --- what is uploaded -------------------------------------------------------------------------

    async def store(
        self, request: Request, type_: int, items: Sequence[Message]
    ) -> tuple[int, str]:
        """Check a plan and keep it in place of the one before; return MAV_MISSION_RESULT, and why
        it is refused or what of it is left out."""
        vehicle = request.vehicle
        if type_ == MISSION:
            # To ArduPilot, item 0 is the home position.
            first = int(request.station.ardupilot_modes)
            return await self._store_mission(vehicle, items, first)
        if type_ == FENCE:
            return await self._store_fence(vehicle, items, request.by)
        vehicle.rally_points = UploadedPlan(items)
        unused = "the rally points are kept, and not used: it returns to its home"
        return ACCEPTED, unused if items else ""

    async def _store_mission(
        self, vehicle: ShownVehicle, items: Sequence[Message], first: int
    ) -> tuple[int, str]:
        read = read_mission_tasks(mission_items(items[first:]))
        for problem in read.problems:
            if problem.severity is Severity.ERROR:
                return UNSUPPORTED, str(problem)
        tasks = [_for_domain(each, vehicle.domain) for each in read.tasks]
        warnings = [str(each) for each in read.problems]
        for task in [each for each in tasks if each.of_payload and not _camera(vehicle)]:
            warnings.append(f"{_where(task.items)}: it has no camera: the pictures are left out")
            tasks.remove(task)
        plan = UploadedPlan(items, tasks)
        self.restore_fence(vehicle)  # operators may have changed it
        if tasks:
            try:
                reason = self._misfit(vehicle, tasks) or await self._findings(vehicle, plan)
            except M2pemError as error:
                reason = str(error)
            if reason:
                return UNSUPPORTED, reason
        elif items:
            return DENIED, "no item of the plan moves it"
        run = vehicle.plan_run
        if run is not None and not run.status.ended:
            warnings.insert(0, f"{run.run} goes on with the plan that it began with")
        vehicle.uploaded = plan
        if (more := len(warnings) - WARNINGS_SAID) > 0:
            warnings[WARNINGS_SAID:] = [f"and {more} more"]
        return ACCEPTED, "; ".join(warnings)

    def _misfit(self, vehicle: ShownVehicle, tasks: Sequence[MissionTask]) -> str:
        """Return what a vehicle cannot do, or may not by its fences; "": it can do all."""
        for task in tasks:
            if not task.of_payload and task.behavior not in vehicle.behaviors:
                return f"{_where(task.items)}: {vehicle.resource} has no {task.behavior}"
        way: list[LatLon] = []
        names: list[str] = []
        for task in tasks:
            for number, (place, _) in zip(task.items, task.places, strict=False):
                way.append(place[:2])
                names.append(f"item {number}")
        for fence in vehicle.fences if way else ():
            if (breach := fence.find_breach(way, None, names.__getitem__)) is not None:
                return str(breach)
        return ""

    async def _findings(self, vehicle: ShownVehicle, plan: UploadedPlan) -> str:
        source, data, tasks = _mission_of(vehicle, plan.tasks)
        preview = await self._control.preview_start(source, data=data)
        for finding in preview.findings:
            if finding.severity is Severity.ERROR:
                task = tasks.get(finding.element)
                return f"{_where(task.items)}: {finding.message}" if task else finding.message
        return ""

    async def _store_fence(
        self, vehicle: ShownVehicle, items: Sequence[Message], by: str
    ) -> tuple[int, str]:
        areas, problems = read_fence_items(mission_items(items))
        if problems:
            return UNSUPPORTED, str(problems[0])
        new = {f"{vehicle.resource}.{name}": area for name, area in areas.items()}
        try:
            # The old ones go last: a fault between leaves the vehicle less room, not more.
            for name, area in new.items():
                await self._control.set_geometry(name, as_geojson(area), by=by)
            for name in own_areas(vehicle.resource, shown_geometries(self._control)):
                if name not in new:
                    await self._control.delete_geometry(name, by=by)
        except M2pemError as error:
            return DENIED, str(error)
        finally:
            self.restore_fence(vehicle)
        vehicle.uploaded_fence = UploadedPlan(items)
        return ACCEPTED, ""

    def restore_fence(self, vehicle: ShownVehicle) -> None:
        """Take the fence of a vehicle from what was handed over, before a restart, too."""
        vehicle.own_fences = own_fences(vehicle.resource, shown_geometries(self._control))

    async def clear(self, request: Request) -> None:
        """MISSION_CLEAR_ALL: forget the plan. A run of it goes on."""
        type_ = request.message.mission_type
        for each in PLAN_TYPES if type_ == ALL_PLANS else (type_,):
            result, reason = await self.store(request, each, ())
            if reason:
                self._say(request.station, request.vehicle, reason)
            if result != ACCEPTED:
                break
        acknowledge_plan(request, result, type_)

    # --- runs -------------------------------------------------------------------------------------

    async def start(self, vehicle: ShownVehicle, by: str) -> None:
        """Begin the plan of a vehicle, or go on with the run of it that is paused.

        Raises:
            RefusedCommandError: there is none.
            M2pemError: it may not begin.
        """
        run = vehicle.plan_run
        if run is not None and not run.status.ended:
            if run.by != by:
                raise M2pemError(f"{run.run} has it, which {run.by} began")
            if run.status is RunStatus.PAUSED:
                await self._control.resume(run.run, by=by)
            return
        plan = vehicle.uploaded
        if not plan.tasks:
            raise RefusedCommandError("it has no plan: upload one")
        tasks = _from_here(vehicle, plan.tasks)
        source, data, named = _mission_of(vehicle, tasks)
        # Records of the run may come before `start` returns.
        began = vehicle.plan_run = PlanRun("", by, plan, named)
        try:
            began.run = await self._control.start(source, data=data, by=by)
        except BaseException:
            vehicle.plan_run = run
            raise
        if vehicle.task[0] == began.run:
            began.element = vehicle.task[1]
        runs = await self._control.runs()
        self.status_changed([vehicle], began.run, _status_of(began.run, runs))

    def requested(self, vehicle: ShownVehicle, run: RunId, element: str) -> None:
        """A behavior of a run is requested of the vehicle."""
        vehicle.task = run, element
        own = vehicle.plan_run
        if own is not None and own.run == run:
            own.element = element

    def task_ended(self, vehicle: ShownVehicle, run: RunId, element: str) -> None:
        """A behavior of a run has succeeded."""
        own = vehicle.plan_run
        if own is not None and own.run == run and element in own.tasks:
            self._reached(vehicle, own, own.tasks[element].items)

    def status_changed(
        self, vehicles: Collection[ShownVehicle], run: RunId, status: RunStatus
    ) -> None:
        """A run is paused, goes on, or has ended."""
        for vehicle in vehicles:
            own = vehicle.plan_run
            if own is None or own.run != run or own.status.ended:
                continue
            own.status = status
            if status is RunStatus.COMPLETED:
                self._reached(vehicle, own, [len(own.plan.items) - 1])

    def progress(self, vehicle: ShownVehicle) -> None:
        """Say which waypoints of a route the vehicle has passed."""
        own = vehicle.plan_run if vehicle.runs_plan else None
        task = own.tasks.get(own.element) if own is not None else None
        if own is not None and task is not None:
            self._reached(vehicle, own, task.items[: vehicle.plan.current])

    def _reached(self, vehicle: ShownVehicle, own: PlanRun, items: Sequence[int]) -> None:
        for number in items:
            if number not in own.done:
                own.done.append(number)
                self._send(vehicle, message_type("MISSION_ITEM_REACHED").make(seq=number))


def _status_of(run: RunId, runs: Iterable[RunSummary]) -> RunStatus:
    return next((each.status for each in runs if each.run == run), RunStatus.RUNNING)


def _camera(vehicle: ShownVehicle) -> ResourceId | None:
    return next((each.resource for each in vehicle.cameras if each.takes_pictures), None)


def _where(items: Sequence[int]) -> str:
    return f"item {items[0]}" if items else "the take-off before item 0"


def _for_domain(task: MissionTask, domain: str) -> MissionTask:
    """Return a task without heights for vehicles that have none."""
    if domain in _HEIGHTS:
        return task
    parameters = dict(task.parameters)
    for name, value in parameters.items():
        if isinstance(value, Route):
            places = [(*each[:2], None) for each in value.waypoints]
            parameters[name] = Route.of(places, value.frames, value.speeds_m_s)
        elif isinstance(value, Point):
            parameters[name] = Point((*value.position[:2], None))
    return replace(task, parameters=parameters)


def _from_here(vehicle: ShownVehicle, tasks: Sequence[MissionTask]) -> Sequence[MissionTask]:
    """Return the tasks for a vehicle as it is: one on the ground takes off first, and one in the
    air does not take off."""
    if vehicle.domain != "air" or "takeoff" not in vehicle.behaviors:
        return tasks
    first = tasks[0]
    if vehicle.airborne:
        if first.behavior != "takeoff":
            return tasks
        climb = replace(first, behavior="change_altitude")
        return [climb, *tasks[1:]] if climb.behavior in vehicle.behaviors else tasks[1:]
    if first.behavior == "takeoff":
        return tasks
    (*_, height_m), frame = next((each.places[0] for each in tasks if each.places), ((None,), ""))
    known = height_m if frame == "relative" and height_m and height_m > 0 else TAKEOFF_M
    return [MissionTask("takeoff", (), {"altitude": f"{known} m"}), *tasks]


def _mission_of(
    vehicle: ShownVehicle, tasks: Sequence[MissionTask]
) -> tuple[MissionFiles, dict[str, Value], dict[str, MissionTask]]:
    """Return the mission of tasks, the data that its run needs, and the tasks by the ids of its
    elements."""
    geometries: dict[str, Point | Route | Area] = {}
    made: list[TaskOf] = []
    for task in tasks:
        parameters: dict[str, Value] = {}
        for name, value in task.parameters.items():
            if isinstance(value, Route):
                parameters[name] = own = f"route{len(geometries) + 1}"
                geometries[own] = value
            elif isinstance(value, Point):
                place = value.position
                parameters[name] = list(place if place[2] is not None else place[:2])
                if place[2] is not None:
                    parameters["altitude_frame"] = value.altitude_frame
            else:
                parameters[name] = value
        resource = (_camera(vehicle) if task.of_payload else None) or vehicle.resource
        kind = BehaviorType.PAYLOAD if task.of_payload else BehaviorType.VEHICLE
        first, last = (task.items[0], task.items[-1]) if task.items else (None, None)
        numbers = f"item {first}" if first == last else f"items {first} to {last}"
        label = task.behavior if first is None else f"{task.behavior} ({numbers})"
        made.append(TaskOf(label, kind, resource, task.behavior, parameters))
    name = f"plan of {vehicle.resource}"
    source, data = tasks_in_a_row(name, made, geometries)
    named = {f"Task{number}": task for number, task in enumerate(tasks, start=1)}
    return MissionFiles(name, source), data, named
