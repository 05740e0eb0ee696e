"""`MissionControl` over an executive: what OCUs, scripts and the command line call."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from m2pem.api.alerts import OperatorAlert
from m2pem.api.allocation import (
    SharedSpaceState,
    StartPreview,
    TakeEffect,
    WaitingTask,
)
from m2pem.api.approval import MissionApproval
from m2pem.api.authoring import (
    DEFAULT_LIMITS,
    Draft,
    Editable,
    MissionSource,
    Outline,
    SearchLimits,
    SearchProgress,
)
from m2pem.api.control import ControlEvent
from m2pem.api.estimates import MissionEstimate
from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.people import MAX_NOTE_CHARACTERS, OpenControlRequest, OperatorPresence
from m2pem.api.runs import (
    GeometryVersion,
    HandedOver,
    IncidentPreview,
    IncidentVerdict,
    OpenIncident,
    OpenPrompt,
    RunId,
    RunSummary,
    SimulationResult,
    StampedRecord,
    stamped_records,
)
from m2pem.api.schedule import WHEN_FREE, EntryId, Schedule, When
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.api.telemetry import Telemetry
from m2pem.bpmn.search_path import mission_files_in
from m2pem.editing.editable import editable
from m2pem.editing.outline import outline
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import (
    MissionError,
    OperatorError,
    StuckError,
)
from m2pem.executive.alert_list import AlertList
from m2pem.executive.direct_behaviors import DirectBehaviors
from m2pem.executive.ended_runs import explain_end, in_words, refuse_ended
from m2pem.executive.handover import UNNAMED_OPERATOR
from m2pem.executive.health import ExecutiveHealth
from m2pem.executive.incidents import Foresee, IncidentChoices, open_incidents
from m2pem.executive.journal_loss import PROMPT as LOSS_PROMPT
from m2pem.executive.journal_loss import unknown_decision
from m2pem.executive.loading import library_of, load_source
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.run_summary import summary
from m2pem.executive.schedule_admission import planned
from m2pem.executive.schedule_entries import ScheduleEntries
from m2pem.executive.scheduler import Scheduler
from m2pem.executive.statistics import StatisticsReader
from m2pem.executive.supervisor import Supervisor
from m2pem.executive.switchover import Switchover
from m2pem.executive.verification_worker import verify_in_subprocess
from m2pem.executive.waiting_tasks import holder_label, waiting_tasks
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.operator_roles import why_not_allowed
from m2pem.journal.mission import mission_of
from m2pem.journal.standbys import standbys_of
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.events import Signal
from m2pem.mission.geometry import Area, Point, Route
from m2pem.mission.mission import Mission
from m2pem.mission.values import MAX_DEPTH, Value, is_too_deep
from m2pem.telemetry.bus import Bus

MANY_RUNS = 500
"""From so many on, a thread makes the summaries of runs."""


class Rehearse(Protocol):
    """Rehearses missions for an executive, with the options of `MissionControl.simulate`."""

    async def __call__(
        self, mission: MissionSource, fleet: Fleet, *, search_path: Sequence[Path], **options: Any
    ) -> SimulationResult:
        """Rehearse a mission with a fleet. `search_path`: folders of processes that it calls."""
        ...


Estimate: TypeAlias = Callable[[Mission, Fleet, str | None], MissionEstimate]
"""Estimates what a mission takes with a fleet, from the start of a process; None: its main one."""


class Control:
    """Implements `m2pem.api.control.MissionControl`; see there for every promise."""

    def __init__(
        self,
        supervisor: Supervisor,
        starter: RunStarter,
        bus: Bus,
        health: ExecutiveHealth,
        schedule: ScheduleEntries,
        scheduler: Scheduler,
        switchover: Switchover,
        alerts: AlertList,
        statistics: StatisticsReader,
        rehearse: Rehearse | None = None,
        foresee: Foresee | None = None,
        estimate: Estimate | None = None,
    ) -> None:
        self._supervisor = supervisor
        self._starter = starter
        self._schedule = schedule
        self._scheduler = scheduler
        self._switchover = switchover
        self._alerts = alerts
        self._bus = bus
        self._health = health
        self._statistics = statistics
        self._rehearse = rehearse
        self._estimate = estimate
        self._choices = IncidentChoices(supervisor, foresee)
        self._direct = DirectBehaviors(supervisor, starter)

    # --- runs -----------------------------------------------------------------------------------

    async def start(
        self,
        mission: MissionSource | Mission,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
        even_if_busy: bool = False,
    ) -> RunId:
        """Start a mission, also one that was loaded; returns when the journal has its beginning."""
        return await self._starter.start(
            mission, process, _bounded(data), by, even_if_busy=even_if_busy
        )

    async def execute_behavior(
        self,
        resource: str,
        behavior: str,
        parameters: Mapping[str, Value] | None = None,
        *,
        by: str = "",
    ) -> RunId:
        """Command one behavior from outside of a mission."""
        self._supervisor.seen(by)
        return await self._direct.execute(resource, behavior, _bounded(parameters) or {}, by)

    async def missions(self) -> Sequence[str]:
        """The mission files of the search path, the working folder and `missions` in it."""
        here = Path.cwd()
        folders = (*self._supervisor.settings.search_path, here, here / "missions")
        return [str(path) for path in await asyncio.to_thread(mission_files_in, folders)]

    async def preview_start(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> StartPreview:
        """What a start would begin with now, and what speaks against it."""
        return await self._starter.preview(mission, process, tuple(data))

    # --- approvals ------------------------------------------------------------------------------

    async def approval(self, mission: MissionSource) -> MissionApproval:
        """Who has approved a mission, and who must before it may start."""
        loaded = await self._starter.read(mission)
        return await self._starter.approvals.state(loaded.file, loaded.source, loaded.library)

    async def approve(
        self, mission: MissionSource, *, digest: str = "", by: str = ""
    ) -> MissionApproval:
        """Approve a mission."""
        loaded = await self._starter.read(mission)
        approvals = self._starter.approvals
        return await approvals.approve(loaded.file, loaded.source, loaded.library, by, digest)

    async def withdraw_approval(self, mission: MissionSource, *, by: str = "") -> MissionApproval:
        """Withdraw an approval of a mission."""
        loaded = await self._starter.read(mission)
        approvals = self._starter.approvals
        return await approvals.withdraw(loaded.file, loaded.source, loaded.library, by)

    async def note_edit(self, digest: str, *, by: str = "") -> None:
        """Note who has made a file what it is."""
        await self._starter.approvals.note_edit(digest, by)

    # --- ending runs ----------------------------------------------------------------------------

    async def stop(self, run: RunId, *, by: str = "", reason: str = "") -> None:
        """End every token, cancel every behavior."""
        emergency, interrupted = self._supervisor.emergency, self._supervisor.interrupted
        if run not in self._supervisor.runners and interrupted.stop(run, by, reason):
            return
        async with self._explain_end("stop", run):
            asked = emergency.stop(self._supervisor.runner(run), by, reason)
            self._schedule.run_stopping(run, by)
            await emergency.written("stop", {run: asked})

    async def stop_all(self, *, by: str = "", reason: str = "") -> Sequence[RunId]:
        """Stop every run that has not ended, and hold the schedule."""
        asked = self._supervisor.emergency.stop_all(self._supervisor.runners.values(), by, reason)
        interrupted = self._supervisor.interrupted.stop_all(by, reason)
        hold = self._schedule.hold_at_once(by, f"STOP of all{f': {reason}' if reason else ''}")
        await self._supervisor.emergency.written("stop", asked)
        if hold is not None:
            await self._schedule.written(hold)
        return list(dict.fromkeys((*asked, *interrupted)))

    async def switch_over(self, *, by: str = "") -> ExecutiveAddress:
        """Leave every run, as it is, to the executive that stands by, and end."""
        return await self._switchover.ask(by)

    # --- the schedule ---------------------------------------------------------------------------

    async def schedule(
        self,
        mission: MissionSource,
        *,
        when: When = WHEN_FREE,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        priority: int = 0,
        by: str = "",
    ) -> EntryId:
        """Have a mission started later."""
        if not self._schedule.served:
            raise OperatorError(
                "this executive starts no scheduled missions: `m2pem serve` is one that does"
            )
        holds, known = self._schedule.holds, self._schedule.by_id
        plan, resources = await planned(
            self._supervisor,
            self._starter,
            known,
            mission,
            when,
            process,
            _bounded(data),
            priority,
            by,
        )
        return await self._schedule.schedule(plan, resources, holds)

    async def scheduled(self) -> Schedule:
        """What starts when, and what it waits for."""
        return self._schedule.view()

    async def unschedule(self, entry: EntryId, *, by: str = "") -> None:
        """Cancel an entry."""
        await self._schedule.cancel(entry, by)

    async def start_scheduled(self, entry: EntryId, *, by: str = "") -> RunId:
        """Start the mission of an entry now."""
        return await self._scheduler.start(entry, by)

    async def hold_schedule(
        self, entry: EntryId | None = None, *, by: str = "", reason: str = ""
    ) -> None:
        """Let an entry, or the whole schedule, start nothing until it is released."""
        await self._schedule.hold(entry, by, reason)

    async def release_schedule(self, entry: EntryId | None = None, *, by: str = "") -> None:
        """Let an entry, or the whole schedule, start missions again."""
        await self._schedule.release(entry, by)

    # --- what operators do in runs --------------------------------------------------------------

    async def pause(self, run: RunId, *, by: str = "") -> None:
        """Hold every commanded resource and freeze timers."""
        emergency = self._supervisor.emergency
        async with self._explain_end("pause", run):
            asked = emergency.pause(self._supervisor.runner(run), by)
            await emergency.written("pause", {run: asked})

    async def resume(self, run: RunId, *, by: str = "") -> None:
        """Go on after a pause."""
        await self._ask("resume", run, i.ResumeRun(by))

    async def signal(
        self,
        signal: str,
        *,
        run: RunId | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
    ) -> None:
        """Emit a signal to one run or to all that are active."""
        given = _bounded(data)
        if run is not None:
            async with self._explain_end("signal", run):
                refuse_ended(self._supervisor.runner(run))
        runners = (
            [self._supervisor.runner(run)]
            if run is not None
            else [
                runner
                for runner in self._supervisor.runners.values()
                if runner.run.state.status is not EngineStatus.ENDED
            ]
        )
        known = [(runner, runner.run.state.mission.signals) for runner in runners]
        meant = [(runner, _named(signal, signals)) for runner, signals in known]
        if not any(ids for _, ids in meant):
            there = {each.id: each.name for _, signals in known for each in signals.values()}
            listed = (
                ", ".join(f"{name} ({key})" if name else key for key, name in there.items())
                or "none"
            )
            raise OperatorError(
                f"{run or 'no run'} has {'no' if run else 'a'} signal {signal!r}; known: {listed}"
            )
        for runner, ids in meant:
            if len(ids) > 1:
                raise OperatorError(
                    f"{runner.id} has several signals named {signal!r}; say which: {', '.join(ids)}"
                )
        for runner, ids in meant:
            for key in ids:
                await self._ask("signal", runner.id, i.SignalReceived(key, given, by))

    async def message(
        self, message: str, *, run: RunId, data: Mapping[str, Value] | None = None, by: str = ""
    ) -> None:
        """Send a message."""
        await self._ask("message", run, i.MessageReceived(message, _bounded(data), by))

    async def answer(self, run: RunId, prompt: str, decision: str, *, by: str = "") -> None:
        """Answer a prompt; the first answer wins."""
        if prompt == LOSS_PROMPT and self._supervisor.losses.is_open(run):
            match decision:
                case "go_on":
                    await self.resume(run, by=by)
                case "stop":
                    await self.stop(run, by=by, reason="the journal has lost records")
                case _:
                    raise unknown_decision(decision)
            return
        runner = self._supervisor.runners.get(run)
        asked = runner.prompts.get(prompt) if runner is not None else None
        if asked is not None:
            self._refuse_others(f"{run}: {prompt}", asked.role, by)
        await self._ask("answer", run, i.PromptAnswer(prompt, decision, by))

    async def set_geometry(
        self, name: str, geometry: Mapping[str, Value], *, run: RunId | None = None, by: str = ""
    ) -> None:
        """Hand over a route, area or point (GeoJSON)."""
        given = _bounded(geometry)
        if run is None:
            self._supervisor.set_geometry(name, given, None, by)
            await self._supervisor.drawings.write(f"{name} is handed over")
            return
        async with self._explain_end("set_geometry", run):
            refuse_ended(self._supervisor.runner(run))
            self._supervisor.set_geometry(name, given, run, by)

    async def delete_geometry(self, name: str, *, by: str = "") -> None:
        """Delete a geometry that was handed over for all runs."""
        self._supervisor.delete_geometry(name, by)
        await self._supervisor.drawings.write(f"{name} is deleted")

    async def geometry_versions(self, name: str) -> Sequence[GeometryVersion]:
        """The versions of a geometry that were handed over for all runs."""
        return self._supervisor.drawings.versions(name)

    async def geometry_users(self, name: str) -> Sequence[RunId]:
        """The runs under way whose missions name a geometry that is not their own."""
        return self._supervisor.geometry_users(name)

    async def take(self, resource: str, *, by: str = "") -> None:
        """Take a vehicle or payload from the missions."""
        self._supervisor.seen(by)
        await self._direct.take(resource, by)

    async def preview_take(self, resource: str) -> Sequence[TakeEffect]:
        """What `take` of a resource would end now."""
        return self._supervisor.handover.preview(resource, self._supervisor.runners.values())

    async def give_back(self, resource: str, *, reason: str = "", by: str = "") -> None:
        """Give it back to the missions."""
        self._supervisor.seen(by)
        await self._supervisor.control_release.give_back(
            resource, by, reason, self._supervisor.runners.values()
        )

    async def request_control(self, resource: str, *, by: str = "") -> None:
        """Ask the operator who has a vehicle or payload for it."""
        self._supervisor.seen(by)
        await self._supervisor.control_requests.ask(resource, by)

    async def answer_control(self, resource: str, *, give: bool, by: str = "") -> None:
        """Give a vehicle or payload to the operator who asks for it, or refuse."""
        self._supervisor.seen(by)
        await self._supervisor.control_requests.answer(resource, by, give=give)

    async def control_requests(self) -> Sequence[OpenControlRequest]:
        """Who asks whom for which vehicle or payload."""
        return self._supervisor.control_requests.all()

    async def announce_presence(
        self,
        client: str,
        *,
        unit: str,
        role: str = "",
        run: RunId = "",
        page: str = "",
        editing: str = "",
        by: str = "",
    ) -> None:
        """An operator is present at a unit."""
        name = by or UNNAMED_OPERATOR
        presence = OperatorPresence(name, unit, role, run, page, editing=editing)
        self._supervisor.presence.announce(client, presence)

    async def end_presence(self, client: str) -> None:
        """An operator is not present at a unit any more."""
        self._supervisor.presence.leave(client)

    async def operators(self) -> Sequence[OperatorPresence]:
        """Who is present."""
        return self._supervisor.presence.present()

    async def add_note(self, run: RunId, text: str, *, by: str = "") -> None:
        """Write a note into a run's log."""
        note = text.strip()
        if not note or len(note) > MAX_NOTE_CHARACTERS:
            raise OperatorError(
                f"a note has 1 to {MAX_NOTE_CHARACTERS} characters, and this one {len(note)}"
            )
        await self._ask("note", run, i.OperatorNoted(note, by or UNNAMED_OPERATOR))

    async def holders(self) -> Mapping[ResourceId, str]:
        """Who has each resource."""
        return self._supervisor.handover.holders()

    async def holder_labels(self) -> Mapping[str, str]:
        """The task and run of each behavior and request that has a resource, by its id."""
        supervisor = self._supervisor
        holders = supervisor.handover.holders().values()
        labels = {holder: holder_label(supervisor.runners, holder) for holder in holders}
        return {holder: label for holder, label in labels.items() if label}

    async def unavailable(self) -> Mapping[ResourceId, str]:
        """Why missions get some resources not now, by resource; see `MissionControl`."""
        return self._supervisor.unavailable()

    async def waiting(self) -> Sequence[WaitingTask]:
        """The tasks of all runs that wait for vehicles or payloads."""
        supervisor = self._supervisor
        return waiting_tasks(supervisor.runners.values(), supervisor.clock.now_us())

    async def shared_space(self) -> Sequence[SharedSpaceState]:
        """Who has places in the shared spaces of the fleet file, and who waits for one."""
        return self._supervisor.shared_space()

    async def incidents(self) -> Sequence[OpenIncident]:
        """The incidents of all runs that are open."""
        return open_incidents(self._supervisor.runners.values(), self._supervisor.fleet)

    async def preview_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
    ) -> IncidentPreview:
        """Whether the mission still completes after a choice about an incident."""
        async with self._explain_end("preview_incident", run):
            refuse_ended(self._supervisor.runner(run))
            item = self._choices.checked(run, incident, choice, _bounded(data), to, roles or {})
        return await self._choices.outlook(run, item)

    async def resolve_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
        by: str = "",
        even_if_stuck: bool = False,
    ) -> None:
        """Decide about an incident."""
        async with self._explain_end("resolve_incident", run):
            refuse_ended(self._supervisor.runner(run))
            item = self._choices.checked(run, incident, choice, _bounded(data), to, roles or {}, by)
            known = self._supervisor.runner(run).run.state.incidents[item.incident]
            self._refuse_others(item.incident, known.operator_role, by)
        ends_or_stays = item.choice in (i.IncidentChoice.END, i.IncidentChoice.SET_DATA)
        if not (even_if_stuck or ends_or_stays):
            preview = await self._choices.outlook(run, item)
            if preview.verdict is IncidentVerdict.CANNOT_COMPLETE:
                raise StuckError(f"{run}: {choice} was not done: {preview}")
        await self._ask("resolve_incident", run, item)

    async def alerts(self, *, over: bool = False) -> Sequence[OperatorAlert]:
        """The alerts that are open; with `over`, also those that are over."""
        return self._alerts.alerts(over=over)

    async def acknowledge_alert(self, alert: str, *, by: str = "") -> None:
        """Note that an operator has seen an alert."""
        await self._alerts.acknowledge(alert, by)

    async def own_alert(self, alert: str, *, owner: str | None = None, by: str = "") -> None:
        """Note who takes care of an alert."""
        await self._alerts.own(alert, by if owner is None else owner)

    def _refuse_others(self, what: str, role: str, by: str) -> None:
        """Check that an operator has the role of those who decide about something.

        Raises:
            OperatorError: the fleet file says who has it: others.
        """
        if refusal := why_not_allowed(self._supervisor.fleet, role, by):
            raise OperatorError(f"{what}: {refusal}")

    async def _ask(self, request: str, run: RunId, item: i.Input) -> None:
        """Have an input decided; one that the engine ignored is the operator's to know.

        What came during a pause is decided with the resume, and may be ignored then: after it.
        """
        async with self._explain_end(request, run):
            match (await self._supervisor.runner(run).submit(item)).records:
                case [r.InputIgnored(reason), *_]:
                    raise OperatorError(f"{run}: {in_words(item, reason)}")

    def _explain_end(self, request: str, run: RunId) -> AbstractAsyncContextManager[None]:
        return explain_end(request, run, self._supervisor.runners, self._supervisor.journal)

    # --- watching -------------------------------------------------------------------------------

    def subscribe(
        self, run: RunId | None = None, size: int = 10_000
    ) -> AsyncIterator[ControlEvent]:
        """What is committed from now on, and first the prompts that are open."""
        subscription = self._supervisor.events.subscribe(run, size)
        subscription.put(self.prompts())
        return subscription

    def telemetry(self, size: int = 100) -> AsyncIterator[Telemetry]:
        """Telemetry from now on."""
        return self._bus.subscribe(size)

    async def records(
        self, run: RunId, after_seq: int = 0, limit: int = 1000
    ) -> Sequence[StampedRecord]:
        """A page of a run's records; it ends with those of an input, so it may be longer."""
        page: list[StampedRecord] = []
        async for entry in self._supervisor.journal.read(run, after_seq):
            page += stamped_records(run, entry.seq, entry.t_us / 1_000_000, entry.records)
            if len(page) >= limit:
                break
        return page

    async def runs(self) -> Sequence[RunSummary]:
        """Every run of the journal but those that it has lost whole."""
        lines = await self._supervisor.journal.runs(files=False)

        def summaries() -> list[RunSummary]:
            return [summary(line) for line in lines if not line.gone]

        # Of ten thousand runs it would keep the event loop for a while.
        return summaries() if len(lines) < MANY_RUNS else await asyncio.to_thread(summaries)

    def prompts(self) -> Sequence[OpenPrompt]:
        """The prompts that are open."""
        return [
            prompt
            for runner in self._supervisor.runners.values()
            for prompt in runner.prompts.values()
        ]

    async def mission(self, run: RunId) -> Mission:
        """The mission of a run, of an older one from the journal."""
        runner = self._supervisor.runners.get(run)
        if runner is not None:
            return runner.run.state.mission
        for line in await self._supervisor.journal.runs():
            if line.run == run:
                if line.gone:
                    raise OperatorError(f"{run}: {line.loss}")
                return await asyncio.to_thread(mission_of, line.header)
        raise OperatorError(f"the journal has no run {run}")

    async def mission_time_s(self, run: RunId) -> float:
        """Seconds from the start of a run."""
        state = self._supervisor.runner(run).run.state
        if state.status is EngineStatus.ENDED:
            raise OperatorError(f"{run} has ended")
        return max(0, state.mission_time_us(self._supervisor.clock.now_us())) / 1_000_000

    async def wait(self, run: RunId) -> RunSummary:
        """Wait until the run has ended and its vehicles are released."""
        runner = self._supervisor.runner(run)
        await runner.done.wait()
        if runner.failure is not None:
            raise runner.failure
        lines = {line.run: line for line in await self._supervisor.journal.runs()}
        return summary(lines[run])

    # --- what there is --------------------------------------------------------------------------

    def fleet(self) -> Fleet:
        """The fleet in use."""
        return self._supervisor.fleet

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """What every resource can do."""
        return self._supervisor.arbiters.catalogue()

    def simulated(self) -> bool:
        """Whether nothing real moves."""
        return self._supervisor.arbiters.nothing_is_real

    def speed(self) -> float:
        """Seconds of mission time in a real second."""
        return self._supervisor.settings.speed

    def journal_file(self) -> Path | None:
        """Where the journal is; None: in memory."""
        return self._supervisor.journal.file

    async def health(self) -> Sequence[HealthCheck]:
        """Whether this executive can do its work now."""
        return await self._health.checks()

    async def statistics(self) -> ExecutiveStatistics:
        """What the executive has counted since it began, and what there is now."""
        return self._statistics.read()

    async def standbys(self) -> Sequence[ExecutiveAddress]:
        """The executives that stand by for the fleet of this one."""
        found = await standbys_of(self._supervisor.journal, self._supervisor.fleet.name)
        return [ExecutiveAddress(each.host, each.pid, each.page) for each in found]

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        """All findings of `m2pem check` for a mission and the fleet in use."""
        try:
            loaded = load_source(mission, self._supervisor.settings.search_path)
        except MissionError as error:
            return error.findings
        return self._starter.findings(loaded, process, tuple(data))

    def estimate(self, mission: MissionSource, *, process: str | None = None) -> MissionEstimate:
        """What a mission takes as it is drawn, of each vehicle of the fleet in use."""
        if self._estimate is None:
            raise OperatorError("this executive cannot estimate missions")
        loaded = load_source(mission, self._supervisor.settings.search_path)
        return self._estimate(loaded, self._supervisor.fleet_now, process)

    async def simulate(self, mission: MissionSource, **options: Any) -> SimulationResult:
        """Rehearse a mission with this fleet on a virtual clock."""
        supervisor = self._supervisor
        if self._rehearse is None:
            raise OperatorError("this executive cannot rehearse missions")
        settings = {"search_path": supervisor.settings.search_path, **options}
        return await self._rehearse(mission, supervisor.fleet_now, **settings)

    async def verify(
        self,
        mission: MissionSource,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        spec: str | None = None,
        strict: bool = False,
        timers_in_order: bool = False,
        limits: SearchLimits = DEFAULT_LIMITS,
        on_progress: Callable[[SearchProgress], None] | None = None,
    ) -> Mapping[str, Any]:
        """Verify a mission with this fleet, in a process of its own."""
        supervisor = self._supervisor
        return await verify_in_subprocess(
            mission,
            supervisor.fleet_now,
            search_path=supervisor.settings.search_path,
            process=process,
            data=data or {},
            spec=spec,
            strict=strict,
            timers_in_order=timers_in_order,
            limits=limits,
            on_progress=on_progress,
        )

    def editable(self, mission: bytes, *, anew: bool = False) -> Editable:
        """The same mission as an editor takes it."""
        return editable(mission, anew=anew)

    def outline(self, mission: bytes | Draft) -> Outline:
        """What a file has, as far as it can be read."""
        draft = mission if isinstance(mission, Draft) else Draft(Path("mission.bpmn"), mission)
        library = library_of(mission, self._supervisor.settings.search_path)
        return outline(draft.source, library, self.services())

    def geometries(self) -> Mapping[str, HandedOver]:
        """What operators have handed over for all runs."""
        return self._supervisor.drawings.handed_over

    def run_geometries(self) -> Mapping[RunId, Mapping[str, Route | Area | Point]]:
        """The routes, areas and points that runs under way have alone."""
        return self._supervisor.run_geometries()

    def services(self) -> Mapping[str, Sequence[str]]:
        """The service-task classes that there are, with what each writes."""
        return self._supervisor.plugins.service_writes()


def _bounded(data: Mapping[str, Value] | None) -> dict[str, Value]:
    """Data from context, not nested deeper than the engine and the journal can take."""
    for name, value in (data or {}).items():
        if is_too_deep(value, MAX_DEPTH - 1):
            raise OperatorError(f"{name!r} is nested deeper than {MAX_DEPTH} levels")
    return dict(data or {})


def _named(name: str, signals: Mapping[str, Signal]) -> list[str]:
    """The ids of the signals that a name, or an id, may mean."""
    if name in signals:
        return [name]
    return [key for key, signal in signals.items() if name and signal.name == name]
