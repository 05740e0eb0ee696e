"""Debugging a mission: a rehearsal that its author pauses, looks at, changes, and takes back.

The rehearsal runs in a thread, on a virtual clock that does not advance while the run is paused.
The engine pauses it (`m2pem.engine.breakpoints`), so that it stops at the same places as a run on
vehicles would.

To go back is to rehearse again from the beginning, step by step, with the changes that were made
before that moment. A rehearsal is deterministic, so that moment comes again exactly: a moment is
the number of records that the mission itself has made.
"""

import copy
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from queue import SimpleQueue
from typing import TypeAlias

import msgspec

from m2pem.api.clock import run_virtual
from m2pem.api.run_view import RunView
from m2pem.api.runs import ExpressionValue, RunStatus, RunSummary, ScopeData, StampedRecord
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.breakpoints import why_refused
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import InternalError, OperatorError
from m2pem.executive.mission_control.debugging import data_of, evaluate_at
from m2pem.executive.runner import Runner
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import AnswersModel
from m2pem.rehearsal.rehearsal import (
    MAX_STEPS,
    START_US,
    Rehearsal,
    Rehearser,
    refuse_misfits,
)
from m2pem.simulation.arbiters import SimArbiter

BY = "debugger"
"""Who the records say has changed data or sent a signal."""

OF_DEBUGGING = (
    r.RunPaused,
    r.RunResumed,
    r.RunYielded,
    r.BreakpointsSet,
    r.BreakpointReached,
    r.OperatorSetData,
    r.InputIgnored,
    r.InputDeferred,
)
"""Records that are there because the rehearsal is debugged, or differ when it is."""

Change: TypeAlias = AnswersModel | i.Input
"""What an author changes at a stop: how next visits of elements go, or an input that comes."""


@dataclass(frozen=True, slots=True)
class Stop:
    """Where a rehearsal has stopped. `moment`: number of records of the mission up to here. `t_s`:
    mission time in seconds. `reached`: why; None: the run has ended. `states`: of the simulated
    vehicles and payloads, by resource."""

    moment: int
    t_s: float
    reached: r.BreakpointReached | None
    summary: RunSummary
    states: Mapping[str, VehicleState | PayloadState]


class DebugSession:
    """A rehearsal under an author's control; as a context, it ends with it.

    `view` has the run at the stop: tokens, behaviors, prompts, waits. `stops`: where it has stopped
    on the way here, the last one being where it is.
    """

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet | None,
        *,
        plugins: PluginManager,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        answers: Answers | None = None,
        start_us: int = START_US,
        max_steps: int = MAX_STEPS,
    ) -> None:
        """Begin, and stop before the first step. The arguments are those of `rehearse`.

        Raises:
            MissionError, AnswersError, FleetError: as `rehearse`.
        """
        self._rehearser = Rehearser(mission, fleet, plugins, process)
        self._answers = answers or Answers()
        refuse_misfits(self._answers, mission, self._rehearser.fleet)
        self.mission = mission
        self._data = data
        self._start_us = start_us
        self._max_steps = max_steps
        self._changes: list[tuple[int, Change]] = []
        self._conditions: dict[str, None] = {}
        self.breakpoints = i.SetBreakpoints(by=BY)
        self.stops: list[Stop] = []
        self._rehearsed = self._begin()

    def __enter__(self) -> "DebugSession":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the rehearsal."""
        self._rehearsed.end()

    # --- where it is ------------------------------------------------------------------------------

    @property
    def here(self) -> Stop:
        """Where it has stopped."""
        return self.stops[-1]

    @property
    def view(self) -> RunView:
        """The run as operators would see it."""
        return self._rehearsed.view

    @property
    def records(self) -> Sequence[StampedRecord]:
        """The records up to here."""
        return self._rehearsed.records

    @property
    def ended(self) -> bool:
        """Whether the run has ended: only `go_back` goes on from there."""
        return self.here.reached is None

    def data(self) -> Sequence[ScopeData]:
        """The data of the data stores and of each active process, subprocess and task, from the
        outside in: what is not empty, and that of each process."""
        return self._rehearsed.data()

    def evaluate(self, expression: str) -> ExpressionValue:
        """The value of an expression, as the element sees the data that is next. Nothing changes.

        Raises:
            OperatorError: it cannot be read or evaluated, or the run has ended.
        """
        reached = self.here.reached
        if reached is None:
            raise OperatorError("the run has ended: go back to a moment before")
        return self._rehearsed.evaluate(expression, reached)

    def moment_at(self, t_s: float) -> int:
        """The moment of the last record before a mission time in seconds."""
        return sum(
            each.t_s < t_s and not isinstance(each.record, OF_DEBUGGING) for each in self.records
        )

    # --- going on ---------------------------------------------------------------------------------

    def step(self) -> Stop:
        """Execute one token; where all tokens wait, go on until one moves.

        Raises:
            OperatorError: the run has ended.
        """
        return self._go(i.StepRun(BY))

    def resume(self) -> Stop:
        """Go on to the next breakpoint, or to the end.

        Raises:
            OperatorError: the run has ended.
        """
        return self._go(i.ResumeRun(BY))

    def _go(self, item: i.Input) -> Stop:
        self._refuse_ended()
        self.stops.append(self._rehearsed.give(item))
        return self.here

    # --- changing ---------------------------------------------------------------------------------

    def set_breakpoints(self, elements: Sequence[str] = (), conditions: Sequence[str] = ()) -> None:
        """Stop where a token has come to one of the elements, and when a condition has become
        true, in place of the breakpoints before.

        Raises:
            OperatorError: an element is not there, or a condition cannot be read.
        """
        wanted = i.SetBreakpoints(tuple(elements), tuple(conditions), BY)
        if refusal := why_refused(self.mission, wanted):
            raise OperatorError(refusal)
        self.breakpoints = wanted
        self._conditions.update(dict.fromkeys(conditions))
        if not self.ended:
            self._rehearsed.give(wanted)

    def change(self, change: Change) -> None:
        """Change how next visits of elements go (an `AnswersModel`), or let an input come now:
        `SetData`, `SignalReceived`, `MessageReceived`, `PromptAnswer`, `ResourceFault`.

        Raises:
            OperatorError: the run has ended, or refuses the input.
            AnswersError: the mission has no such element, decision, signal or message.
        """
        self._refuse_ended()
        if isinstance(change, AnswersModel):
            refuse_misfits(Answers(change), self.mission, self._rehearser.fleet)
        moment = self._rehearsed.moment
        if refusal := self._rehearsed.change(change):
            raise OperatorError(refusal)
        self._changes.append((moment, change))

    def _refuse_ended(self) -> None:
        if self.ended:
            raise OperatorError("the run has ended: go back to a moment before")

    # --- going back -------------------------------------------------------------------------------

    def go_back(self, moment: int) -> Stop:
        """Go back to the first stop at which the mission had made `moment` records, or more. The
        changes that were made there, or later, are undone."""
        if moment > self.here.moment:
            raise OperatorError(
                f"the run has made {self.here.moment} records, and cannot go back to {moment}"
            )
        self._rehearsed.end()
        self._changes = [each for each in self._changes if each[0] < moment]
        before = [each for each in self.stops if each.moment < moment]
        self.stops = []
        self._rehearsed = self._begin()
        everywhere = tuple(node.id for node in self.mission.nodes)
        left = list(self._changes)
        self._rehearsed.give(i.SetBreakpoints(everywhere, tuple(self._conditions), BY))
        here = self.here
        while True:
            while left and left[0][0] <= self._rehearsed.moment:
                self._rehearsed.change(left.pop(0)[1])
            if here.moment >= moment or here.reached is None:
                break
            here = self._rehearsed.give(i.StepRun(BY))
        if here.reached is not None:
            self._rehearsed.give(self.breakpoints)
            reached = msgspec.structs.replace(here.reached, reason=r.StopReason.STEP)
            here = replace(here, reached=reached)
        self.stops = [*before, here]
        return here

    def _begin(self) -> "_Rehearsed":
        answers = Answers(copy.deepcopy(self._answers.model), self._answers.source)
        rehearsed = _Rehearsed(self, answers)
        self.stops.append(rehearsed.begin())
        return rehearsed


class _Rehearsed:
    """One rehearsal in its thread. `moment`: number of records of the mission up to here."""

    def __init__(self, session: DebugSession, answers: Answers) -> None:
        self._session = session
        self._answers = answers
        self.records: list[StampedRecord] = []
        self.moment = 0
        self.view = RunView(
            RunSummary("r1", session.mission.file, "", RunStatus.RUNNING, 0), session.mission
        )
        self._orders: SimpleQueue[Change] = SimpleQueue()
        self._answered: SimpleQueue[Stop | str | BaseException] = SimpleQueue()
        self._runner: Runner | None = None
        self._thread = threading.Thread(target=self._run, name="debugged rehearsal", daemon=True)

    # --- in the caller's thread -------------------------------------------------------------------

    def begin(self) -> Stop:
        """Begin, and return the stop before the first step."""
        self._thread.start()
        return self._next_stop()

    def give(self, item: i.Input) -> Stop:
        """Hand in an input, and return where the run stops then."""
        self._orders.put(item)
        return self._next_stop()

    def change(self, change: Change) -> str:
        """Make a change; return why it is refused, or ""."""
        there = len(self.records)
        self._orders.put(change)
        self._next_stop()
        for stamped in self.records[there:]:
            if isinstance(stamped.record, r.InputIgnored):
                return stamped.record.reason
        return ""

    def end(self) -> None:
        """End the rehearsal, and its thread."""
        if self._thread.is_alive():
            self._orders.put(i.StopRun(BY, "the author ends it"))
            self._thread.join()

    def data(self) -> Sequence[ScopeData]:
        """See `DebugSession.data`; nothing is executed meanwhile."""
        assert self._runner is not None
        return data_of(self._runner.run.state)

    def evaluate(self, expression: str, at: r.BreakpointReached) -> ExpressionValue:
        """See `DebugSession.evaluate`; nothing is executed meanwhile."""
        assert self._runner is not None
        state = self._runner.run.state
        return evaluate_at(state, expression, state.paused_at_us, at.token)

    def _next_stop(self) -> Stop:
        answer = self._answered.get()
        if isinstance(answer, BaseException):
            raise answer
        assert isinstance(answer, Stop)
        return answer

    # --- in the rehearsal's thread ----------------------------------------------------------------

    def _run(self) -> None:
        session = self._session
        rehearsal = Rehearsal(
            session._rehearser,
            self._answers,
            session._max_steps,
            self._see,
            False,
            None,
            self.acts,
        )
        try:
            summary = run_virtual(
                lambda clock: rehearsal.run(clock, session._data), session._start_us
            )
        except BaseException as error:  # the caller who waits for the next stop gets it
            self._answered.put(error)
        else:
            self._answered.put(Stop(self.moment, self.view.t_s, None, summary, {}))

    def _see(self, stamped: StampedRecord) -> None:
        self.records.append(stamped)
        self.view.apply(stamped)
        if not isinstance(stamped.record, OF_DEBUGGING):
            self.moment += 1

    def acts(self, runner: Runner, simulated: Sequence[SimArbiter], now_us: int) -> bool:
        """Stop here if the run is paused, until something is ordered."""
        self._runner = runner
        if runner.run.state.status is not EngineStatus.PAUSED:
            return False
        reached = self.view.reached
        if reached is None:
            raise InternalError("a debugged run is paused, and no breakpoint was reached")
        states: dict[str, VehicleState | PayloadState] = {
            each.resource: each
            for arbiter in simulated
            for each in arbiter.broadcast.all_at(now_us)
        }
        self._answered.put(Stop(self.moment, self.view.t_s, reached, self.view.summary, states))
        while isinstance(order := self._orders.get(), AnswersModel):
            self._answers.script_next(runner.id, order)
            self._answered.put(Stop(self.moment, self.view.t_s, reached, self.view.summary, states))
        runner.post(order)
        return True
