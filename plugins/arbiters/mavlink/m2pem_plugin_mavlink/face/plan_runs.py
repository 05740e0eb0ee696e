"""Plans that ground stations have uploaded, checked and carried out as runs of m2pem.

A plan becomes a mission with one task after the other, which is checked, journaled, approved,
stopped and kept apart from others as every mission is. It begins in the name of the station that
starts it.
"""

import logging
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
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
    own_areas,
    own_fences,
    read_fence_items,
    read_mission_tasks,
    read_rally_items,
    shown_geometries,
    tasks_in_a_row,
)
from m2pem.api.records import RunStarted
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.commands import RefusedCommandError
from m2pem_plugin_mavlink.face.kept_plans import as_feature, items_of
from m2pem_plugin_mavlink.face.plan import Item, PlanRun, UploadedPlan
from m2pem_plugin_mavlink.face.plan_messages import plan_id
from m2pem_plugin_mavlink.face.requests import FENCE, MISSION, Request, Say, acknowledge_plan
from m2pem_plugin_mavlink.face.uploads import ALL_PLANS, PLAN_TYPES, mission_items
from m2pem_plugin_mavlink.face.vehicle import AIRBORNE_M, ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Message, message_type

ACCEPTED: int = dialect.MAV_MISSION_ACCEPTED
DENIED: int = dialect.MAV_MISSION_DENIED
UNSUPPORTED: int = dialect.MAV_MISSION_UNSUPPORTED

TAKEOFF_M = 10.0
"""The height of a take-off that a plan does not say: of one whose altitudes are above sea level."""

PLAN, RALLY = "plan", "rally"
"""`VEHICLE.plan` and `VEHICLE.rally`: the geometries that keep them."""

_logger = logging.getLogger(__name__)

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
            return await self._store_mission(vehicle, items, first, request.by)
        if type_ == FENCE:
            return await self._store_fence(vehicle, items, request.by)
        return await self._store_rally(vehicle, items, request.by)

    async def _store_mission(
        self, vehicle: ShownVehicle, items: Sequence[Message], first: int, by: str
    ) -> tuple[int, str]:
        read = read_mission_tasks(mission_items(items[first:]))
        for found in read.problems:
            if found.severity is Severity.ERROR:
                return UNSUPPORTED, str(found)
        tasks = _tasks_for(vehicle, read.tasks)
        warnings = [str(each) for each in read.problems]
        if _camera(vehicle) is None:
            for task in [each for each in read.tasks if each.of_payload]:
                where = _where(task.items)
                warnings.append(f"{where}: it has no camera: the pictures are left out")
        plan = UploadedPlan(items, tasks)
        self.restore(vehicle)  # operators may have changed its fence
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
        route = _way_of(tasks) or self._somewhere(vehicle)
        feature = as_feature(route, items, first) if items else None
        problem = await self._keep(vehicle, PLAN, feature, by)
        self.restore(vehicle)
        if vehicle.uploaded.id != plan.id:
            return DENIED, problem
        if problem:
            warnings.insert(0, problem)
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
            for number, (place, frame) in zip(task.items, task.places, strict=False):
                height_m = place[2] if vehicle.domain == "air" and frame != "amsl" else None
                if height_m is not None and height_m < AIRBORNE_M:
                    above = "the ground" if frame == "terrain" else "home"
                    return (
                        f"item {number}: {height_m:g} m above {above} is on the ground; give lower "
                        "places altitudes above sea level, and land by NAV_LAND"
                    )
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
                await self._control.set_geometry(name, as_feature(area, items, len(new)), by=by)
            for name in own_areas(vehicle.resource, shown_geometries(self._control)):
                if name not in new:
                    await self._control.delete_geometry(name, by=by)
        except M2pemError as error:
            return DENIED, str(error)
        finally:
            self.restore(vehicle)
        return ACCEPTED, ""

    async def _store_rally(
        self, vehicle: ShownVehicle, items: Sequence[Message], by: str
    ) -> tuple[int, str]:
        points, problems = read_rally_items(mission_items(items))
        if problems:
            return UNSUPPORTED, str(problems[0])
        feature = None
        if items:
            places, frames = [each.position for each in points], [p.altitude_frame for p in points]
            feature = as_feature(Route.of(places, frames), items)
        problem = await self._keep(vehicle, RALLY, feature, by)
        self.restore(vehicle)
        if vehicle.rally_points.id != plan_id(items):
            return DENIED, problem
        unused = "the rally points are kept, and not used: it returns to its home"
        return ACCEPTED, problem or (unused if items else "")

    # --- what is kept -----------------------------------------------------------------------------

    async def _keep(
        self, vehicle: ShownVehicle, kind: str, feature: Mapping[str, Value] | None, by: str
    ) -> str:
        """Have the journal keep a plan in place of the one before, None: none; return why it does
        not."""
        name = f"{vehicle.resource}.{kind}"
        try:
            if feature is not None:
                await self._control.set_geometry(name, feature, by=by)
            elif name in self._control.geometries():
                await self._control.delete_geometry(name, by=by)
        except M2pemError as error:
            return str(error)
        return ""

    def restore(self, vehicle: ShownVehicle) -> None:
        """Take the plans of a vehicle from what was handed over, before a restart, too."""
        given, name = self._control.geometries(), vehicle.resource
        shown = shown_geometries(self._control)
        vehicle.own_fences = own_fences(name, shown)
        of_fence = [each for each in own_areas(name, shown) if each in given]
        kept = [items_of(given[each].geometry) for each in of_fence]
        # Each area of a fence has its items, and how many areas there are.
        is_whole = all(items and areas == len(kept) for items, areas in kept)
        vehicle.uploaded_fence = UploadedPlan(kept[0][0] if kept and is_whole else ())
        rally, plan = given.get(f"{name}.{RALLY}"), given.get(f"{name}.{PLAN}")
        vehicle.rally_points = UploadedPlan(items_of(rally.geometry)[0] if rally else ())
        vehicle.uploaded = _plan_of(vehicle, plan.geometry if plan else {})

    async def take_up(self, vehicles: Iterable[ShownVehicle]) -> None:
        """Restore the plans of vehicles, and know the runs of them that go on after a restart."""
        missions = {f"plan of {each.resource}": each for each in vehicles}
        for vehicle in missions.values():
            self.restore(vehicle)
        for run in await self._control.runs():
            if run.status.ended or (found := missions.get(run.mission)) is None:
                continue
            try:
                found.plan_run = await self._run_of(found, run)
            except M2pemError as error:
                _logger.warning("%s: its plan is not known: %s", run.run, error)

    async def _run_of(self, vehicle: ShownVehicle, run: RunSummary) -> PlanRun | None:
        """Return the run of a plan that a station began; None: of another mission."""
        first = await self._control.records(run.run, 0, 1)
        by = next((each.record.by for each in first if isinstance(each.record, RunStarted)), "")
        elements = (await self._control.mission(run.run)).elements
        labels = {id_: each.label for id_, each in elements.items() if id_.startswith("Task")}
        for version in reversed(
            await self._control.geometry_versions(f"{vehicle.resource}.{PLAN}")
        ):
            plan = _plan_of(vehicle, version.geometry or {})
            tasks = {_numbers(each.items): each for each in plan.tasks}
            tasks[""] = MissionTask("takeoff", ())
            of_run = {id_: tasks.get(each.partition(" ")[2]) for id_, each in labels.items()}
            known = {id_: each for id_, each in of_run.items() if each is not None}
            if plan.tasks and len(known) == len(of_run):
                return PlanRun(run.run, by, plan, known, status=run.status, is_taken_up=True)
        return None

    def _somewhere(self, vehicle: ShownVehicle) -> Route:
        """Return where the plan of a vehicle is shown that leads to no place."""
        position = vehicle.state.position if vehicle.state is not None else None
        place = self._control.fleet().origin[:2] if position is None else position.latlon
        return Route(((*place, None),))

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
        self.restore(vehicle)  # operators may have deleted it
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

    def way_of(self, vehicle: ShownVehicle, run: RunId) -> Sequence[Item]:
        """Return the waypoints of the task of a plan that is under way; none: it has none."""
        own = vehicle.plan_run
        task = own.tasks.get(own.element) if own is not None and own.run == run else None
        return [Item.of(*each) for each in task.places] if task is not None else []

    def task_ended(self, vehicle: ShownVehicle, run: RunId, element: str, *, is_new: bool) -> None:
        """A behavior of a run has succeeded. `is_new`: not before a restart."""
        own = vehicle.plan_run
        if own is not None and own.run == run and element in own.tasks:
            self._reached(vehicle, own, own.tasks[element].items, is_new=is_new)

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
            passed = task.items[: vehicle.plan.current]
            self._reached(vehicle, own, passed, is_new=not own.is_taken_up)
            own.is_taken_up &= not vehicle.plan.is_found

    def _reached(
        self, vehicle: ShownVehicle, own: PlanRun, items: Sequence[int], *, is_new: bool = True
    ) -> None:
        for number in [each for each in items if each not in own.done]:
            own.done.append(number)
            if is_new:
                self._send(vehicle, message_type("MISSION_ITEM_REACHED").make(seq=number))


def _status_of(run: RunId, runs: Iterable[RunSummary]) -> RunStatus:
    return next((each.status for each in runs if each.run == run), RunStatus.RUNNING)


def _camera(vehicle: ShownVehicle) -> ResourceId | None:
    return next((each.resource for each in vehicle.cameras if each.takes_pictures), None)


def _where(items: Sequence[int]) -> str:
    return f"item {items[0]}" if items else "the take-off before item 0"


def _numbers(items: Sequence[int]) -> str:
    """Return the items of a task as the name of its element has them."""
    if not items:
        return ""
    first, last = items[0], items[-1]
    return f"(item {first})" if first == last else f"(items {first} to {last})"


def _tasks_for(vehicle: ShownVehicle, tasks: Iterable[MissionTask]) -> list[MissionTask]:
    """Return the tasks of a plan as far as a vehicle may have to do with them."""
    camera = _camera(vehicle)
    kept = [each for each in tasks if not each.of_payload or camera is not None]
    return [_for_domain(each, vehicle.domain) for each in kept]


def _plan_of(vehicle: ShownVehicle, geometry: Mapping[str, Value]) -> UploadedPlan:
    """Return the plan that a geometry has; one without items, if it has none."""
    items, first = items_of(geometry)
    read = read_mission_tasks(mission_items(items[first:]))
    return UploadedPlan(items, _tasks_for(vehicle, read.tasks))


def _way_of(tasks: Iterable[MissionTask]) -> Route | None:
    """Return the places to which tasks lead; None: to none."""
    places = [place for each in tasks for place in each.places]
    return (
        Route.of([each for each, _ in places], [frame for _, frame in places]) if places else None
    )


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
        label = f"{task.behavior} {_numbers(task.items)}".strip()
        made.append(TaskOf(label, kind, resource, task.behavior, parameters))
    name = f"plan of {vehicle.resource}"
    source, data = tasks_in_a_row(name, made, geometries)
    named = {f"Task{number}": task for number, task in enumerate(tasks, start=1)}
    return MissionFiles(name, source), data, named
