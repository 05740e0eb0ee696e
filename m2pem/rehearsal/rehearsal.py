"""Rehearses a mission: the whole executive on simulated vehicles, in virtual time."""

import asyncio
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TypeAlias

from m2pem.api.authoring import MissionSource
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.requirement_states import RequirementStates
from m2pem.api.runs import RunStatus, RunSummary, SimulationResult, StampedRecord, TelemetrySample
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.engine.incidents import incident_holding
from m2pem.engine.inputs import GiveUp, MonitoredRequirement
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import AnswersError, MissionError
from m2pem.executive.executive import Executive
from m2pem.executive.loading import (
    has_requirements,
    load_source,
    monitored_requirements,
)
from m2pem.executive.runner import Runner
from m2pem.findings import Finding, Severity, has_errors
from m2pem.fleet.allocation import roles_of_mission
from m2pem.fleet.check import DETECTOR_SERVICE
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.fleet.space import waits_for_space
from m2pem.journal.base import Entry
from m2pem.journal.memory import MemoryJournal
from m2pem.mission.behavior import Behavior, OnLoss, RoleKind, ServiceCall
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import (
    Activity,
    ScriptTask,
    SendTask,
    ServiceTask,
)
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers, check_answers, load_answers
from m2pem.rehearsal.answers_file import ServiceEntry
from m2pem.rehearsal.scripted import ScriptedPlugins
from m2pem.simulation.arbiters import SimArbiter
from m2pem.units import US_PER_S

NO_FLEET = Fleet("", "no fleet", {})


def refuse_commands(mission: Mission) -> None:
    """Refuse a mission that commands resources.

    Raises:
        MissionError: with a finding for each task that does.
    """
    findings = [
        Finding(
            Severity.ERROR,
            mission.file_of(task),
            work.line,
            task.id,
            "needs-fleet",
            f"{what} needs a fleet",
            "name one with --fleet; '--fleet sim' makes one up",
        )
        for task, work, what in _commands(mission)
    ]
    if findings:
        raise MissionError(f"{mission.file} commands resources, and there is no fleet", findings)


def _commands(mission: Mission) -> Iterator[tuple[Activity, Behavior | ServiceCall, str]]:
    for task in mission.activities():
        if isinstance(task, ScriptTask | ServiceTask | SendTask) and task.behavior:
            # A hold without a resource is a wait.
            if task.behavior.roles or task.behavior.name != "hold":
                yield task, task.behavior, f"behavior {task.behavior.name}"
        elif isinstance(task, ServiceTask) and task.call and task.call.roles:
            yield task, task.call, f"service {task.call.service}"


MOST_SAMPLES = 5_000
"""Kept of a rehearsal; when there are more, every other one goes, and the interval doubles."""


class Sampler:
    """`samples`: one each `every_s` of mission time, later of a multiple of it.

    Motion is known as a function of time until the next event: so it is asked whenever time is
    about to jump, for the times that are jumped over.
    """

    def __init__(
        self,
        every_s: float,
        started_us: int,
        states_at: Callable[[int], Iterable[VehicleState | PayloadState]],
    ) -> None:
        self.samples: list[TelemetrySample] = []
        self._every_us = max(1, round(every_s * US_PER_S))
        self._started_us = started_us
        self._next_us = started_us
        self._states_at = states_at

    def before(self, until_us: int) -> None:
        """Sample up to a time, which is not passed yet."""
        while self._next_us < until_us:
            self.at(self._next_us)
            self._next_us += self._every_us
            if len(self.samples) > MOST_SAMPLES:
                del self.samples[1::2]
                self._every_us *= 2
                last_us = self._started_us + round(self.samples[-1].t_s * US_PER_S)
                self._next_us = last_us + self._every_us

    def at(self, time_us: int) -> None:
        """Sample the states at this moment."""
        states = list(self._states_at(time_us))
        self.samples.append(
            TelemetrySample(
                (time_us - self._started_us) / US_PER_S,
                {each.resource: each for each in states if isinstance(each, VehicleState)},
                {each.resource: each for each in states if isinstance(each, PayloadState)},
            )
        )


START_US = 1_767_225_600_000_000
"""2026-01-01T00:00:00Z, when a rehearsal begins unless said otherwise."""

MAX_STEPS = 10_000_000

SEARCH_US = 3600 * US_PER_S
"""How long a vehicle whose motion has no end may go on searching for targets."""

SETTINGS = {"telemetry_hz": 0, "footprints": False, "state": ""}
"""Settings of every simulated resource: telemetry has changes only, without what payloads see, as
nothing in a rehearsal reads that; and no state file."""

SPACE_HZ = 1.0
"""Telemetry of a fleet whose tasks wait for space, and of a mission whose requirements are about
telemetry: each second is looked at it."""

_TELEMETRY = re.compile(rb"\b(?:distance|altitude|speed|battery|link)\s*\(")
"""What the file of a mission with a requirement about telemetry contains."""

EXIT_STATUS = {
    RunStatus.COMPLETED: 0,
    RunStatus.TERMINATED: 0,
    RunStatus.FAILED: 1,
    RunStatus.STOPPED: 130,
}

Admitted: TypeAlias = tuple[str, tuple[MonitoredRequirement, ...]]
OnRecord = Callable[[StampedRecord], None]


@dataclass(frozen=True, slots=True)
class VehicleAtEnd:
    """A simulated vehicle at the end of a rehearsal. `battery`: a fraction; `distance_m`: the
    length of the way that it has gone, in space."""

    battery: float
    distance_m: float


@dataclass(frozen=True, slots=True)
class RehearsalResult(SimulationResult):
    """`records` is empty when they were given to `on_record` instead. `vehicles`: the simulated
    ones, at the end."""

    vehicles: Mapping[ResourceId, VehicleAtEnd] = field(default_factory=dict)

    @property
    def exit_status(self) -> int:
        """The exit status of `m2pem simulate` (docs/cli.md)."""
        return EXIT_STATUS[self.summary.status]


def rehearse(
    mission: MissionSource | Mission,
    fleet: Fleet | None,
    *,
    plugins: PluginManager,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    spec: Path | bytes | None = None,
    answers: Answers | Path | str | bytes | None = None,
    start_us: int = START_US,
    max_steps: int = MAX_STEPS,
    on_record: OnRecord | None = None,
    observed: bool = True,
    search_path: Sequence[Path] = (),
    telemetry_every_s: float | None = None,
) -> RehearsalResult:
    """Run a mission to its end on a virtual clock that begins at `start_us` (since the epoch).

    `mission`: a path, a `file:` or `http:` URL, BPMN bytes, or one that was loaded. `fleet` None:
    for a mission that commands no resource. `spec`: more requirements that it is monitored for, a
    file or its text. `answers`: a file, its text as bytes, or one that was
    loaded and has not been used. `on_record` gets each record as soon as it is committed; what it
    raises ends the rehearsal. `observed`: whether plugins that observe records are called.
    `search_path`: folders of processes that the mission calls. `telemetry_every_s`: of mission
    time, the period of the vehicles' positions in the result; None: it has none.

    Raises:
        MissionError: the mission cannot be loaded, does not fit the fleet, or needs one.
        RequirementsError: the requirements cannot be used.
        AnswersError: the answers cannot be used, or do not fit the mission.
        FleetError: the fleet cannot be simulated.
    """
    loaded = mission if isinstance(mission, Mission) else load_source(mission, search_path)
    return Rehearser(loaded, fleet, plugins, process, spec=spec).rehearse(
        data=data,
        answers=answers,
        start_us=start_us,
        max_steps=max_steps,
        on_record=on_record,
        observed=observed,
        telemetry_every_s=telemetry_every_s,
    )


def uses_left(mission: Mission) -> bool:
    """Whether a run of a mission may depend on what vehicles have reported as left: others may do
    the rest of what a lost one did, or of a team's behavior."""
    roles = list(roles_of_mission(mission))
    return any(role.on_loss is not OnLoss.FAIL for role in roles) or any(
        role.kind is RoleKind.TEAM for role in roles
    )


class Rehearser:
    """Rehearses one mission with one fleet, as often as wanted: both are checked once.

    Raises:
        MissionError: the mission needs a fleet, and gets None.
        FleetError: the fleet cannot be simulated.
    """

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet | None,
        plugins: PluginManager,
        process: str | None = None,
        *,
        spec: Path | bytes | None = None,
        reports_left: bool = True,
    ) -> None:
        """`spec`: more requirements, a file or its text. `reports_left`: vehicles report what is
        left of a behavior while it goes on. What becomes of a run does not depend on that, unless
        others may do what is left (`uses_left`)."""
        if fleet is None:
            refuse_commands(mission)
            fleet = NO_FLEET
        self.mission = mission
        # A mission that has such words elsewhere is rehearsed a little slower, and the same.
        asks = has_requirements(mission) and _TELEMETRY.search(mission.source)
        looks = waits_for_space(fleet) or asks or spec is not None
        seen = {"telemetry_hz": SPACE_HZ} if looks else {}
        # A script answers: it may answer what any operator may.
        silent = {} if reports_left else {"reports_left": False}
        self.fleet = simulated_fleet(replace(fleet, operators={}), {**SETTINGS, **seen, **silent})
        self.plugins = plugins
        self._process = process
        self._spec = spec
        self._admitted: dict[frozenset[str], Admitted] = {}

    def rehearse(
        self,
        *,
        data: Mapping[str, Value] | None = None,
        answers: Answers | Path | str | bytes | None = None,
        start_us: int = START_US,
        max_steps: int = MAX_STEPS,
        on_record: OnRecord | None = None,
        observed: bool = True,
        telemetry_every_s: float | None = None,
        fits: bool = False,
    ) -> RehearsalResult:
        """Rehearse it once; see the function `rehearse`.

        `fits`: it is known that the answers fit the mission and the fleet.
        """
        script = answers if isinstance(answers, Answers) else _load(answers)
        if not fits:
            refuse_misfits(script, self.mission, self.fleet)
        collected: list[StampedRecord] = []
        rehearsal = Rehearsal(
            self,
            script,
            max_steps,
            on_record or collected.append,
            observed,
            telemetry_every_s,
        )
        summary = run_virtual(lambda clock: rehearsal.run(clock, data), start_us)
        return RehearsalResult(
            summary,
            tuple(collected),
            tuple(rehearsal.samples),
            tuple(self.mission.files()),
            tuple(rehearsal.requirements.values()),
            rehearsal.vehicles,
        )

    def admit(self, executive: Executive, data: Mapping[str, Value] | None) -> Admitted:
        """Return the process to begin with, and what runs are monitored for. Data of the same names
        are checked once.

        Raises:
            MissionError: with every finding.
        """
        names = frozenset(data or ())
        if names not in self._admitted:
            process, _ = executive.starter.admit(self.mission, self._process, data)
            required = monitored_requirements(
                self.mission, self.fleet, self.plugins, data or {}, self._spec
            )
            self._admitted[names] = process, required
        return self._admitted[names]


def _load(answers: Path | str | bytes | None) -> Answers:
    return Answers() if answers is None else load_answers(answers)


def refuse_misfits(answers: Answers, mission: Mission, fleet: Fleet) -> None:
    """Refuse answers for elements, decisions, signals and messages that a mission does not have, or
    for vehicles that the fleet does not have.

    Raises:
        AnswersError: with every finding.
    """
    findings = check_answers(answers, mission, fleet)
    if has_errors(findings):
        raise AnswersError(f"{answers.source.file} does not fit {mission.file}", findings)


Debugger: TypeAlias = Callable[[Runner, Sequence[SimArbiter], int], bool]
"""Steers a rehearsal from outside (`m2pem.rehearsal.debugging`): is called when nothing is ready,
before time advances, with microseconds since the Unix epoch by the virtual clock. It returns
whether it has posted an input."""


class Rehearsal:
    """One rehearsed run, from its beginning to its end."""

    def __init__(
        self,
        rehearser: Rehearser,
        answers: Answers,
        max_steps: int,
        on_record: OnRecord,
        observed: bool,
        telemetry_every_s: float | None,
        debugger: Debugger | None = None,
    ) -> None:
        self.samples: Sequence[TelemetrySample] = ()
        self.vehicles: Mapping[ResourceId, VehicleAtEnd] = {}
        self.requirements = RequirementStates()
        self._debugger = debugger
        self._holding: list[asyncio.Future[None]] = []
        self._every_s = telemetry_every_s
        self._rehearser = rehearser
        self._answers = answers
        self._scripted = ScriptedPlugins(rehearser.plugins, answers, _unscripted)
        self._limit = StepLimit(max_steps)
        self._observed = observed
        self._on_record = on_record
        self._quiet_since_us: int | None = None

    async def run(self, clock: VirtualClock, data: Mapping[str, Value] | None) -> RunSummary:
        journal = _NotifyingJournal(self._read)
        mission = self._rehearser.mission
        executive = Executive(
            self._rehearser.fleet,
            journal,
            self._scripted,
            clock,
            watch_links=False,
            observed=self._observed,
            limit=self._limit,
            on_records=self._answers.seen,
        )
        process_id, required = self._rehearser.admit(executive, data)
        async with executive:
            if any(each.conditions for each in required):
                # The first telemetry waits to be read: it counts from the first moment on.
                for arbiter in self._scripted.simulated:
                    for vehicle in arbiter.broadcast.all_at(clock.now_us()):
                        executive.bus.publish(vehicle)
            step = self._debugger is not None
            run = await executive.starter.begin(
                mission, process_id, data, "", step=step, requirements=required
            )
            runner = executive.runner(run)
            if self._debugger is not None:
                state = runner.run.state
                self._scripted.holds_wait = lambda: state.status is EngineStatus.PAUSED
            sampler = self._sampler(clock)

            def before_a_jump(ahead_s: float | None) -> bool:
                if self._give_up(executive, runner, ahead_s):
                    return True
                if sampler is not None and ahead_s is not None:
                    sampler.before(clock.now_us() + round(ahead_s * US_PER_S))
                return False

            clock.when_idle(before_a_jump)
            acting = asyncio.ensure_future(
                self._answers.act(executive.control, run, clock, default_first_decision=True)
            )
            ending = asyncio.ensure_future(executive.control.wait(run))
            try:
                await asyncio.wait(
                    (acting, ending, journal.broken), return_when=asyncio.FIRST_COMPLETED
                )
                for first in (journal.broken, acting):
                    if first.done():
                        first.result()
                summary = await ending
                if sampler is not None:
                    sampler.at(clock.now_us())
                    self.samples = sampler.samples
                now_us = clock.now_us()
                self.vehicles = {
                    each.id: VehicleAtEnd(each.battery_at(now_us), each.driven_m(now_us))
                    for arbiter in self._scripted.simulated
                    for each in arbiter.vehicles
                }
                return summary
            finally:
                acting.cancel()
                ending.cancel()

    def _read(self, stamped: StampedRecord) -> None:
        self.requirements.take(stamped.record, stamped.t_s)
        self._on_record(stamped)

    def _sampler(self, clock: VirtualClock) -> Sampler | None:
        if self._every_s is None:
            return None

        def states_at(time_us: int) -> Iterator[VehicleState | PayloadState]:
            return chain.from_iterable(
                each.broadcast.all_at(time_us) for each in self._scripted.simulated
            )

        return Sampler(self._every_s, clock.now_us(), states_at)

    # --- nothing can happen any more ------------------------------------------------------------

    def _give_up(self, executive: Executive, runner: Runner, ahead_s: float | None) -> bool:
        """Called when nothing is ready: end the run if nothing that is scheduled can change it."""
        status = runner.run.state.status
        if self._debugger is not None:
            if self._hold_for_incidents(runner):
                return True
            if self._debugger(runner, self._scripted.simulated, executive.clock.now_us()):
                return True
        if status is EngineStatus.PAUSED and ahead_s is None and not self._answers.to_send:
            runner.post(GiveUp("the run is paused, and nothing resumes it"))
            return True
        if status is not EngineStatus.RUNNING:
            return False
        if self._expects(executive, runner):
            self._quiet_since_us = None
            return False
        if ahead_s is not None and any(arbiter.searching for arbiter in self._scripted.simulated):
            now_us = executive.clock.now_us()
            if self._quiet_since_us is None:
                self._quiet_since_us = now_us
            if now_us + ahead_s * US_PER_S <= self._quiet_since_us + SEARCH_US:
                return False
        runner.post(GiveUp("nothing that is scheduled can happen any more"))
        return True

    def _hold_for_incidents(self, runner: Runner) -> bool:
        """Whether there was something to hold that is held beyond the pause."""
        waiting = self._scripted.not_held
        wanted = [each for each in waiting if incident_holding(runner.run.state, each)]
        self._holding = [
            asyncio.ensure_future(waiting.pop(resource).hold(resource)) for resource in wanted
        ]
        return bool(wanted)

    def _expects(self, executive: Executive, runner: Runner) -> bool:
        state = runner.run.state
        return (
            runner.run.next_due_us is not None
            or runner.monitors.due_us is not None
            or self._answers.to_send > 0
            or self._answers.resolving > 0
            or self._scripted.ending > 0
            or executive.supervisor.dispatcher.calls_waiting > 0
            or any(
                behavior.phase is BehaviorPhase.CANCELLING for behavior in state.behaviors.values()
            )
            or executive.arbiters.teams.expects
            or any(arbiter.expects for arbiter in self._scripted.simulated)
        )


def _unscripted(service: str) -> ServiceEntry | None:
    """A service without an answer completes at once, except a Detector, which waits."""
    return None if service == DETECTOR_SERVICE else ServiceEntry()


@dataclass(frozen=True, slots=True)
class StepLimit:
    """Implements `RunLimit`: a run is given up after `max_steps` engine steps."""

    max_steps: int

    @property
    def steps_at_once(self) -> int:
        """Not more than are allowed."""
        return self.max_steps

    def exceeded(self, run: MissionRun) -> str:
        """Return that it has taken its steps; "" if it has not."""
        done = run.steps_done >= self.max_steps
        return f"it has taken the {self.max_steps} steps that are allowed" if done else ""


class _NotifyingJournal(MemoryJournal):
    """Keeps nothing, and calls the listener with each record when it is committed.

    `broken`: is done, with the error, when the listener raised; it is not called after that.
    """

    def __init__(self, on_record: OnRecord) -> None:
        super().__init__(keep=1)
        self._on_record = on_record
        self.broken: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    async def append(self, entries: Sequence[Entry]) -> None:
        await super().append(entries)
        if self.broken.done():
            return
        try:
            for entry in entries:
                for place, record in enumerate(entry.records):
                    seq = entry.seq + place
                    self._on_record(StampedRecord(entry.run, seq, entry.t_us / US_PER_S, record))
        except Exception as error:  # it is the caller's, who gets it back
            self.broken.set_exception(error)
