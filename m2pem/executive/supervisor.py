"""The supervisor: drives every run of one executive, and routes what happens.

Reports of arbiters, faults of vehicles and geometries of operators become inputs of the runs that
they concern.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from m2pem.api.alerts import BATTERY_LOW, REQUIREMENT_VIOLATED, RUN_FAILED, AlertSeverity
from m2pem.api.allocation import SharedSpaceState
from m2pem.api.arbiter import BehaviorId, BehaviorReport
from m2pem.api.clock import Clock
from m2pem.api.epoch_fence import run_of
from m2pem.api.people import OperatorsChanged
from m2pem.api.runs import LEFT_ARMED, Alert, RunId
from m2pem.api.service import ServiceContext
from m2pem.api.telemetry import TeamState, Telemetry, VehicleState
from m2pem.bpmn.one_task import is_one_task
from m2pem.conformance.monitor import ConformanceMonitor
from m2pem.engine.inputs import GeometrySet, Input, MonitoredRequirement, ResourceFault
from m2pem.engine.records import (
    Record,
    RequirementDecided,
    RequirementVerdict,
    RunEnded,
    RunOutcome,
    WorkReassigned,
)
from m2pem.engine.run import STEPS_AT_ONCE, MissionRun
from m2pem.engine.state import OutOfReach, RunStatus
from m2pem.errors import (
    M2pemError,
    NotDrivenError,
    OperatorError,
    StaleCommandError,
    StaleEpochError,
)
from m2pem.executive.allocator import Allocator
from m2pem.executive.armed_vehicles import describe_armed_vehicles
from m2pem.executive.battery_forecast import BatteryForecast
from m2pem.executive.behavior_lifecycle import (
    AirspaceView,
    ExecutiveViews,
    availability_view,
    engine_view,
)
from m2pem.executive.behavior_reports import reported
from m2pem.executive.control_events import ControlEvents, RecordObservers
from m2pem.executive.control_release import ControlRelease
from m2pem.executive.control_requests import ControlRequests
from m2pem.executive.counts import RunCounts
from m2pem.executive.dispatcher import Dispatcher
from m2pem.executive.drawings import Drawings, own_geometries
from m2pem.executive.emergency import WRITTEN_WITHIN_S, EmergencyCommands, StopMarks
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.handover import Handover
from m2pem.executive.interrupted_runs import InterruptedRuns
from m2pem.executive.journal_loss import JournalLossPrompts
from m2pem.executive.lost_marks import LostMarks
from m2pem.executive.lost_resources import LostResources
from m2pem.executive.outages import OUTAGE_S, Outages, StallMonitor
from m2pem.executive.own_fences import OwnFences
from m2pem.executive.ownership import Ownership
from m2pem.executive.presence import Presence
from m2pem.executive.recovery import look_again, replaced_by
from m2pem.executive.returns import Returns, still_lost
from m2pem.executive.runner import OnRecords, RunContext, RunLimit, Runner
from m2pem.executive.separation import separation_for
from m2pem.executive.services import Services
from m2pem.executive.space_allocation import SpaceAllocation
from m2pem.executive.waiting_tasks import waiting_tasks
from m2pem.fleet.allocation import Availability, resources_of_mission
from m2pem.fleet.approval import is_named
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.space import waits_for_space
from m2pem.geo.fence import Fence
from m2pem.geo.geojson import GeometryError, as_geojson, parse_geojson
from m2pem.geo.positions import NO_ORIGIN, geometry_out_of_reach, positions
from m2pem.journal.base import Journal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Geometry, Point, Route
from m2pem.mission.losses import LINK_LOST
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.plugins import Plugins
from m2pem.suggestions import suggest
from m2pem.telemetry.bus import Bus

log = logging.getLogger("m2pem.executive")

REMEMBERED_RUNS = 100
"""Ended runs whose last state is kept in memory; the journal has them all."""


class LeftToOthersError(OperatorError):
    """This executive cannot start a mission, and another one on the journal may."""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How an executive drives its runs.

    `speed`: of the clock against the wall clock, kept in the journal for a resume. `search_path`:
    folders of processes that missions call. `limit`: see `RunLimit`. `on_records`: is called with
    the records of each run in their order, those of before a resume too, before their commands go
    out. `has_others`: says whether other executives are on the journal now; it blocks.
    """

    speed: float = 1.0
    search_path: tuple[Path, ...] = ()
    limit: RunLimit | None = None
    on_records: OnRecords | None = None
    has_others: Callable[[], bool] = lambda: False

    @property
    def steps_at_once(self) -> int:
        """Engine steps after which a run that does not wait lets others run."""
        return STEPS_AT_ONCE if self.limit is None else min(STEPS_AT_ONCE, self.limit.steps_at_once)


class Supervisor:
    """Every run of one executive. `runners`: the runs that it drives, and the last that ended.

    `RunStarter` and `RunTakeover` add runs. `observers`: the plugins that observe records; None:
    none is called.
    """

    def __init__(
        self,
        journal: Journal,
        plugins: Plugins,
        clock: Clock,
        arbiters: FleetArbiters,
        bus: Bus,
        events: ControlEvents,
        settings: RunSettings,
        *,
        observers: RecordObservers | None = None,
    ) -> None:
        self.fleet: Fleet = arbiters.fleet
        self.journal = journal
        self.plugins = plugins
        self.clock = clock
        self.arbiters = arbiters
        self.events = events
        self.settings = settings
        self.runners: dict[RunId, Runner] = {}
        self.drawings = Drawings(self.fleet, journal, clock.now_us)
        self.availability = Availability(self.fleet)
        self.counts = RunCounts()
        self._bus = bus
        self._observers = observers
        self.stalls = StallMonitor()
        outage_s = min(OUTAGE_S, self.fleet.max_outage_s or OUTAGE_S)
        self.outages = Outages(events, self.stalls, outage_s, settings.speed)
        self.outages.on_outage = self._look_at_all
        self._separation = separation_for(self.fleet, clock)
        self.marks = StopMarks(journal.file, journal.identity)
        self.interrupted = InterruptedRuns(self.marks)
        self._tasks: dict[RunId, asyncio.Task[None]] = {}
        self._left: StaleEpochError | None = None
        self._group: asyncio.TaskGroup | None = None
        self.ownership = Ownership(
            journal, self.stalls, self.runners, self.replaced, self._claim_unknown
        )
        self._own_fences = OwnFences(lambda: self.drawings.handed_over, bus)
        self.conformance = ConformanceMonitor(
            self.fleet,
            clock,
            bus.latest,
            self._fences_of,
            end=self._end,
            say=events.publish,
            deliver=self._deliver,
            stops_within_s=self._stops_within_s,
            speed=settings.speed,
        )
        self.dispatcher = Dispatcher(
            arbiters,
            self.availability,
            clock,
            self._geometry,
            self._post_report,
            self._refused,
            self.ownership,
            self._own_fences,
            self.conformance,
            self._separation,
        )
        self.allocator = Allocator(
            arbiters,
            self.availability,
            bus.latest,
            clock,
            self._geometry,
            self.runners,
            events.publish,
            self._space(),
        )
        self.availability.on_change = self._resources_changed
        self.on_change: Callable[[], None] = lambda: None
        """Is called when a run has ended, or when resources may be free."""
        self.on_alert: Callable[[Alert], None] = lambda alert: None
        """Takes an alert for the list alone: subscribers learn of it from the records."""
        self.served_by_another: Callable[[], Awaitable[str]] | None = None
        """Says which other executive may serve the fleet, or ""; None: none can."""
        self.emergency = EmergencyCommands(self.dispatcher, events, self.marks)
        self.handover = Handover(arbiters, self.availability)
        self.presence = Presence(clock.now_us, lambda: events.publish(OperatorsChanged()))
        self.control_requests = ControlRequests(
            arbiters.fleet,
            self.handover,
            clock,
            self.runners.values,
            self.presence.is_gone,
            events.publish,
            lambda: events.publish(OperatorsChanged()),
        )
        self.control_release = ControlRelease(
            arbiters.fleet, self.handover, self.control_requests, self.presence, events.publish
        )
        self.losses = JournalLossPrompts(
            journal,
            arbiters,
            self.dispatcher,
            self.availability,
            self.handover,
            events,
            self.runners,
        )
        self._returns = Returns(self.runners)
        self._lost_resources = LostResources(
            arbiters,
            self.availability,
            self.handover,
            clock,
            self.epoch_of,
            self._out_of_reach,
            self._why_not_served,
            bus,
            self._returns.returned,
            LostMarks(journal.file, journal.identity, self.fleet),
        )
        self._forecast = BatteryForecast(
            arbiters, self.availability, self._geometry, self.runners, self.fault
        )
        self._services = Services(
            plugins.service,
            ServiceContext(clock, bus, logging.getLogger("m2pem.service"), arbiters.detectors),
        )

    def _space(self) -> SpaceAllocation | None:
        """None: no task waits for space, nor for vehicles that it takes from others."""
        separation, fleet = self._separation, self.fleet
        if separation is None or not (fleet.preemption or waits_for_space(fleet)):
            return None
        return SpaceAllocation(separation)

    def shared_space(self) -> list[SharedSpaceState]:
        """Return who has places in the shared spaces of the fleet, and which tasks wait for one."""
        if self._separation is None:
            return []
        waiting = waiting_tasks(self.runners.values(), self.clock.now_us())
        return self._separation.shared_space(waiting)

    # --- life -----------------------------------------------------------------------------------

    def begin_tasks_in(self, group: asyncio.TaskGroup) -> None:
        """Say in which task group the runs are driven; the arbiters are connected."""
        self._group = group
        self._lost_resources.take_up(self.arbiters.resources)

    def refuse_unconnected(self) -> None:
        """Check that runs can be driven.

        Raises:
            LeftToOthersError: the runs are left to a standby.
            OperatorError: the arbiters are not connected yet.
        """
        if self._left is not None:
            raise LeftToOthersError(f"no run begins here any more: {self._left}")
        if self._group is None:
            raise OperatorError(
                "no run begins: the executive is not connected to its vehicles yet; try again in a "
                "few seconds"
            )

    async def stop_all(self, reason: str) -> None:
        """Stop what still runs and wait for it.

        A run whose journal failed stays held: it can be resumed.
        """
        for runner in self.runners.values():
            if not runner.done.is_set() and runner.run.state.status is not RunStatus.ENDED:
                self.emergency.stop(runner, "", reason)
        await asyncio.gather(*self._tasks.values())

    async def leave_runs(self, why: StaleEpochError) -> None:
        """Drive no run any more, from now on, and leave their vehicles as they are: another
        executive may take them up when this returns.

        What operators have asked for until then is recorded first, as the other executive knows of
        a STOP or pause by the journal; one that hangs is waited for `WRITTEN_WITHIN_S` at most.
        """
        self._left = why
        with suppress(TimeoutError):
            async with asyncio.timeout(WRITTEN_WITHIN_S):
                while asked := [each for one in self.runners.values() for each in one.undecided]:
                    await asyncio.wait(asked)
        for runner in self.runners.values():
            if not runner.done.is_set() or runner.failure is not None:  # that one is held
                self.replaced(runner.id, why)
        await asyncio.gather(*self._tasks.values())

    def seen(self, by: str) -> None:
        """An operator has commanded something, so is not gone."""
        self.presence.seen(by)
        self.control_requests.seen(by)

    async def end_calls(self) -> None:
        """Let go of lost resources, services and calls of arbiters, once every run has ended."""
        self.control_requests.close()
        self.allocator.close()
        self.conformance.close()
        await self._lost_resources.close()
        await self._services.close()
        await self.dispatcher.close()

    async def close(self) -> None:
        """Let the marks of stopped runs be written."""
        await self.marks.close()

    # --- starting and driving -------------------------------------------------------------------

    @property
    def fleet_now(self) -> Fleet:
        """The fleet, with the geometries that operators have handed over for all runs."""
        return replace(self.fleet, geometries={**self.fleet.geometries, **self.drawings.geometries})

    def geometries_given(self, mission: Mission, *, resumed: bool = False) -> list[GeometrySet]:
        """Return the inputs that hand over what operators have handed over for all runs.

        A geometry of the mission's own is not replaced by that. A run that is `resumed` has had
        what was handed over before this executive began.
        """
        drawings = self.drawings
        given = (drawings.given_here if resumed else drawings.handed_over).items()
        return [
            GeometrySet(name, dict(each.geometry), each.by)
            for name, each in given
            if name not in mission.geometries
        ]

    def add(self, run: MissionRun, epoch: int, monitors: RunMonitors | None = None) -> Runner:
        """Return the runner of a run that is to be driven. `epoch`: that of its claim. `monitors`:
        have read its records; None: it has none yet."""
        context = RunContext(
            self.journal,
            self.clock,
            self.dispatcher,
            self.allocator,
            self._services,
            self.events,
            self._observe,
            self.emergency.hold,
            self.stalls,
            self.outages,
            self._look_again,
            self.counts,
            self.settings.limit,
        )
        monitors = monitors or RunMonitors(run.state, self.fleet)
        runner = Runner(run, epoch, context, self.fleet.steps_between_waits, monitors)
        self.runners[runner.id] = runner
        return runner

    def take_up(self, runner: Runner) -> None:
        """Know which vehicles of a run that is taken up were lost before."""
        self._returns.take_up(runner)
        for name, was in still_lost(runner.run.state).items():
            self._lost_resources.lost_before(ResourceId(name), was.behavior, was.native_ref)

    def _look_at_all(self) -> None:
        for runner in self.runners.values():
            runner.wake()

    async def _look_again(
        self, runner: Runner, outage_s: float
    ) -> tuple[list[Input], frozenset[str]]:
        return await look_again(runner, self.arbiters, self.dispatcher, outage_s)

    def drive(self, runner: Runner) -> None:
        """Have a run decide its inputs from now on."""
        assert self._group is not None
        self._tasks[runner.id] = self._group.create_task(self._drive_and_release(runner))
        if self._left is not None:
            self.replaced(runner.id, self._left)

    async def forget(self, run: RunId) -> None:
        """Wait until the task of a run that failed to begin has ended; it is no run then."""
        await asyncio.wait([self._tasks[run]] if run in self._tasks else [])
        self.runners.pop(run, None)

    async def _drive_and_release(self, runner: Runner) -> None:
        await runner.drive()
        if isinstance(runner.failure, StaleEpochError):
            self.replaced(runner.id, runner.failure)
        self.allocator.let_go(runner.id)
        await self.journal.release(runner.id)
        del self._tasks[runner.id]
        mission, taken = runner.run.state.mission, self.handover.taken
        # Single commands come one after the other: each speaks of its own vehicle alone.
        single = resources_of_mission(mission, self.fleet) if is_one_task(mission) else None
        free = [
            each
            for each in self.fleet.vehicles.values()
            if (single is None or each.id in single)
            and each.id not in taken
            and not self._is_held_by_another(runner.id, each.id)
        ]
        may_be_armed = not (runner.replaced or self.fleet.simulated)
        if may_be_armed and (text := describe_armed_vehicles(free, self._bus)):
            self.events.publish(Alert(runner.id, LEFT_ARMED, text))
        self.on_change()
        over = [each for each in self.runners.values() if each.done.is_set()]
        for oldest in over[:-REMEMBERED_RUNS]:
            del self.runners[oldest.id]

    def _resources_changed(self) -> None:
        self.allocator.resources_changed()
        self.on_change()

    def _is_held_by_another(self, run: RunId, vehicle: ResourceId) -> bool:
        """A vehicle whose link was lost is held by the behavior that it had then."""
        holder = self.availability.holder(vehicle)
        return holder is not None and not holder.startswith(f"{run}.")

    def _observe(self, run: RunId, records: Sequence[Record]) -> None:
        self.losses.on_records(run, records)
        self.allocator.on_records(records)
        self._returns.on_records(run, records)
        if (runner := self.runners.get(run)) is not None:
            self.emergency.on_records(runner, records)
        for record in records:
            if type(record) is RequirementDecided:
                self._alert_of_violation(run, record)
            if isinstance(record, WorkReassigned) and record.code == LINK_LOST:
                for resource in map(ResourceId, record.excluded):
                    if not self.availability.reason(resource):
                        self.lost(resource, record.reason)  # its arbiter noticed it first
        if self.settings.on_records is not None:
            self.settings.on_records(run, records)
        if self._observers is not None:
            self._observers.put(run, records)
        for record in records[-3:]:
            if isinstance(record, RunEnded):
                self.counts.ended[record.outcome.value] += 1
                if record.outcome is RunOutcome.FAILED:
                    text = f"failed: {record.detail}" if record.detail else "failed"
                    self.on_alert(Alert(run, RUN_FAILED, text, AlertSeverity.ERROR))
                self.marks.remove(run)

    def _alert_of_violation(self, run: RunId, record: RequirementDecided) -> None:
        if record.verdict is RequirementVerdict.VIOLATED:
            text = f"requirement {record.requirement} is violated: {record.english.rstrip('.')}"
            if record.because:
                text = f"{text} ({record.because})"
            self.events.publish(Alert(run, REQUIREMENT_VIOLATED, text, AlertSeverity.ERROR))

    # --- what happens outside of the runs -------------------------------------------------------

    def _post_report(self, report: BehaviorReport) -> None:
        run = report.id.partition(".")[0]
        runner = self.runners.get(run)
        if runner is None:
            # After a restart an arbiter may report before its run is taken up, which then asks it.
            log.info("a report for %s, which no run here asked for", report.id)
            return
        report = self.conformance.concluded(report)
        runner.post(reported(report, runner.run.state.behaviors.get(report.id), self.arbiters))

    def on_report(self, report: BehaviorReport) -> None:
        """An arbiter reported what became of a behavior, or that another executive drives it."""
        runner = self.runners.get(run_of(report.id))
        if runner is not None and report.epoch > runner.epoch:
            self.replaced(runner.id, replaced_by(runner, report.epoch))
        elif (passed := self.conformance.reported(report)) is not None:
            self.dispatcher.reported(passed)

    def _stops_within_s(self, vehicle: ResourceId) -> float | None:
        if vehicle in self.handover.taken:
            return None
        return self.arbiters.of(vehicle).limits(vehicle).cancel_timeout_s

    def _deliver(self, report: BehaviorReport) -> None:
        self.dispatcher.reported(report)

    def _end(self, behavior: BehaviorId) -> None:
        """End a behavior whose vehicle deviates from it."""
        self.dispatcher.end(behavior, self.epoch_of(behavior))

    def _refused(self, error: StaleCommandError) -> None:
        if (runner := self.runners.get(error.run)) is not None and error.newest > runner.epoch:
            self.replaced(runner.id, replaced_by(runner, error.newest))

    def replaced(self, run: RunId, error: StaleEpochError) -> None:
        """Another executive drives a run: nothing more is commanded for it here, and nothing that
        its arbiters stream or repeat goes out any more."""
        runner = self.runners[run]
        if runner.replaced:
            return
        runner.replaced = True
        self.dispatcher.disown(run)
        runner.fail(error)
        text = (
            f"{error}. This executive commands nothing more for {run}; its vehicles do what the "
            f"other one commands. STOP of {run} here still holds them"
        )
        self.events.publish(Alert(run, "RUN_REPLACED", text, AlertSeverity.CRITICAL))

    def on_telemetry(self, state: Telemetry) -> None:
        """An arbiter published the state of a vehicle, payload or team."""
        if not isinstance(state, TeamState):
            self._lost_resources.on_telemetry(state)
            self._returns.on_telemetry(state)
            self._forecast.on_telemetry(state, self.clock.now_us())
            state = self._lost_resources.annotated(state)
        self._bus.publish(state)
        self.conformance.on_telemetry(state)
        if isinstance(state, VehicleState):
            self._measure(state.resource)
        self.allocator.on_telemetry()
        if self._separation is not None:
            self._separation.on_telemetry(state)

    def fault(self, fault: ResourceFault) -> None:
        """Post the fault of a vehicle or payload, or its lost link, to the runs that command it."""
        resource = ResourceId(fault.resource)
        if not fault.reachable and self._lost_resources.is_lost_since_before(resource):
            return
        about: dict[str, object] = {"resource": fault.resource}
        # The list of alerts has the lost link and the low battery as conditions, which end.
        about["unlisted"] = fault.code in (LINK_LOST, BATTERY_LOW)
        log.warning("%s: %s: %s", fault.resource, fault.code, fault.reason, extra=about)
        if not fault.reachable:
            self.lost(resource, fault.reason)
        with_team = self.arbiters.teams.fault(resource, fault.code, fault.reason)
        for runner in self.runners.values():
            if not with_team and fault.resource in runner.run.state.held:
                runner.post(fault)
                if not fault.reachable:
                    self._returns.faulted(fault.resource, runner.id)

    def _fences_of(self, vehicle: ResourceId) -> list[Fence]:
        """Where a vehicle may be: the fleet's fence, and its own."""
        fence = fence_of(self.fleet, self.fleet.vehicles[vehicle].domain)
        return [*([] if fence is None else [fence]), *self._own_fences.of(vehicle)]

    async def _why_not_served(self) -> str:
        await self.ownership.confirmed()
        return await self.served_by_another() if self.served_by_another is not None else ""

    def lost(self, resource: ResourceId, reason: str) -> None:
        """Keep a vehicle or payload from all runs until it returns and does nothing any more."""
        self._lost_resources.lost(resource, reason)
        self._measure(resource)
        if self._separation:
            self._separation.reservations.lost(resource)

    def _measure(self, resource: ResourceId) -> None:
        """Look at the conditions of requirements on a vehicle."""
        for runner in self.runners.values():
            runner.measure(resource, self._vehicle_state)

    def known_conditions(self, requirements: Sequence[MonitoredRequirement]) -> dict[str, bool]:
        """Return what telemetry says now of the conditions of requirements."""
        if not any(each.conditions for each in requirements):
            return {}
        # What reads formulas takes time to load, and most runs have no such conditions.
        from m2pem.monitors.telemetry_conditions import known  # noqa: PLC0415

        return known(requirements, self._vehicle_state)

    def _vehicle_state(self, resource: str) -> VehicleState | None:
        state = self._bus.latest(ResourceId(resource))
        return state if isinstance(state, VehicleState) else None

    def unavailable(self) -> dict[ResourceId, str]:
        """Why missions get some resources not now; also which were lost and are held."""
        found = {
            each: self.availability.reason(each) or self._lost_resources.shown(each)
            for each in self.arbiters.resources
        }
        return {each: why for each, why in found.items() if why}

    def _claim_unknown(self, run: RunId, error: M2pemError) -> None:
        """The journal cannot say whether this executive drives a run: hold what it commands."""
        self.dispatcher.bar(run)
        self.dispatcher.hold_all(run)
        self.runners[run].fail(error)

    def set_geometry(
        self, name: str, geometry: Mapping[str, Value], run: RunId | None, by: str
    ) -> None:
        """Make a route, area or point known to one run, or to all now and later.

        Raises:
            OperatorError: it is no geometry that m2pem knows.
        """
        said: list[str] = []
        try:
            parsed = parse_geojson(geometry, said.append)
        except GeometryError as error:
            raise OperatorError(f"geometry {name!r} {error}") from error
        origin = self.fleet.origin
        if origin != NO_ORIGIN and (wrong := geometry_out_of_reach(parsed, origin)):
            raise OperatorError(f"geometry {name!r}: {wrong[0]}; {wrong[1]}")
        geometry = as_geojson(parsed) if said else geometry
        fence = self.fleet.geometries.get(self.fleet.fence)
        if isinstance(fence, Area):
            kind = {Route: "waypoint", Area: "corner"}.get(type(parsed), "point")
            way = [each[:2] for each in positions(parsed)]
            said.append(Fence(fence).breach(way, name=lambda index: f"{kind} {index + 1}"))
        for each in filter(None, said):
            self.events.publish(Alert(run or RunId(""), "GEOMETRY", f"geometry {name!r}: {each}"))
        item = GeometrySet(name, dict(geometry), by)
        if run is None:
            self.drawings.change(name, geometry, by)
        if run is not None:
            runners = [self.runner(run)]
        else:
            every = self.runners.values()
            runners = [each for each in every if name not in each.run.state.mission.geometries]
        for runner in runners:
            if not runner.done.is_set():
                runner.post(item)

    def run_geometries(self) -> dict[RunId, dict[str, Route | Area | Point]]:
        """Return the geometries that runs under way have alone, by run and name."""
        handed_over, of_all = self.drawings.handed_over, self.fleet_now.geometries
        states = {
            run: each.run.state for run, each in self.runners.items() if not each.done.is_set()
        }
        own = {run: own_geometries(each, handed_over, of_all) for run, each in states.items()}
        return {run: geometries for run, geometries in own.items() if geometries}

    def delete_geometry(self, name: str, by: str) -> None:
        """Delete a geometry that was handed over for all runs; those under way keep it.

        Raises:
            OperatorError: none was handed over.
        """
        if name not in self.drawings.handed_over:
            known = list(self.drawings.handed_over)
            hint = suggest(name, known, "geometries") if known else "none is handed over"
            raise OperatorError(f"no operator has handed over a geometry {name!r}; {hint}")
        self.drawings.change(name, None, by)

    def geometry_users(self, name: str) -> list[RunId]:
        """Return the runs under way whose missions name a geometry that is not their own."""
        return [
            run
            for run, runner in self.runners.items()
            if not runner.done.is_set()
            and name not in runner.run.state.mission.geometries
            and is_named(name, [each.source for each in runner.run.state.mission.files()])
        ]

    def runner(self, run: RunId) -> Runner:
        """The runner of a run that is driven here.

        Raises:
            NotDrivenError: it is not.
        """
        runner = self.runners.get(run)
        if runner is None:
            self.interrupted.refuse_request(run)
            driven = [each for each, runner in self.runners.items() if not runner.done.is_set()]
            known = ", ".join(driven) or "none"
            raise NotDrivenError(f"{run} is not driven by this executive; it drives: {known}")
        return runner

    def views(self, behavior: BehaviorId, resources: Sequence[ResourceId]) -> ExecutiveViews:
        """Return what the owners of a behavior's state say of it now, whatever run it is of."""
        runner = self.runners.get(behavior.partition(".")[0])
        known = runner.run.state.behaviors.get(behavior) if runner is not None else None
        reserved = self._separation and self._separation.reservations.has_reserved(behavior)
        return ExecutiveViews(
            engine_view(known),
            self.dispatcher.view(behavior),
            availability_view(self.availability, behavior, resources),
            AirspaceView.RESERVED if reserved else AirspaceView.NONE,
        )

    def epoch_of(self, behavior: BehaviorId) -> int:
        """With which epoch the run of a behavior is driven here, or was when a resource was lost
        that may still do it; 0: neither."""
        runner = self.runners.get(behavior.partition(".")[0])
        return runner.epoch if runner is not None else self._lost_resources.epoch_before(behavior)

    def _out_of_reach(self, resource: ResourceId) -> OutOfReach | None:
        """What a resource does that is being lost, as far as runs know that are driven here."""
        holder = self.availability.holder(resource)
        states = [runner.run.state for runner in self.runners.values()]
        for state in states:
            if holder is not None and (behavior := state.behaviors.get(holder)) is not None:
                return OutOfReach(behavior.id, behavior.native_ref)
        return next((each.lost[resource] for each in states if resource in each.lost), None)

    def _geometry(self, run: str, name: str) -> Geometry | None:
        runner = self.runners.get(run)
        if runner is not None:
            if name in runner.run.state.geometries:
                return parse_geojson(runner.run.state.geometries[name])
            if name in runner.run.state.mission.geometries:
                return runner.run.state.mission.geometries[name]
        if name in self.drawings.handed_over:
            return parse_geojson(self.drawings.handed_over[name].geometry)
        return self.fleet.geometries.get(name)
