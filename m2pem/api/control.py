"""MissionControl: the one interface of the executive for operators, scripts and OCU plugins."""

from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, Union

from m2pem.api.alerts import AlertsChanged, OperatorAlert
from m2pem.api.allocation import (
    SharedSpaceChanged,
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
from m2pem.api.estimates import MissionEstimate
from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.people import OpenControlRequest, OperatorPresence, OperatorsChanged
from m2pem.api.runs import (
    Alert,
    GeometryVersion,
    HandedOver,
    IncidentPreview,
    OpenIncident,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunSummary,
    SimulationResult,
    StampedRecord,
)
from m2pem.api.schedule import WHEN_FREE, EntryId, Schedule, ScheduleChanged, When
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.api.telemetry import Telemetry
from m2pem.findings import Finding
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.values import Value

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.geometry import Area, Point, Route
    from m2pem.mission.mission import Mission

ControlEvent: TypeAlias = Union[
    StampedRecord,
    OpenPrompt,
    PromptClosed,
    Alert,
    AlertsChanged,
    ScheduleChanged,
    SharedSpaceChanged,
    OperatorsChanged,
]
"""What a subscriber gets: records and prompts in order, after they were committed, alerts and
changes of the schedule at once, those of shared space within a second."""


class MissionControl(Protocol):
    """Every OCU, the command line and the web page use this, and nothing else of the executive.

    `by` names who asked, and is journaled. Requests that cannot be met raise
    `m2pem.errors.OperatorError` and change nothing.
    """

    async def start(
        self,
        mission: MissionSource,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
        even_if_busy: bool = False,
    ) -> RunId:
        """Start a mission.

        `even_if_busy`: an operator has confirmed that it starts although other runs or operators
        have vehicles or payloads that it names.

        Raises:
            MissionError: with every finding, when it is not well or does not fit the fleet.
            BusyError: they have some, and that was not confirmed; it says who has what.
            NotApprovedError: the fleet asks for approvals, and persons must give them before.
        """
        ...

    async def approval(self, mission: MissionSource) -> MissionApproval:
        """Who has approved a mission, and who must before it may start (docs/approval.md).

        Raises:
            MissionError: it cannot be read.
        """
        ...

    async def approve(
        self, mission: MissionSource, *, digest: str = "", by: str = ""
    ) -> MissionApproval:
        """Approve exactly this content of a mission: its file, those that it calls or imports, and
        the routes, areas and points that they name. Returns its approvals then. `digest`: of the
        content that `by` has looked at; another one is not approved.

        Raises:
            MissionError: it cannot be read.
            OperatorError: the fleet asks for no approvals, or `by` may not approve this mission.
        """
        ...

    async def withdraw_approval(self, mission: MissionSource, *, by: str = "") -> MissionApproval:
        """Withdraw the approval of a mission that `by` has given. What runs goes on.

        Raises:
            MissionError: it cannot be read.
            OperatorError: `by` has not approved it.
        """
        ...

    async def note_edit(self, digest: str, *, by: str = "") -> None:
        """Note who has made a file of a mission what it is, where the fleet asks for approvals.

        `digest`: the SHA-256 of the file, in hexadecimal. Editors call it before they save.
        """
        ...

    async def execute_behavior(
        self,
        resource: str,
        behavior: str,
        parameters: Mapping[str, Value] | None = None,
        *,
        by: str = "",
    ) -> RunId:
        """Command one behavior on one vehicle or payload, from outside of a mission.

        It is a run of its own, with a mission of one task: `wait` and `subscribe` follow it, `stop`
        ends it. A resource that `by` has taken (`take`) stays taken. In place of what `by` had it
        do by an earlier call, which is stopped first. `parameters`: as in a mission file, texts
        with units or names of geometries, numbers in SI, lists `[latitude, longitude]`; also
        GeoJSON objects.

        Raises:
            MissionError: the resource cannot do it, or a parameter is wrong.
            BusyError: a run, or another operator, has the resource.
            OperatorError: the fleet has no such resource; or a later call for it came, while this
                one waited until the resource had stopped.
        """
        ...

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
        """Have a mission started later: at a time, by cron, after a run, when a condition holds,
        or as soon as its vehicles are free. The journal has the entry, with the mission's files,
        when this returns.

        `priority`: of entries that wait for the same vehicles, that with the greatest starts first,
        then that which was due first.

        Raises:
            MissionError: with every finding, when it is not well or does not fit the fleet.
            ScheduleError: `when` makes no sense; or the fleet has real vehicles, and its file does
                not say that they may start unattended.
            OperatorError: this executive does not serve a schedule.
        """
        ...

    async def scheduled(self) -> Schedule:
        """The schedule of this executive's fleet: what starts when, and what it waits for."""
        ...

    async def unschedule(self, entry: EntryId, *, by: str = "") -> None:
        """Cancel an entry: it starts nothing any more. A run that it has started goes on."""
        ...

    async def start_scheduled(self, entry: EntryId, *, by: str = "") -> RunId:
        """Start the mission of an entry now, whatever it waits for; no operator is warned.

        It stands for the time of the entry that has come, or for its only one. Times of cron that
        are to come stay.

        Raises:
            MissionError: with every finding, when it does not fit the fleet any more.
            BusyError: runs or operators have its vehicles; it says who has what.
            OperatorError: there is no such entry, it is over, or held, or its last run goes on.
        """
        ...

    async def hold_schedule(
        self, entry: EntryId | None = None, *, by: str = "", reason: str = ""
    ) -> None:
        """Let an entry, or (None) the whole schedule, start nothing until it is released.

        It acts at once, whatever the journal does. Times that come meanwhile are missed when their
        starting deadline passes.

        Raises:
            OperatorError: there is no such entry, or the journal has not written the hold within
                1.5 s.
        """
        ...

    async def release_schedule(self, entry: EntryId | None = None, *, by: str = "") -> None:
        """Let an entry, or (None) the whole schedule, start missions again."""
        ...

    async def missions(self) -> Sequence[str]:
        """The paths of the mission files that are found where the executive runs.

        They are in the folders of its search path, in its working folder, and in `missions` there.
        """
        ...

    async def preview_start(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> StartPreview:
        """What `start` of a mission would begin with now, and what speaks against it.

        `data`: names that are given at start. Operators see this before they start a mission.
        """
        ...

    async def stop(self, run: RunId, *, by: str = "", reason: str = "") -> None:
        """End every token, cancel every behavior.

        The cancels go to the arbiters at once, before the run decides and whatever the journal
        does. Until the run has decided it, it starts no behavior any more.

        Raises:
            OperatorError: the run has ended; or the cancels are sent, and the journal has not
                written the stop within 1.5 s.
        """
        ...

    async def stop_all(self, *, by: str = "", reason: str = "") -> Sequence[RunId]:
        """Stop every run that has not ended, as `stop` does; returns them.

        The schedule, if it has entries, is held from then on until an operator releases it.

        Raises:
            OperatorError: as for `stop`; names each run concerned. The others are stopped.
        """
        ...

    async def switch_over(self, *, by: str = "") -> ExecutiveAddress:
        """Leave every run, as it is, to the executive that stands by, and end; returns which one.

        Vehicles go on with what they do. The standby takes the runs up as those of an executive
        that was killed.

        Raises:
            OperatorError: no executive stands by. Nothing has changed then.
            JournalError: the journal cannot say which one does.
        """
        ...

    async def pause(self, run: RunId, *, by: str = "") -> None:
        """Hold every commanded resource and freeze timers.

        The holds go to the arbiters at once, as the cancels of `stop` do; errors as there.
        """
        ...

    async def resume(self, run: RunId, *, by: str = "") -> None:
        """Go on after a pause."""
        ...

    async def signal(
        self,
        signal: str,
        *,
        run: RunId | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
    ) -> None:
        """Emit a signal, by its id or its name, to one run or (None) to all that have it."""
        ...

    async def message(
        self, message: str, *, run: RunId, data: Mapping[str, Value] | None = None, by: str = ""
    ) -> None:
        """Send a message, by its id."""
        ...

    async def answer(self, run: RunId, prompt: str, decision: str, *, by: str = "") -> None:
        """Answer a prompt. The first answer wins; a later one raises OperatorError, and so does one
        of an operator who has not the role of the prompt, where the fleet file says who has it."""
        ...

    async def set_geometry(
        self, name: str, geometry: Mapping[str, Value], *, run: RunId | None = None, by: str = ""
    ) -> None:
        """Hand over a route, area or point (GeoJSON), to one run or to all, now and later.

        What is for all runs is kept in the journal, with its former versions.

        Raises:
            OperatorError: it is no geometry; or it is handed over, and the journal has not written
                it within 1.5 s.
        """
        ...

    async def delete_geometry(self, name: str, *, by: str = "") -> None:
        """Delete a geometry that was handed over for all runs: later runs get that of the fleet
        file, if it has one. Runs under way keep it. Its versions are kept.

        Raises:
            OperatorError: no operator has handed it over; or as for `set_geometry`.
        """
        ...

    async def geometry_versions(self, name: str) -> Sequence[GeometryVersion]:
        """The versions of a geometry that were handed over for all runs, the newest last."""
        ...

    async def geometry_users(self, name: str) -> Sequence[RunId]:
        """The runs under way whose missions name a geometry that is not their own.

        Operators see them before they hand over another one of that name.
        """
        ...

    async def take(self, resource: str, *, by: str = "") -> None:
        """Take a vehicle or payload from the missions, to steer it by hand.

        What it was doing ends with error TAKEN_OVER; until it is given back no behavior gets it.
        """
        ...

    async def preview_take(self, resource: str) -> Sequence[TakeEffect]:
        """What `take` of a resource would end now, and whether the missions handle it.

        Empty: no run commands it. Operators see this before they take anything.
        """
        ...

    async def give_back(self, resource: str, *, reason: str = "", by: str = "") -> None:
        """Give it back to the missions; signals with `m2pem:returned` of it are thrown.

        The operator who has it may. Another one gives a `reason`, and is refused while the one who
        has it is there: see "Handing over" in docs/operating.md. All operators see it then.

        Raises:
            OperatorError: no operator has it, or `by` may not give it back.
        """
        ...

    async def request_control(self, resource: str, *, by: str = "") -> None:
        """Ask the operator who has taken a vehicle or payload for it.

        Within the fleet's `hand_over: answer_within` the holder gives it or refuses; afterwards it
        stays, or goes to `by`, as the fleet says. All operators are told.

        Raises:
            OperatorError: no other operator has it, or one asks for it already.
        """
        ...

    async def answer_control(self, resource: str, *, give: bool, by: str = "") -> None:
        """Give a vehicle or payload to the operator who asks for it, or refuse. Who has asked
        withdraws the request by refusing.

        Raises:
            OperatorError: no operator asks for it, or `by` does not have it.
        """
        ...

    async def control_requests(self) -> Sequence[OpenControlRequest]:
        """Who asks whom for which vehicle or payload now."""
        ...

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
        """An operator is present at a unit with the id `client`. Units say so each
        `PRESENCE_EVERY_S`; after `ABSENT_AFTER_S` without it the operator counts as gone.

        `run`, `page`: what the unit shows; `editing`: the mission that is edited there; `role`:
        what it lets the operator do.
        """
        ...

    async def end_presence(self, client: str) -> None:
        """The operator of the unit `client` has left."""
        ...

    async def operators(self) -> Sequence[OperatorPresence]:
        """Which operators are present, at which units."""
        ...

    async def add_note(self, run: RunId, text: str, *, by: str = "") -> None:
        """Write a note into a run's log: a record, which every operator sees.

        Raises:
            OperatorError: it is empty or too long (`MAX_NOTE_CHARACTERS`), or the run has ended.
        """
        ...

    async def holders(self) -> Mapping[ResourceId, str]:
        """Who has each resource: an operator, a behavior ("r1.b3"), a request for which it was just
        chosen ("r1.a2"), an incident ("r1.i1"), or "" when it is free.
        """
        ...

    async def holder_labels(self) -> Mapping[str, str]:
        """The task and run of each behavior and request that has a resource, in words, by its id:
        "Survey of r1". Operators are not among them.
        """
        ...

    async def unavailable(self) -> Mapping[ResourceId, str]:
        """Why missions get some resources not now: manned, with an operator, lost, or returned and
        not stopped yet. "returned: held": it was lost, is free again, and has done nothing since.
        """
        ...

    async def waiting(self) -> Sequence[WaitingTask]:
        """The tasks of all runs that wait for vehicles, payloads or space, in the order of
        service."""
        ...

    async def shared_space(self) -> Sequence[SharedSpaceState]:
        """Who has places in the shared spaces of the fleet file, in its order, and which tasks wait
        for one."""
        ...

    async def incidents(self) -> Sequence[OpenIncident]:
        """The incidents of all runs that are open, in the order in which they opened."""
        ...

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
        """Whether the mission still completes after a choice about an incident.

        Arguments as for `resolve_incident`. It is explored in a process of its own; no run waits.
        """
        ...

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
        """Decide about an incident: one of its `choices`. The first one that ends it wins.

        `data`: what `set_data` writes. `to`: the element or sequence flow that `move` goes to.
        `roles`: who fills roles instead, by `retry_with`; a team stands for its members.
        `even_if_stuck`: an operator has confirmed a choice after which the mission cannot complete.

        Raises:
            OperatorError: the choice is wrong or comes too late, or others decide about it; the
                error says what would be right.
            StuckError: the mission cannot complete after it, and that was not confirmed.
        """
        ...

    async def alerts(self, *, over: bool = False) -> Sequence[OperatorAlert]:
        """What operators must know now (docs/operating.md): the alerts that are open, the most
        severe first, the newest of each severity first.

        `over`: then also the last ones that are over, the newest first.
        """
        ...

    async def acknowledge_alert(self, alert: str, *, by: str = "") -> None:
        """Note that an operator has seen an alert: it calls no operator any more. One that was said
        once, and is no condition that ends by itself, is over then.

        Raises:
            OperatorError: there is no such alert, it is over, or it is acknowledged already; or
                the journal has not written it within 1.5 s.
        """
        ...

    async def own_alert(self, alert: str, *, owner: str | None = None, by: str = "") -> None:
        """Note who takes care of an alert. None: `by` does; "": no operator any more.

        Raises:
            OperatorError: there is no such alert, or it is over; or the journal has not written it
                within 1.5 s.
        """
        ...

    def subscribe(
        self, run: RunId | None = None, size: int = 10_000
    ) -> AsyncIterator[ControlEvent]:
        """Yield the prompts that are open, and then all events from this call on."""
        ...

    def telemetry(self, size: int = 100) -> AsyncIterator[Telemetry]:
        """Telemetry from now on; the oldest waiting is dropped when a reader is slow."""
        ...

    async def records(
        self, run: RunId, after_seq: int = 0, limit: int = 1000
    ) -> Sequence[StampedRecord]:
        """The records after `after_seq`, about `limit` of them: a page ends with all records of
        an input, so it may be longer. `after_seq` is 0, or the last of a page."""
        ...

    async def runs(self) -> Sequence[RunSummary]:
        """Every run of the journal."""
        ...

    def prompts(self) -> Sequence[OpenPrompt]:
        """The prompts that are open."""
        ...

    async def mission(self, run: RunId) -> "Mission":
        """The mission of a run, also of one that has ended: its elements with their names."""
        ...

    async def mission_time_s(self, run: RunId) -> float:
        """Seconds from the start of a run that has not ended; stands during a pause."""
        ...

    async def wait(self, run: RunId) -> RunSummary:
        """Wait until the run has ended and its vehicles are released."""
        ...

    def fleet(self) -> "Fleet":
        """The fleet in use."""
        ...

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """Return the behaviors of every resource."""
        ...

    def simulated(self) -> bool:
        """Whether nothing real moves: all vehicles are simulated, or software in the loop."""
        ...

    def speed(self) -> float:
        """Seconds of mission time in a real second."""
        ...

    async def health(self) -> Sequence[HealthCheck]:
        """Whether this executive can do its work now: `journal`, `arbiters`, `event loop`.

        It answers within two seconds, whatever hangs. Vehicles do not count: their links are in
        the telemetry.
        """
        ...

    async def statistics(self) -> ExecutiveStatistics:
        """What this executive has counted since it began, and how long its queues are now."""
        ...

    async def standbys(self) -> Sequence[ExecutiveAddress]:
        """The executives that stand by for the fleet of this one.

        Raises:
            JournalError: the journal cannot say it.
        """
        ...

    def journal_file(self) -> Path | None:
        """The journal's file; None: the journal is in memory."""
        ...

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        """All findings of `m2pem check` for a mission and the fleet in use.

        `data`: names that are given at start.
        """
        ...

    def estimate(self, mission: MissionSource, *, process: str | None = None) -> MissionEstimate:
        """What a mission takes as it is drawn: distance, time and battery of each vehicle.

        Raises:
            FindingsError: the mission cannot be read, has no such process, or a vehicle of the
                fleet cannot be simulated.
            OperatorError: this executive cannot estimate missions.
        """
        ...

    async def simulate(self, mission: MissionSource, **options: Any) -> SimulationResult:
        """Rehearse a mission with this fleet on a virtual clock. Cancelling ends it.

        Options: `process`, `data`, `answers` (path of an answers file, or its text as bytes),
        `start_us` (microseconds since the Unix epoch), `max_steps` (100,000: all records are kept
        in memory), `telemetry_every_s` (None: the result has no telemetry).

        Raises:
            FindingsError: the mission or the answers cannot be used.
        """
        ...

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
        """Verify a mission with this fleet, as `m2pem verify --format json` does.

        `spec`: the text of a file of requirements. `timers_in_order`: `--timers in-order`. It takes
        a processor for up to `limits.seconds`, and is done in a process of its own; cancelling ends
        that. The answer has the shape of docs/verification.schema.json.

        Raises:
            FindingsError: the mission or the requirements cannot be used.
        """
        ...

    def editable(self, mission: bytes, *, anew: bool = False) -> Editable:
        """The same mission as an editor takes it, with a diagram of everything in it.

        `anew`: what it has of diagrams is laid out again.

        Raises:
            MissionError: it is no BPMN 2.0.
        """
        ...

    def outline(self, mission: bytes | Draft) -> Outline:
        """What a file has, also one with errors, as far as it can be read.

        Raises:
            MissionError: it is no BPMN 2.0.
        """
        ...

    def geometries(self) -> Mapping[str, HandedOver]:
        """The routes, areas and points that operators have handed over for all runs."""
        ...

    def run_geometries(self) -> "Mapping[RunId, Mapping[str, Route | Area | Point]]":
        """The routes, areas and points that runs under way have alone, by run and name.

        They are those of its mission's files, those that were handed over to this run, and those
        of all runs that have changed since and that it keeps.
        """
        ...

    def services(self) -> Mapping[str, Sequence[str]]:
        """The service-task classes that there are, with the names of data that each writes."""
        ...
