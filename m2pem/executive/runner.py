"""Drives one run: decide -> commit -> dispatch, for every input, in the order they came.

Only stop, hold and cancel may go out before the commit; those of an operator's STOP and pause go
out before the run decides them (`m2pem.executive.emergency`). Inputs that wait together are decided
together and share a commit.
"""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Protocol

from m2pem.api.alerts import AlertSeverity
from m2pem.api.clock import Clock
from m2pem.api.log_context import current_run
from m2pem.api.runs import Alert, OpenPrompt, PromptClosed, RunId, stamped_records
from m2pem.engine import commands as c
from m2pem.engine import records as r
from m2pem.engine.inputs import (
    ClaimRun,
    Continue,
    GiveUp,
    Input,
    PauseRun,
    ResumeRun,
    StartRun,
    StopRun,
    Tick,
)
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.errors import InternalError, M2pemError, OperatorError, StaleEpochError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.counts import RunCounts
from m2pem.executive.dispatcher import Dispatcher
from m2pem.executive.outages import Outages, StallMonitor
from m2pem.executive.services import Services
from m2pem.journal.base import Entry, Journal
from m2pem.monitors.run_monitors import RunMonitors

if TYPE_CHECKING:
    from m2pem.monitors.telemetry_conditions import Latest

log = logging.getLogger("m2pem.run")

MAX_BATCH = 1000
"""Inputs decided before a commit, at most."""

STEPS_A_COMMIT = 10_000
"""Engine steps of a run that does not wait which may share a commit."""

MANY_RECORDS = 1_000
"""Records of one input after whose publication others may do something."""

STALLED_AFTER_S = 2.0
"""A commit that takes longer is worth an alert."""


OnRecords = Callable[[RunId, Sequence[r.Record]], None]
"""Is called with the records of a run when they are committed, before their commands go out."""


LookAgain = Callable[["Runner", float], Awaitable[tuple[list[Input], frozenset[str]]]]
"""Looks at a run's vehicles after an outage: `m2pem.executive.recovery.look_again`."""


class ResourceAllocator(Protocol):
    """Chooses resources for tasks: `m2pem.executive.allocator.Allocator`."""

    def ask(self, runner: "Runner", allocation: str, *, again: bool) -> None:
        """Choose resources for a request; the run gets the answer as an input."""
        ...

    def withdraw(self, allocation: str) -> None:
        """Forget a request."""
        ...


class RunLimit(Protocol):
    """A bound beyond which every run is given up. Missions that command real vehicles have none."""

    @property
    def steps_at_once(self) -> int:
        """Engine steps of one input after which the bound is looked at, at most."""
        ...

    def exceeded(self, run: MissionRun) -> str:
        """Return why the run is to be given up now; "" if it is not."""
        ...


@dataclass(slots=True)
class RunContext:
    """What a run works with: where its commands go, and where its records are published."""

    journal: Journal
    clock: Clock
    dispatcher: Dispatcher
    allocator: ResourceAllocator
    services: Services
    events: ControlEvents
    observe: OnRecords
    hold: Callable[[RunId, Sequence[str]], None]
    """Holds what failed work commanded, at once, and warns of what may not have received it."""
    stalls: StallMonitor
    outages: Outages
    look_again: LookAgain
    counts: RunCounts
    limit: RunLimit | None = None


class Runner:
    """One run and its task. `epoch` is the claim under which entries are written.

    `steps_between_waits`: engine steps after which a run that never waits is paused; None: there is
    no bound.
    """

    def __init__(
        self,
        run: MissionRun,
        epoch: int,
        context: RunContext,
        steps_between_waits: int | None = None,
        monitors: RunMonitors | None = None,
    ) -> None:
        self.run = run
        self.monitors = monitors or RunMonitors(run.state, None)
        self.id: RunId = run.state.run
        self.epoch = epoch
        self.failure: M2pemError | None = None
        self.replaced = False
        """Another executive drives the run."""
        self._broken: Exception | None = None
        self._committing: asyncio.Task[None] | None = None
        self.prompts: dict[str, OpenPrompt] = {}
        self._context = context
        self._steps_between_waits = steps_between_waits
        self._steps_at_wait = 0
        self._outages_seen = context.outages.number
        self._stopping = False
        self._pauses = 0
        self._cancelled_at_once: frozenset[str] = frozenset()
        self._held_at_once: frozenset[str] = frozenset()
        self._strays: frozenset[str] = frozenset()
        self._inbox: list[Input] = []
        self._wake = asyncio.Event()
        self._timer: asyncio.Task[None] | None = None
        self._timer_us: int | None = None
        self._withheld: list[c.StartBehavior] = []
        self._submitted: list[tuple[Input, asyncio.Future[Step]]] = []
        self.done = asyncio.Event()

    # --- inputs ---------------------------------------------------------------------------------

    def post(self, item: Input) -> None:
        """Add an input; the run decides it in the order of arrival."""
        self._inbox.append(item)
        self._wake.set()

    def submit(self, item: Input) -> "asyncio.Future[Step]":
        """Add an operator's input; the future is done when it is decided and committed.

        Raises:
            OperatorError: the run has ended.
            M2pemError: the run can decide nothing any more.
        """
        if self.done.is_set():
            raise self._why_not()
        decided: asyncio.Future[Step] = asyncio.get_running_loop().create_future()
        self._submitted.append((item, decided))
        self.post(item)
        return decided

    @property
    def undecided(self) -> "list[asyncio.Future[Step]]":
        """What operators have asked for that is not decided and committed."""
        return [decided for _, decided in self._submitted if not decided.done()]

    @property
    def waiting(self) -> int:
        """How many inputs it has not decided."""
        return len(self._inbox)

    def submit_stop(self, item: StopRun, cancelled: frozenset[str]) -> "asyncio.Future[Step]":
        """As `submit`, ahead of what waits; `cancelled`: the behaviors whose cancel is under way.

        Until it is decided the run commands nothing new.
        """
        self._stopping = True
        self._cancelled_at_once |= cancelled
        decided = self.submit(item)
        self._inbox.pop()
        # A run that has not begun, or is not claimed, cannot be stopped: these come first.
        first = [isinstance(each, (StartRun, ClaimRun)) for each in self._inbox]
        self._inbox.insert(len(first) - first[::-1].index(True) if any(first) else 0, item)
        return decided

    @property
    def can_pause(self) -> bool:
        """Whether a pause has something to hold: not in a run that has ended, or stays paused."""
        status = self.run.state.status
        resumes = any(isinstance(item, ResumeRun) for item in self._inbox)
        paused = status is RunStatus.PAUSED and not resumes
        return not (self.done.is_set() or status is RunStatus.ENDED or paused)

    def submit_pause(self, item: PauseRun, held: frozenset[str]) -> "asyncio.Future[Step]":
        """As `submit`; `held`: the resources whose hold is under way.

        Until it is decided nothing is started or let go.
        """
        self._pauses += 1
        self._held_at_once |= held
        return self.submit(item)

    def wake(self) -> None:
        """Have the run look at its vehicles now, after an outage of the executive."""
        self._wake.set()

    def fail(self, error: Exception) -> None:
        """Hold what the run commands and end its task, as after an exception of the engine.

        It does not wait for the journal.
        """
        self._broken = error
        self._wake.set()
        if self._committing is not None:
            self._committing.cancel()

    # --- the loop -------------------------------------------------------------------------------

    async def drive(self) -> None:
        """Decide inputs until the run has ended and all that it commanded is released.

        A failure of the journal or of m2pem itself holds the run's vehicles and ends the task; the
        rest of the executive goes on.
        """
        current_run.set(self.id)
        try:
            while not self._is_over():
                batch = await self._next_inputs()
                # What failed is held before it is journaled: not vehicles of another executive.
                await self._context.dispatcher.confirm_claims()
                if self._broken is not None:
                    raise self._broken
                seen, _ = await self._look_after_outage()
                if seen or batch:
                    await self._cycle([*seen, *batch])
        except StaleEpochError as error:
            log.info("%s is not driven here any more", self.id)  # an alert says why
            self.failure = error
        except M2pemError as error:
            self._hold_everything(error)
        except Exception as error:
            log.exception("%s: a bug in m2pem", self.id)
            self._hold_everything(InternalError(f"{type(error).__name__}: {error}"))
        finally:
            self._set_timer(None)
            self.done.set()
            for _, decided in self._submitted:
                if not decided.done():
                    decided.set_exception(self._why_not())
                    decided.exception()  # who asked may not wait for it: it is logged already

    def _why_not(self) -> M2pemError:
        return self.failure or OperatorError(f"{self.id} has ended")

    def _is_over(self) -> bool:
        state = self.run.state
        return state.status is RunStatus.ENDED and not state.behaviors and not self._inbox

    async def _next_inputs(self) -> list[Input]:
        """Return the next inputs: those that were posted, a due timer, or the engine's own.

        Waits when there is none; returns none after an outage of the executive.
        """
        while True:
            if self._broken is not None:
                raise self._broken
            if why := self._exceeds_limit():
                return [GiveUp(why)]
            if self._context.outages.number != self._outages_seen:
                return []
            if self._inbox:
                batch, self._inbox = self._inbox[:MAX_BATCH], self._inbox[MAX_BATCH:]
                return batch
            if self.run.wants_continue:
                await asyncio.sleep(0)
                if not self._inbox:
                    return [self._pause_by_itself() if self._never_waits() else Continue()]
                continue
            due_us = self.run.next_due_us
            verdict_us = self._next_verdict_us()
            if verdict_us is not None and verdict_us <= self._context.clock.now_us():
                self.monitors.advance(self.run.state.mission_time_us(self._context.clock.now_us()))
                if found := self.monitors.take():
                    return list(found)
                continue
            if due_us is not None and due_us <= self._context.clock.now_us():
                return [self._pause_by_itself() if self._never_waits() else Tick()]
            self._steps_at_wait = self.run.steps_done
            self._wake.clear()
            dues = (each for each in (due_us, verdict_us) if each is not None)
            self._set_timer(min(dues, default=None))
            await self._wake.wait()

    def _next_verdict_us(self) -> int | None:
        """When time alone may decide a requirement, in microseconds since the Unix epoch."""
        due_us, state = self.monitors.due_us, self.run.state
        if due_us is None or state.status is not RunStatus.RUNNING:
            return None
        return due_us + state.started_us + state.paused_total_us

    def _set_timer(self, due_us: int | None) -> None:
        """Wake the loop then. Few inputs change that time, so the timer is kept."""
        timer = self._timer
        if timer is not None and (timer.done() or self._timer_us != due_us):
            timer.cancel()
            self._timer = timer = None
        if timer is None and due_us is not None:
            self._timer, self._timer_us = asyncio.ensure_future(self._wake_at(due_us)), due_us

    async def _wake_at(self, due_us: int) -> None:
        await self._context.clock.sleep_until(due_us)
        self._wake.set()

    def measure(self, resource: str, latest: "Latest") -> None:
        """Telemetry of a vehicle has come, or its link is lost: post what changes for requirements.

        Mission time stops in a pause, so it is looked at again when the run goes on.
        """
        if self.run.state.status is RunStatus.RUNNING and not self.done.is_set():
            for item in self.monitors.measure(resource, latest):
                self.post(item)

    def _exceeds_limit(self) -> str:
        limit = self._context.limit
        if limit is None or self.run.state.status is not RunStatus.RUNNING:
            return ""
        return limit.exceeded(self.run)

    def _never_waits(self) -> bool:
        allowed = self._steps_between_waits
        return allowed is not None and self.run.steps_done - self._steps_at_wait >= allowed

    def _pause_by_itself(self) -> PauseRun:
        """A run that fills the journal and waits for nothing is held until an operator decides."""
        steps = self.run.steps_done - self._steps_at_wait
        self._steps_at_wait = self.run.steps_done
        why = f"it took {steps:,} steps and did not wait once"
        text = (
            f"paused: {why}: a loop of the mission may have no end. Stop it, or resume it for as "
            "many steps more; the fleet's steps_between_waits is the bound"
        )
        self._context.events.publish(Alert(self.id, "NEVER_WAITS", text, AlertSeverity.ERROR))
        return PauseRun(f"m2pem, as {why}")

    async def _cycle(self, batch: Sequence[Input]) -> None:
        steps = [step for item in batch for step in self._decide_with_verdicts(item)]
        # A mission that does not wait: what an operator wants is seen between any two steps.
        begun = self.run.steps_done
        while self.run.wants_continue and self.run.steps_done - begun < STEPS_A_COMMIT:
            await asyncio.sleep(0)
            if self._inbox or self._exceeds_limit() or self._never_waits():
                break
            steps += self._decide_with_verdicts(Continue())
        await self._commit(steps)
        seen, unsent = await self._look_after_outage()
        self._inbox[:0] = seen
        if self._broken is not None:
            raise self._broken
        if any(isinstance(step.input, PauseRun) for step in steps):
            self._let_strays_go()
        for step in steps:
            self._publish(step)
            early = isinstance(step.input, _EARLY)
            for command in step.commands:
                if isinstance(command, c.HoldResource) and _opens_incident(step):
                    continue
                if isinstance(command, c.StartBehavior) and command.behavior in unsent:
                    continue
                self._dispatch(command, early_done=early)
            self._answer_asker(step)
            if len(step.records) > MANY_RECORDS:
                await asyncio.sleep(0)  # subscribers keep up, and STOP does not wait

    async def _look_after_outage(self) -> tuple[list[Input], frozenset[str]]:
        """Look at the vehicles if this executive was away. Returns what was seen, and the behaviors
        that must not be started any more."""
        outages = self._context.outages
        self._context.stalls.look()
        if outages.number == self._outages_seen:
            return [], frozenset()
        self._outages_seen = outages.number
        return await self._context.look_again(self, outages.length_s)

    def _decide_with_verdicts(self, item: Input) -> list[Step]:
        """Decide an input, and after it the verdicts on requirements that it makes certain."""
        steps = [self._decide(item)]
        for found in self.monitors.take():
            steps += self._decide_with_verdicts(found)
        return steps

    def _decide(self, item: Input) -> Step:
        step = self.run.receive(item, self._context.clock.now_us())
        self.monitors.observe(step.t_us, step.records)
        if isinstance(item, _EARLY):
            self._dispatch_early(step)
        elif _opens_incident(step):
            holds = [each for each in step.commands if isinstance(each, c.HoldResource)]
            self._context.hold(self.id, [each.resource for each in holds])
        if isinstance(item, PauseRun):
            self._settle_pause()
        return step

    async def _commit(self, steps: Sequence[Step]) -> None:
        loop = asyncio.get_running_loop()
        stalled = loop.call_later(STALLED_AFTER_S, self._alert_of_stall)
        self._committing = task = asyncio.current_task()
        begun_s = time.perf_counter()
        try:
            await self._context.journal.append(
                [
                    Entry(
                        self.id,
                        self.epoch,
                        step.seq,
                        step.at_us,
                        step.t_us,
                        step.input,
                        tuple(step.records),
                    )
                    for step in steps
                ]
            )
        except asyncio.CancelledError:
            if self._broken is None or task is None:
                raise
            task.uncancel()
            raise self._broken from None
        finally:
            self._committing = None
            stalled.cancel()
        records = steps[-1].seq + len(steps[-1].records) - steps[0].seq
        self._context.counts.committed(len(steps), records, time.perf_counter() - begun_s)

    def _alert_of_stall(self) -> None:
        text = (
            f"the journal has not written for {STALLED_AFTER_S:g} s: the run commands nothing new "
            "until it does. STOP and pause reach its vehicles all the same"
        )
        self._context.events.publish(
            Alert(self.id, "JOURNAL_STALLED", text, AlertSeverity.CRITICAL)
        )

    def _settle_pause(self) -> None:
        """The pause that was sent ahead is decided: from here on the run's own state counts."""
        if not self._pauses:
            return  # it was not sent ahead
        self._pauses -= 1
        if self._pauses:
            return
        held, self._held_at_once = self._held_at_once, frozenset()
        state = self.run.state
        # What the run commanded no more when it paused, nothing else lets go.
        self._strays |= held.difference(state.held if state.status is RunStatus.PAUSED else ())

    def _let_strays_go(self) -> None:
        if self._is_held and self.run.state.status is not RunStatus.PAUSED:
            return
        strays, self._strays = self._strays, frozenset()
        for resource in sorted(strays):
            self._context.dispatcher.resume(resource, self.id)
        if not self._is_held:
            self._release_withheld()

    def _answer_asker(self, step: Step) -> None:
        for place, (item, decided) in enumerate(self._submitted):
            if item is step.input:
                del self._submitted[place]
                if not decided.done():
                    decided.set_result(step)
                return

    # --- what follows a commit ------------------------------------------------------------------

    def _publish(self, step: Step) -> None:
        context = self._context
        context.observe(self.id, step.records)
        for record in step.records:
            if type(record) is r.BehaviorEnded:
                context.dispatcher.ended(record.behavior)
            elif type(record) is r.IncidentOpened:
                context.dispatcher.keep(record.incident, record.resources)
            elif type(record) is r.IncidentResolved or type(record) is r.IncidentClosed:
                context.dispatcher.release(record.incident)
            elif type(record) is r.ResourceKept:
                context.dispatcher.keep_between_tasks(record.keeping, record.resource)
            elif type(record) is r.KeepingEnded:
                context.dispatcher.release(record.keeping)
        if context.events.has_subscribers:
            t_s = step.t_us / 1_000_000
            context.events.publish(*stamped_records(self.id, step.seq, t_s, step.records))

    def _dispatch_early(self, step: Step) -> None:
        for command in step.commands:
            if isinstance(command, c.CancelBehavior):
                self._cancel(command)
            elif isinstance(command, c.HoldResource) and command.resource not in self._held_at_once:
                self._context.dispatcher.hold(command.resource)

    def _cancel(self, command: c.CancelBehavior) -> None:
        if command.behavior not in self._cancelled_at_once:
            self._context.dispatcher.cancel(command)

    def _dispatch(self, command: c.Command, *, early_done: bool = False) -> None:
        context = self._context
        match command:
            case c.AllocateResources():
                context.allocator.ask(self, command.allocation, again=command.again)
            case c.WithdrawAllocation():
                context.allocator.withdraw(command.allocation)
            case c.StartBehavior():
                self._start(command)
            case c.AdjustBehavior():
                if not self._is_held:  # else it goes out when the run is resumed
                    context.dispatcher.adjust(command, partial(self._not_adjusted, command))
            case c.CancelBehavior():
                if not early_done:
                    self._cancel(command)
            case c.HoldResource(resource=resource):
                if not early_done:
                    context.dispatcher.hold(resource)
            case c.ResumeResource(resource=resource):
                if not self._is_held:
                    context.dispatcher.resume(resource, self.id)
                    self._release_withheld()
            case c.OpenPrompt():
                prompt = OpenPrompt(
                    self.id,
                    command.prompt,
                    command.element,
                    command.text,
                    command.decisions,
                    command.role,
                )
                self.prompts[command.prompt] = prompt
                context.events.publish(prompt)
            case c.ClosePrompt():
                if self.prompts.pop(command.prompt, None) is not None:
                    context.events.publish(
                        PromptClosed(self.id, command.prompt, command.decision, command.by)
                    )
            case c.RunService():
                context.services.run(self, command)
            case c.CancelService():
                context.services.cancel(self.id, command.service)

    def _not_adjusted(self, command: c.AdjustBehavior, why: str) -> None:
        """Say that a behavior goes on with the parameters that it had."""
        goes_on = command.goes_on
        text = (
            f"{', '.join(goes_on.resources)} may keep the {', '.join(command.names)} that "
            f"{goes_on.name} had before the revision: {why}"
        )
        alert = Alert(self.id, "NOT_ADJUSTED", text, AlertSeverity.WARNING, goes_on.resources)
        self._context.events.publish(alert)

    def _start(self, command: c.StartBehavior) -> None:
        """Start it, unless it is unwanted by now; while paused, nothing starts."""
        behavior = self.run.state.behaviors.get(command.behavior)
        if behavior is None or behavior.phase is not BehaviorPhase.ACTIVE or self._stopping:
            return
        if self._is_held:
            self._withheld.append(command)
        else:
            self._context.dispatcher.start(command)

    @property
    def _is_held(self) -> bool:
        """Whether a pause or stop that was asked for later keeps vehicles from moving."""
        return self._stopping or self._pauses > 0 or self.run.state.status is RunStatus.PAUSED

    def _release_withheld(self) -> None:
        withheld, self._withheld = self._withheld, []
        for command in withheld:
            self._start(command)

    def _hold_everything(self, failure: M2pemError) -> None:
        self.failure = failure
        resources = ", ".join(sorted(self._context.dispatcher.hold_all(self.id)))
        text = (
            f"held: {failure}. Commanded to hold: {resources or 'no vehicle'}. Mend the cause, "
            f"start again and go on with `m2pem resume {self.id}`"
        )
        log.error("%s: %s", self.id, text, extra={"unlisted": True})
        self._context.events.publish(Alert(self.id, "RUN_HELD", text, AlertSeverity.CRITICAL))

    # --- taking over after a restart --------------------------------------------------------------

    def take_up(self, commands: Sequence[c.Command]) -> None:
        """Carry out what was open before a restart, under this epoch: older ones are refused."""
        for command in commands:
            if isinstance(command, (c.StartBehavior, c.AdjustBehavior, c.CancelBehavior)):
                command = replace(command, epoch=self.epoch)  # noqa: PLW2901
            self._dispatch(command)


def _opens_incident(step: Step) -> bool:
    """Whether an incident opens, so that its holds go out before the commit."""
    if isinstance(step.input, _EARLY):
        return False
    holds = any(isinstance(command, c.HoldResource) for command in step.commands)
    return holds and any(isinstance(record, r.IncidentOpened) for record in step.records)


_EARLY = (StopRun, PauseRun, GiveUp)
