"""The executive: one fleet, its arbiters, and every run on them.

    async with Executive(fleet, journal, plugins, clock) as executive:
        run = await executive.control.start(Path("mission.bpmn"))
        summary = await executive.control.wait(run)

Leaving the block stops what still runs, waits until the vehicles are released, and closes all.
"""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Self

from m2pem.api.arbiter import Arbiter, ArbiterContext, BehaviorReport
from m2pem.api.authoring import MissionSource
from m2pem.api.clock import Clock
from m2pem.api.control import Alert, HandedOver, RunId, SimulationResult
from m2pem.api.service import ServiceContext
from m2pem.api.telemetry import TeamState
from m2pem.engine.inputs import GeometrySet, ResourceFault, StartRun, StopRun
from m2pem.engine.records import Record, RunEnded
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import RunStatus
from m2pem.errors import JournalError, NotDrivenError, OperatorError, PluginError
from m2pem.executive.armed_vehicles import left_armed
from m2pem.executive.behavior_reports import reported
from m2pem.executive.clock import SystemClock
from m2pem.executive.control import Control
from m2pem.executive.control_events import LoggedAlerts, Notices, Observers
from m2pem.executive.dispatcher import Dispatcher
from m2pem.executive.emergency import ImmediateCommands, StopMarks
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.handover import Handover, refuse_busy
from m2pem.executive.journal_loss import Losses
from m2pem.executive.loading import findings_for, known_data, load_source, refuse_errors
from m2pem.executive.lost_resources import Returning
from m2pem.executive.process_monitors import watch_space
from m2pem.executive.recovery import replay, take_over
from m2pem.executive.runner import Outside, Runner
from m2pem.executive.script import Script
from m2pem.executive.separation import clearance_for
from m2pem.executive.services import Services
from m2pem.executive.vehicle_locks import VehicleLocks, addresses_of
from m2pem.findings import Severity
from m2pem.fleet.allocation import Availability, spelled_out
from m2pem.fleet.fleet import Fleet, dump
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.geo.positions import NO_ORIGIN, geometry_out_of_reach
from m2pem.journal.base import Journal, RunHeader
from m2pem.journal.mission import mission_of
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Geometry
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.telemetry.bus import Bus
from m2pem.telemetry.link_monitor import LinkMonitor, monitor_links

log = logging.getLogger("m2pem.executive")

REMEMBERED_RUNS = 100
"""Runs that are over whose last state is kept in memory; the journal has them all."""

STEPS_AT_ONCE = 1_000
"""Engine steps after which a run that does not wait lets others run: STOP waits no longer."""


class Executive:
    """`simulated`: every arbiter is the simulated one, with `settings` for its connections.

    `speed`: of the clock against the wall clock, kept in the journal for a resume. `watch_links`:
    whether silence of a vehicle ends its behaviors. `max_steps` as in `Runner`. `observed`: whether
    plugins are told of records. `rehearse`: what `MissionControl.simulate` awaits.
    `search_path`: folders of processes that missions call.
    """

    def __init__(
        self,
        fleet: Fleet,
        journal: Journal,
        plugins: PluginManager,
        clock: Clock,
        *,
        simulated: bool = False,
        settings: Mapping[str, Any] | None = None,
        script: Script | None = None,
        speed: float = 1.0,
        watch_links: bool = True,
        max_steps: int | None = None,
        observed: bool = True,
        search_path: Sequence[Path] = (),
        rehearse: Callable[..., Awaitable[SimulationResult]] | None = None,
    ) -> None:
        self.fleet = fleet
        self.journal = journal
        self.plugins = plugins
        self.clock = clock
        self.simulated = simulated
        self.bus = Bus()
        self.notices = Notices()
        self.availability = Availability(fleet)
        self.runners: dict[RunId, Runner] = {}
        self.control = Control(self)
        self.rehearse = rehearse
        self.search_path = tuple(search_path)
        self._observers = Observers(plugins.records_committed, self.notices) if observed else None
        self._marks = StopMarks(journal.file, journal.identity)
        self._script = script
        self.speed = speed
        self._watch_links = watch_links
        self._max_steps = max_steps
        self.handed_over: dict[str, HandedOver] = {}
        self._tasks: dict[RunId, asyncio.Task[None]] = {}
        # Of two starts at once the second must see what the first one takes.
        self._starting = asyncio.Lock()
        self._listeners: list[asyncio.Task[None]] = []
        self._stack = AsyncExitStack()
        context = ArbiterContext(
            clock,
            self.bus,
            logging.getLogger("m2pem.arbiter"),
            fleet.origin,
            {team.name: spelled_out(team) for team in fleet.teams.values()},
            journal.identity,
            self._epoch_of,
        )
        self.arbiters = FleetArbiters(
            fleet, plugins, context, simulated=simulated, settings=settings
        )
        self._locks = VehicleLocks(addresses_of(self.arbiters, journal.file))
        self._clearance = clear = clearance_for(fleet, clock)
        told = self._geometry, self._post_report
        self.dispatcher = Dispatcher(self.arbiters, self.availability, clock, *told, script, clear)
        self.handover = Handover(self.arbiters, self.availability)
        self.immediate = ImmediateCommands(self.dispatcher, self.notices, self._marks)
        self.losses = Losses(self)
        self._returning = Returning(
            self.arbiters,
            self.availability,
            self.handover,
            clock,
            self._epoch_of,
            self.bus.publish,
        )
        self.services = Services(
            plugins.service,
            ServiceContext(
                clock, self.bus, logging.getLogger("m2pem.service"), self.arbiters.detectors
            ),
            script,
        )

    # --- life -----------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        """Connect the arbiters and listen to them.

        Raises:
            VehicleInUseError: another executive commands a vehicle of the fleet.
            PluginError: an arbiter cannot connect.
        """
        self._locks.acquire()
        try:
            await self._connect()
        except BaseException:
            self._locks.release()
            raise
        self._stack.enter_context(LoggedAlerts(self.notices))
        if self._observers is not None and isinstance(self.clock, SystemClock):
            self._observers.start()
        self._group = await self._stack.enter_async_context(asyncio.TaskGroup())
        for name, arbiter in self.arbiters.all.items():
            self._listen(f"reports of {name}", partial(self._read_reports, arbiter))
            self._listen(f"telemetry of {name}", partial(self._read_telemetry, arbiter))
        if self.journal.file is not None:
            watching = partial(watch_space, self.journal.file, self.notices)
            self._listen("watch of free space", watching)
        if self._watch_links:
            # On a fast clock our own hesitation would look like the silence of a vehicle.
            stretch = max(1.0, self.speed)
            bounds = {
                vehicle.id: stretch
                * (
                    vehicle.lost_after_s
                    or self.arbiters.of(vehicle.id).limits(vehicle.id).lost_after_s
                )
                for vehicle in self.fleet.vehicles.values()
            }
            rules = LinkMonitor(bounds, self.clock.now_us())
            self._listen(
                "link monitor", partial(monitor_links, self.bus, self.clock, self._fault, rules)
            )
        return self

    async def _connect(self) -> None:
        connected: list[Arbiter] = []
        for name, arbiter in self.arbiters.all.items():
            try:
                await arbiter.connect()
            except Exception as error:
                for other in connected:
                    await other.close()
                raise PluginError(f"arbiter {name} cannot connect: {error}") from error
            connected.append(arbiter)

    async def __aexit__(self, *reason: object) -> None:
        """Stop every run, let its vehicles be released, close the arbiters."""
        try:
            await self.stop_all("the executive is shutting down")
            await self._returning.close()
            await self.services.close()
            await self.dispatcher.close()
        finally:
            for listener in self._listeners:
                listener.cancel()
            for arbiter in self.arbiters.all.values():
                await arbiter.close()
            self._locks.release()
            if self._observers is not None:
                await self._observers.close()
            await self._marks.close()
            self.bus.close()
            self.notices.end()
            await self._stack.aclose()

    def stop_at_once(self, by: str, reason: str) -> dict[RunId, "asyncio.Future[Step]"]:
        """Send the cancels of every run that has not ended; by run: when its stop is recorded.

        A run that the journal failed is one of them: its vehicles are held, or were to be.
        """
        return {
            runner.id: self.immediate.stop(runner, by, reason)
            for runner in self.runners.values()
            if not runner.done.is_set() or runner.failure is not None
            if runner.run.state.status is not RunStatus.ENDED
        }

    async def stop_all(self, reason: str) -> None:
        """Stop what still runs and wait for it. What is held because its journal failed stays held:
        it can be resumed."""
        for runner in self.runners.values():
            if not runner.done.is_set() and runner.run.state.status is not RunStatus.ENDED:
                self.immediate.stop(runner, "", reason)
        await asyncio.gather(*self._tasks.values())

    def _listen(self, what: str, listening: Callable[[], Awaitable[None]]) -> None:
        async def listen() -> None:
            try:
                await listening()
            except Exception:  # a broken arbiter must not end the executive; its links will age
                log.exception("%s broke off", what)

        self._listeners.append(self._group.create_task(listen(), name=what))

    async def _read_reports(self, arbiter: Arbiter) -> None:
        async for report in arbiter.reports():
            self.dispatcher.reported(report)

    async def _read_telemetry(self, arbiter: Arbiter) -> None:
        async for state in arbiter.telemetry():
            if not isinstance(state, TeamState):
                self._returning.heard(state)
                state = self._returning.shown(state)  # noqa: PLW2901
            self.bus.publish(state)
            if self._clearance is not None:
                self._clearance.heard(state)

    # --- runs -----------------------------------------------------------------------------------

    def load(
        self,
        mission: MissionSource,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
    ) -> tuple[Mission, str]:
        """Read and check a mission; returns it with the id of the process to begin with.

        Raises:
            MissionError: with every finding.
        """
        loaded = load_source(mission, self.search_path)
        return loaded, self.admit(loaded, process, data)

    @property
    def fleet_now(self) -> Fleet:
        """The fleet, with what operators have handed over for all runs."""
        given = {name: parse_geojson(each.geometry) for name, each in self.handed_over.items()}
        return replace(self.fleet, geometries={**self.fleet.geometries, **given})

    def admit(self, loaded: Mission, process: str | None, data: Mapping[str, Value] | None) -> str:
        """Check a mission; returns the id of the process to begin with.

        Raises:
            MissionError: with every finding.
        """
        findings = findings_for(
            loaded,
            self.arbiters,
            self.plugins,
            known_data(data),
            process,
            simulated=self.simulated,
            handed_over=self.handed_over,
        )
        refuse_errors(f"{loaded.file} cannot run with fleet {self.fleet.file}", findings)
        return loaded.process(process).id

    async def start(
        self,
        mission: MissionSource,
        process: str | None,
        data: Mapping[str, Value] | None,
        by: str,
        *,
        even_if_busy: bool = False,
    ) -> RunId:
        """Begin a run. Returns when its first records are durable.

        Raises:
            MissionError: with every finding.
            BusyError: other runs or operators have what it names, unless `even_if_busy`.
        """
        # Reading and checking take a while, and a URL may take longer: not in the event loop.
        loaded, process_id = await asyncio.to_thread(self.load, mission, process, data)
        if even_if_busy:
            return await self.begin(loaded, process_id, data, by)
        async with self._starting:
            ended = RunStatus.ENDED
            over = {run for run, one in self.runners.items() if one.run.state.status is ended}
            taken, holder = self.handover.taken, self.availability.holder
            refuse_busy(loaded, self.fleet, taken, holder, over)
            return await self.begin(loaded, process_id, data, by)

    async def begin(
        self, loaded: Mission, process_id: str, data: Mapping[str, Value] | None, by: str
    ) -> RunId:
        """Begin a run of a mission that was admitted. Returns when its beginning is durable."""
        header = RunHeader(
            loaded.file,
            loaded.source,
            process_id,
            dump(self.fleet),
            self.simulated,
            self.speed,
            self.clock.now_us() if self.speed == 1.0 else time.time_ns() // 1000,
            loaded.library,
        )
        number = await self.journal.create(header)
        batch = min(STEPS_AT_ONCE, self._max_steps or STEPS_AT_ONCE)
        runner = self._runner(MissionRun(loaded, self.fleet, number, batch), 1)
        begun = runner.tell(StartRun(process_id, dict(data or {}), by, self.handover.by_name()))
        for name, given in self.handed_over.items():
            runner.post(GeometrySet(name, dict(given.geometry), given.by))
        self._drive(runner)
        await begun
        return number

    async def resume(self, number: RunId) -> None:
        """Take up a run that its executive left without ending it.

        Raises:
            JournalError: there is no such run, or an executive that is alive drives it.
            OperatorError: it has ended.
        """
        lines = {line.run: line for line in await self.journal.runs()}
        line = lines.get(number)
        if line is None:
            known = ", ".join(lines) or "none"
            raise JournalError(f"there is no run {number}; the journal has: {known}")
        if line.loss is not None and not line.loss.resumable:
            raise OperatorError(f"{number}: {line.loss}. {line.loss.remedy(number)}")
        if line.outcome is not None:
            raise OperatorError(f"{number} has ended: {line.outcome.value}")
        if line.last_seq == 0:
            raise OperatorError(f"{number} never began: start its mission again")
        epoch = await self.journal.claim(number)
        mission = mission_of(line.header)
        for finding in mission.warnings:
            if finding.severity is Severity.ERROR:
                log.warning(
                    "%s goes on as it was begun, but would not begin now: %s", number, finding
                )
        run = MissionRun(mission, self.fleet, number, STEPS_AT_ONCE)
        last_us = await replay(self.journal, run, self._script)
        runner = self._runner(run, epoch)
        self.handover.take_up(run.state.taken)
        outage_s = max(0.0, (self.clock.now_us() - last_us) / 1_000_000)
        mark = self._marks.get(number)
        if mark is not None:
            log.warning("%s was stopped before its executive ended; it stays stopped", number)
            runner.tell_stop(StopRun(mark.by, mark.reason), frozenset())
        await take_over(runner, self.arbiters, self.dispatcher, outage_s, self._lost, line.loss)
        if line.loss is not None:
            await self.losses.ask(runner, line.loss)
        self._drive(runner)

    def _runner(self, run: MissionRun, epoch: int) -> Runner:
        outside = Outside(
            self.journal, self.clock, self.dispatcher, self.services, self.notices, self._observe
        )
        bound = self.fleet.steps_between_waits
        runner = Runner(run, epoch, outside, self._max_steps, bound)
        self.runners[runner.id] = runner
        return runner

    def _drive(self, runner: Runner) -> None:
        self._tasks[runner.id] = self._group.create_task(self._drive_and_release(runner))

    async def _drive_and_release(self, runner: Runner) -> None:
        await runner.drive()
        await self.journal.release(runner.id)
        del self._tasks[runner.id]
        every, taken = self.fleet.vehicles.values(), self.handover.taken
        free = [
            each
            for each in every
            if each.id not in taken and not self._is_held_by_another(runner.id, each.id)
        ]
        if not self.simulated and (text := left_armed(free, self.bus)):
            self.notices.publish(Alert(runner.id, "LEFT_ARMED", text))
        over = [each for each in self.runners.values() if each.done.is_set()]
        for oldest in over[:-REMEMBERED_RUNS]:
            del self.runners[oldest.id]

    def _is_held_by_another(self, run: RunId, vehicle: ResourceId) -> bool:
        """A vehicle whose link was lost is held by the behavior that it had then."""
        holder = self.availability.holder(vehicle)
        return holder is not None and not holder.startswith(f"{run}.")

    def _observe(self, run: RunId, records: Sequence[Record]) -> None:
        self.losses.seen(run, records)
        if self._script is not None:
            self._script.seen(run, records)
        if self._observers is not None:
            self._observers.put(run, records)
        if any(isinstance(record, RunEnded) for record in records[-3:]):
            self._marks.remove(run)

    # --- what happens outside -------------------------------------------------------------------

    def _post_report(self, report: BehaviorReport) -> None:
        run = report.id.partition(".")[0]
        runner = self.runners.get(run)
        if runner is None:
            # After a restart an arbiter may report before its run is taken up, which then asks it.
            log.info("a report for %s, which no run here asked for", report.id)
            return
        runner.post(reported(report, runner.run.state.behaviors.get(report.id), self.arbiters))

    def _fault(self, fault: ResourceFault) -> None:
        log.warning("%s: %s: %s", fault.resource, fault.code, fault.reason)
        resource = ResourceId(fault.resource)
        if not fault.reachable:
            self._lost(resource, fault.reason)
        with_team = self.arbiters.teams.fault(resource, fault.code, fault.reason)
        for runner in self.runners.values():
            if not with_team and fault.resource in runner.run.state.held:
                runner.post(fault)

    def _lost(self, resource: ResourceId, reason: str) -> None:
        self._returning.lost(resource, reason)
        if self._clearance:
            self._clearance.airspace.lost(resource)

    def set_geometry(
        self, name: str, geometry: Mapping[str, Value], run: RunId | None, by: str
    ) -> None:
        """Make a route, area or point known to one run, or to all now and later.

        Raises:
            OperatorError: it is no geometry that m2pem knows.
        """
        try:
            parsed = parse_geojson(geometry)
        except GeometryError as error:
            raise OperatorError(f"geometry {name!r} {error}") from error
        origin = self.fleet.origin
        if origin != NO_ORIGIN and (wrong := geometry_out_of_reach(parsed, origin)):
            raise OperatorError(f"geometry {name!r}: {wrong[0]}; {wrong[1]}")
        item = GeometrySet(name, dict(geometry), by)
        if run is None:
            self.handed_over[name] = HandedOver(dict(geometry), by, self.clock.now_us())
        for runner in self.runners.values() if run is None else [self.runner(run)]:
            if not runner.done.is_set():
                runner.post(item)

    def runner(self, run: RunId) -> Runner:
        """The runner of a run that is driven here.

        Raises:
            NotDrivenError: it is not.
        """
        runner = self.runners.get(run)
        if runner is None:
            known = ", ".join(self.runners) or "none"
            raise NotDrivenError(f"{run} is not driven by this executive; it drives: {known}")
        return runner

    def _epoch_of(self, behavior: str) -> int:
        runner = self.runners.get(behavior.partition(".")[0])
        return runner.epoch if runner is not None else 0

    def _geometry(self, run: str, name: str) -> Geometry | None:
        runner = self.runners.get(run)
        given = runner.run.state.geometries.get(name) if runner is not None else None
        if given is None and name in self.handed_over:
            given = dict(self.handed_over[name].geometry)
        return self.fleet.geometries.get(name) if given is None else parse_geojson(given)
