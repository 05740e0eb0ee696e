"""Drives one run: decide -> commit -> dispatch, for every input, in the order they came.

Only stop, hold and cancel may go out before the commit. Inputs that wait together are decided
together and share a commit.
"""

import asyncio
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from m2pem.api.clock import Clock
from m2pem.api.control import OpenPrompt, PromptClosed, RunId, StampedRecord
from m2pem.engine import commands as c
from m2pem.engine import records as r
from m2pem.engine.inputs import (
    Continue,
    GiveUp,
    Input,
    PauseRun,
    StopRun,
    Tick,
)
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.errors import InternalError, M2pemError, OperatorError, StaleEpochError
from m2pem.executive.dispatch import Dispatcher
from m2pem.executive.notices import Notices
from m2pem.executive.services import Services
from m2pem.journal.base import Entry, Journal

log = logging.getLogger("m2pem.run")

MAX_BATCH = 1000
"""Inputs decided before a commit, at most."""


@dataclass(slots=True)
class Outside:
    """Where a run's commands go and its records are told."""

    journal: Journal
    clock: Clock
    dispatcher: Dispatcher
    services: Services
    notices: Notices
    observe: Callable[[RunId, Sequence[r.Record]], None]


class Runner:
    """One run and its task. `epoch` is the claim under which entries are written.

    `max_steps`: engine steps after which a run is given up (rehearsals).
    """

    def __init__(
        self, run: MissionRun, epoch: int, outside: Outside, max_steps: int | None = None
    ) -> None:
        self.run = run
        self.id: RunId = run.state.run
        self.epoch = epoch
        self.failure: M2pemError | None = None
        self.prompts: dict[str, OpenPrompt] = {}
        self._outside = outside
        self._max_steps = max_steps
        self._inbox: list[Input] = []
        self._wake = asyncio.Event()
        self._withheld: list[c.StartBehavior] = []
        self._told: list[tuple[Input, asyncio.Future[Step]]] = []
        self.done = asyncio.Event()

    # --- inputs ---------------------------------------------------------------------------------

    def post(self, item: Input) -> None:
        """Hand in what happened; it is decided in its turn."""
        self._inbox.append(item)
        self._wake.set()

    def tell(self, item: Input) -> "asyncio.Future[Step]":
        """Hand in what an operator wants; the future is done when it is decided and committed.

        Raises:
            OperatorError: the run has ended.
            M2pemError: the run can decide nothing any more.
        """
        if self.done.is_set():
            raise self._why_not()
        told: asyncio.Future[Step] = asyncio.get_running_loop().create_future()
        self._told.append((item, told))
        self.post(item)
        return told

    # --- the loop -------------------------------------------------------------------------------

    async def drive(self) -> None:
        """Go on until the run has ended and all that it commanded is released.

        A failure of the journal or of m2pem itself holds the run's vehicles and ends the task; the
        rest of the executive goes on.
        """
        try:
            while not self._is_over():
                await self._cycle(await self._next_inputs())
        except StaleEpochError as error:
            log.error("%s: another executive drives it now", self.id)
            self.failure = error
        except M2pemError as error:
            log.error("%s: held: %s", self.id, error)
            self._hold_everything(error)
        except Exception as error:
            log.exception("%s: held because of a bug in m2pem", self.id)
            self._hold_everything(InternalError(f"{type(error).__name__}: {error}"))
        finally:
            self.done.set()
            for _, told in self._told:
                if not told.done():
                    told.set_exception(self._why_not())

    def _why_not(self) -> M2pemError:
        return self.failure or OperatorError(f"{self.id} has ended")

    def _is_over(self) -> bool:
        state = self.run.state
        return state.status is RunStatus.ENDED and not state.behaviors and not self._inbox

    async def _next_inputs(self) -> list[Input]:
        """What has happened, or what time or the engine itself wants; waits when nothing does."""
        while True:
            if self._exhausted():
                return [GiveUp(f"it has taken the {self._max_steps} steps that are allowed")]
            if self._inbox:
                batch, self._inbox = self._inbox[:MAX_BATCH], self._inbox[MAX_BATCH:]
                return batch
            if self.run.wants_continue:
                await asyncio.sleep(0)
                if not self._inbox:
                    return [Continue()]
                continue
            self._wake.clear()
            due_us = self.run.next_due_us
            if due_us is None:
                await self._wake.wait()
            elif due_us <= self._outside.clock.now_us():
                return [Tick()]
            else:
                await self._wait_until(due_us)

    def _exhausted(self) -> bool:
        return (
            self._max_steps is not None
            and self.run.steps_done >= self._max_steps
            and self.run.state.status is RunStatus.RUNNING
        )

    async def _wait_until(self, due_us: int) -> None:
        woken = asyncio.ensure_future(self._wake.wait())
        due = asyncio.ensure_future(self._outside.clock.sleep_until(due_us))
        try:
            await asyncio.wait((woken, due), return_when=asyncio.FIRST_COMPLETED)
        finally:
            woken.cancel()
            due.cancel()

    async def _cycle(self, batch: Sequence[Input]) -> None:
        steps: list[Step] = []
        for item in batch:
            step = self.run.receive(item, self._outside.clock.now_us())
            steps.append(step)
            if isinstance(item, (StopRun, PauseRun, GiveUp)):
                self._dispatch_early(step)
        await self._outside.journal.append(
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
        for step in steps:
            self._publish(step)
            for command in step.commands:
                self._dispatch(command, early_done=isinstance(step.input, _EARLY))
            self._answer_asker(step)

    def _answer_asker(self, step: Step) -> None:
        for place, (item, told) in enumerate(self._told):
            if item is step.input:
                del self._told[place]
                if not told.done():
                    told.set_result(step)
                return

    # --- what follows a commit ------------------------------------------------------------------

    def _publish(self, step: Step) -> None:
        outside = self._outside
        outside.observe(self.id, step.records)
        tell = outside.notices.anybody
        for place, record in enumerate(step.records):
            if isinstance(record, r.BehaviorEnded):
                outside.dispatcher.ended(record.behavior)
            if tell:
                outside.notices.publish(
                    StampedRecord(self.id, step.seq + place, step.t_us / 1_000_000, record)
                )

    def _dispatch_early(self, step: Step) -> None:
        for command in step.commands:
            if isinstance(command, c.CancelBehavior):
                self._outside.dispatcher.cancel(command)
            elif isinstance(command, c.HoldResource):
                self._outside.dispatcher.hold(command.resource)

    def _dispatch(self, command: c.Command, *, early_done: bool = False) -> None:
        outside = self._outside
        match command:
            case c.StartBehavior():
                self._start(command)
            case c.CancelBehavior():
                if not early_done:
                    outside.dispatcher.cancel(command)
            case c.HoldResource(resource=resource):
                if not early_done:
                    outside.dispatcher.hold(resource)
            case c.ResumeResource(resource=resource):
                outside.dispatcher.resume(resource)
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
                outside.notices.publish(prompt)
            case c.ClosePrompt():
                if self.prompts.pop(command.prompt, None) is not None:
                    outside.notices.publish(
                        PromptClosed(self.id, command.prompt, command.decision, command.by)
                    )
            case c.RunService():
                outside.services.run(self, command)
            case c.CancelService():
                outside.services.cancel(self.id, command.service)

    def _start(self, command: c.StartBehavior) -> None:
        """Start it, unless it is unwanted by now; while paused, nothing starts."""
        state = self.run.state
        behavior = state.behaviors.get(command.behavior)
        if behavior is None or behavior.phase is not BehaviorPhase.ACTIVE:
            return
        if state.status is RunStatus.PAUSED:
            self._withheld.append(command)
        else:
            self._outside.dispatcher.start(command)

    def _release_withheld(self) -> None:
        withheld, self._withheld = self._withheld, []
        for command in withheld:
            self._start(command)

    def _hold_everything(self, failure: M2pemError) -> None:
        self.failure = failure
        self._outside.dispatcher.hold_all(self.id)

    # --- taking over after a restart --------------------------------------------------------------

    def take_up(self, commands: Sequence[c.Command]) -> None:
        """Carry out what stands from before a restart."""
        for command in commands:
            self._dispatch(command)


_EARLY = (StopRun, PauseRun, GiveUp)
