"""The executive: one fleet, the connections to its vehicles, and every run on them.

    async with Executive(fleet, journal, plugins, clock) as executive:
        run = await executive.control.start(Path("mission.bpmn"))
        summary = await executive.control.wait(run)

Leaving the block stops what still runs, waits until the vehicles are released, and closes all.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from typing import Self

from m2pem.api.arbiter import ArbiterContext, BehaviorId, BehaviorReport
from m2pem.api.clock import Clock, SystemClock
from m2pem.api.runs import RunId
from m2pem.errors import FleetServedError, JournalError, M2pemError
from m2pem.executive.alert_conditions import AlertConditions
from m2pem.executive.alert_list import AlertList
from m2pem.executive.alert_watch import keep_alerts, watch_alerts, write_alerts
from m2pem.executive.control import Control
from m2pem.executive.control_events import ControlEvents, LoggedAlerts, RecordObservers
from m2pem.executive.fleet_connections import FleetArbiters, FleetConnections
from m2pem.executive.health import ExecutiveHealth
from m2pem.executive.incidents import Foresee
from m2pem.executive.mission_control.parts import Estimate, Rehearse
from m2pem.executive.process_monitors import watch_space
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.run_takeover import RunTakeover
from m2pem.executive.runner import OnRecords, RunLimit, Runner
from m2pem.executive.schedule_entries import ScheduleEntries
from m2pem.executive.scheduled_runs import ScheduledRuns
from m2pem.executive.scheduler import Scheduler
from m2pem.executive.shared_space_watch import watch_shared_space
from m2pem.executive.statistics import StatisticsReader
from m2pem.executive.supervisor import RunSettings, Supervisor
from m2pem.executive.switchover import Switchover
from m2pem.executive.vehicle_locks import VehicleInUseError, VehicleLocks, addresses_of, refusal
from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Journal
from m2pem.journal.fleet_server import FleetServer
from m2pem.mission.catalogue import BehaviorState
from m2pem.plugins import Plugins
from m2pem.telemetry.bus import Bus
from m2pem.telemetry.link_monitor import LinkMonitor, monitor_links

log = logging.getLogger("m2pem.executive")


class Executive:
    """Connects the parts of an executive: fleet connections, supervisor, monitors and control.

    `speed`: of the clock against the wall clock, kept in the journal for a resume. `watch_links`:
    whether silence of a vehicle ends its behaviors. `observed`: whether plugins observe records.
    `search_path`, `limit`, `on_records`, `has_others`: as in `RunSettings`. `rehearse`: what
    `MissionControl.simulate` awaits; None: it is refused. `foresee`: what explores the choices
    about incidents; None: what follows them is not known. `estimate`: what
    `MissionControl.estimate` asks; None: it is refused. `page`: the address of its web page, for
    operators of other executives.
    """

    def __init__(
        self,
        fleet: Fleet,
        journal: Journal,
        plugins: Plugins,
        clock: Clock,
        *,
        speed: float = 1.0,
        watch_links: bool = True,
        observed: bool = True,
        search_path: Sequence[Path] = (),
        limit: RunLimit | None = None,
        on_records: OnRecords | None = None,
        rehearse: Rehearse | None = None,
        foresee: Foresee | None = None,
        estimate: Estimate | None = None,
        has_others: Callable[[], bool] = lambda: False,
        page: str = "",
    ) -> None:
        self.fleet = fleet
        self.journal = journal
        self.clock = clock
        self.bus = Bus()
        self.events = ControlEvents()
        self.alerts = AlertList(fleet.kept_as, journal, clock.now_us)
        self.events.on_alert = self.alerts.add
        self.arbiters = FleetArbiters(
            fleet,
            plugins,
            ArbiterContext(
                clock,
                self.bus,
                logging.getLogger("m2pem.arbiter"),
                fleet.origin,
                {team.name: spelled_out(team) for team in fleet.teams.values()},
                journal.identity,
                self._epoch_of,
                self._may_send,
                None if journal.file is None else journal.file.parent,
            ),
        )
        self._observers = (
            RecordObservers(plugins.records_committed, self.events) if observed else None
        )
        self.supervisor = Supervisor(
            journal,
            plugins,
            clock,
            self.arbiters,
            self.bus,
            self.events,
            RunSettings(speed, tuple(search_path), limit, on_records, has_others),
            observers=self._observers,
        )
        self.supervisor.on_alert = self.alerts.add
        self._conditions = AlertConditions(self.supervisor, self.bus, lambda: self._links)
        self._connections = FleetConnections(
            self.arbiters, self._on_report, self.supervisor.on_telemetry
        )
        self.stalls = self.supervisor.stalls
        self.ownership = self.supervisor.ownership
        self.health = ExecutiveHealth(journal)
        self.starter = RunStarter(self.supervisor)
        self._takeover = RunTakeover(self.supervisor)
        scheduled = ScheduledRuns(self.supervisor, self.starter, self.bus)
        self._schedule = ScheduleEntries(
            scheduled,
            self.events.publish,
            self.supervisor.marks,
            real=not self.arbiters.nothing_is_real,
        )
        self._scheduler = Scheduler(scheduled, self._schedule)
        self.supervisor.on_change = self._schedule.changed.set
        self.superseded = asyncio.Event()
        """Set when another executive serves the fleet, or is to: this one must end."""
        self.switchover = Switchover(self.supervisor, self.superseded)
        self.control = Control(
            self.supervisor,
            self.starter,
            self.bus,
            self.health,
            self._schedule,
            self._scheduler,
            self.switchover,
            self.alerts,
            StatisticsReader(
                self.supervisor, self.bus, self._observers, clock, lambda: self._links
            ),
            rehearse,
            foresee,
            estimate,
        )
        self._scheduling: asyncio.Task[None] | None = None
        self._locks = VehicleLocks(addresses_of(self.arbiters), journal.file, page)
        if journal.lease_s is not None and self._locks.resources:
            self.supervisor.served_by_another = self._served_by_another
        self._speed = speed
        self._watch_links = watch_links
        self._links: LinkMonitor | None = None
        self._listeners: list[asyncio.Task[None]] = []
        self._stack = AsyncExitStack()

    # --- life -----------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        """Connect the arbiters and listen to them.

        Raises:
            VehicleInUseError: another executive commands a vehicle of the fleet.
            PluginError: an arbiter cannot connect.
        """
        await self._serve_fleet()
        await self._load_alerts()
        await self._load_drawings()
        try:
            self._locks.acquire()
            await self._connections.connect()
        except BaseException:
            self._locks.release()
            raise
        self.health.connected = True
        self._stack.enter_context(LoggedAlerts(self.events))
        if self._observers is not None and isinstance(self.clock, SystemClock):
            self._observers.start()
        group = await self._stack.enter_async_context(asyncio.TaskGroup())
        self.supervisor.begin_tasks_in(group)
        for what, listening in self._connections.listeners():
            self._listen(group, what, listening)
        if isinstance(self.clock, SystemClock):
            self._listen(group, "watch of stalls", self.stalls.watch)
            self._listen(group, "watch of the runs' claims", self.ownership.watch)
            if self.journal.lease_s is not None and self._locks.resources:
                self._listen(group, "watch of who serves the fleet", self._watch_fleet)
        if isinstance(self.clock, SystemClock):
            publish = self.events.publish
            self._listen(group, "alerts", partial(watch_alerts, self.alerts, self.look, publish))
            self._listen(
                group,
                "journal of alerts",
                partial(keep_alerts, self.alerts, self.superseded.is_set),
            )
        if self.journal.file is not None:
            watching = partial(watch_space, self.journal.file, self.events)
            self._listen(group, "watch of free space", watching)
        if self.supervisor.fleet.shared_space and isinstance(self.clock, SystemClock):
            spaces, publish = self.supervisor.shared_space, self.events.publish
            watching = partial(watch_shared_space, self.clock, spaces, publish)
            self._listen(group, "watch of shared space", watching)
        if self._watch_links:
            # On a fast clock a delay of this process would look like the silence of a vehicle.
            bounds_s = self._connections.lost_after_s(max(1.0, self._speed))
            self._links = rules = LinkMonitor(bounds_s, self.clock.now_us())
            monitoring = partial(
                monitor_links,
                self.bus,
                self.clock,
                self.supervisor.fault,
                rules,
                self._left_to_another,
            )
            self._listen(group, "link monitor", monitoring)
        return self

    async def __aexit__(self, *reason: object) -> None:
        """Stop every run, let its vehicles be released, close the arbiters."""
        try:
            if self._scheduling is not None:
                self._scheduling.cancel()
                await asyncio.wait([self._scheduling])
            await self.stop_all("the executive is shutting down")
            await self.supervisor.end_calls()
        finally:
            for listener in self._listeners:
                listener.cancel()
            self.health.connected = False
            await self._connections.close()
            self.health.close()
            # As long as no other executive can have read the list.
            if not self.superseded.is_set():
                await write_alerts(self.alerts)
            self._locks.release()
            if self._observers is not None:
                await self._observers.close()
            await self.supervisor.close()
            self.bus.close()
            self.events.end()
            await self._stack.aclose()

    def look(self) -> None:
        """Raise and clear alerts by what is so now; on the clock of the system it is done twice a
        second."""
        self.alerts.update(self._conditions.now(), self._conditions.undecided)

    async def _load_alerts(self) -> None:
        try:
            await self.alerts.load()
        except JournalError as error:  # what matters more needs the journal, too, and says so
            log.warning("who has acknowledged which alert is not known: %s", error)

    async def _load_drawings(self) -> None:
        try:
            await self.supervisor.drawings.load()
        except JournalError as error:  # what matters more needs the journal, too, and says so
            log.warning("which geometries operators have handed over is not known: %s", error)

    async def _serve_fleet(self) -> None:
        """Let no other executive on the journal command the vehicles, until it is closed; those
        that exist in this process alone need it not.

        Raises:
            VehicleInUseError: another one serves the fleet.
        """
        if not self._locks.resources:
            return
        try:
            await self._locks.serve(self.journal, self.fleet)
        except FleetServedError as error:
            commanded = self._locks.resources
            server = await self.journal.fleet_server(self.fleet.name, commanded) or FleetServer()
            why = refusal(server, str(self.journal.file or ""))
            raise VehicleInUseError(f"{', '.join(commanded)}: {why}") from error

    async def _watch_fleet(self) -> None:
        """Serve the fleet again after the lease had ended, or leave it to a standby if runs were
        held meanwhile; end when another executive serves it."""
        assert self.journal.lease_s is not None
        while not self.superseded.is_set():
            await asyncio.sleep(self.journal.lease_s / 3)
            if not await self._served_by_another():
                try:
                    await self.switchover.journal_is_back()
                except JournalError as error:
                    log.info("who stands by is not known: %s", error)

    async def _served_by_another(self) -> str:
        """Serve the fleet again, if its lease had ended; else return why it is not served here."""
        try:
            await self._locks.serve(self.journal, self.fleet)
        except FleetServedError as error:
            # Before anyone stops the runs: a STOP would be sent to vehicles of the other one.
            await self.ownership.ask()
            if not self.superseded.is_set():
                log.error("%s; this executive commands no vehicle any more", error)
                self.superseded.set()
            return str(error)
        except JournalError as error:
            log.info("who serves %s is not known: %s", self.fleet.name, error)
            return f"who serves {self.fleet.name} is not known: {error}"
        return ""

    async def _on_report(self, report: BehaviorReport) -> None:
        if report.state is BehaviorState.LOST and await self._left_to_another():
            return
        self.supervisor.on_report(report)

    async def _left_to_another(self) -> bool:
        """A link is being lost. Returns whether the runs are left to another executive, as nothing
        is received here any more."""
        links = self._links
        if links is None:
            return False
        return await self.switchover.link_lost(lambda: links.receives_nothing(self.clock.now_us()))

    def announce_schedule(self) -> None:
        """Say that missions can be scheduled soon: `load_schedule` and `serve_schedule` follow."""
        self._schedule.is_beginning = True

    async def load_schedule(self) -> None:
        """Read what the journal has scheduled for this fleet, before runs are taken up.

        Runs that were created for the schedule, and never began, are deleted: their times count
        again.

        Raises:
            JournalError: the schedule cannot be read or written.
        """
        await self._schedule.load()

    def serve_schedule(self) -> None:
        """Start what is scheduled, from now on, once interrupted runs are taken up."""
        self._schedule.served, self._schedule.is_beginning = True, False
        self._scheduling = asyncio.create_task(self._scheduler.serve(), name="schedule")
        self._scheduling.add_done_callback(self._schedule_ended)

    def _schedule_ended(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("the schedule broke off; nothing more starts by it", exc_info=error)
            self.health.broke_off("schedule")

    def _listen(
        self, group: asyncio.TaskGroup, what: str, listening: Callable[[], Awaitable[None]]
    ) -> None:
        async def listen() -> None:
            try:
                await listening()
            except Exception:  # a broken arbiter must not end the executive; its links will age
                log.exception("%s broke off", what)
                self.health.broke_off(what)

        self._listeners.append(group.create_task(listen(), name=what))

    def _epoch_of(self, behavior: BehaviorId) -> int:
        return self.supervisor.epoch_of(behavior)

    def _may_send(self) -> bool:
        return self.ownership.may_send()

    # --- runs -----------------------------------------------------------------------------------

    @property
    def runners(self) -> Mapping[RunId, Runner]:
        """The runs that this executive drives, and the last that ended."""
        return self.supervisor.runners

    def runner(self, run: RunId) -> Runner:
        """The runner of a run; raises NotDrivenError when it is not driven here."""
        return self.supervisor.runner(run)

    async def resume_all(self, runs: Sequence[RunId]) -> Mapping[RunId, M2pemError]:
        """Take up runs that their executive left without ending them; returns why some are not."""
        return await self._takeover.resume(runs)

    async def resume(self, run: RunId) -> None:
        """Take up one run.

        Raises:
            JournalError: there is no such run, or an executive that is alive drives it.
            OperatorError: it has ended, or the arbiters are not connected yet.
        """
        for error in (await self.resume_all([run])).values():
            raise error

    async def stop_all(self, reason: str) -> None:
        """Stop what still runs and wait for it."""
        await self.supervisor.stop_all(reason)
