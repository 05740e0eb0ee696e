"""The moments of a run of the engine, made of its records: what is true in each.

They are the moments of the checker (docs/verification-internals.md): a step of a token, with all
that happens in it, is one; what completes is true in that moment alone, and a quiet one follows.
The state of a moment is that after the step. The order of records tells the steps apart.
"""

from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from typing import Any

from m2pem.engine import records as r
from m2pem.engine.state import BehaviorPhase, RunState
from m2pem.errors import ExpressionError
from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import EndEvent, Gateway, IntermediateThrowEvent, Process, SendTask
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.ltl.formula import Active, Commanded, Completed, Data, Ended, Proposition

_ROOT = 1
"""The scope of the process that a run begins with."""
_THROWING = (IntermediateThrowEvent, EndEvent, SendTask)
_SHARED = 0
"""The store of what all processes of a run share."""


class _Stage(IntEnum):
    """What the records since the last moment were, as far as it says which ones belong together."""

    NOTHING = 0
    CAUSE = 1
    """Why a token is going to move: a behavior has ended, data was written."""
    INTERRUPTED = 2
    COMPLETED = 3
    ENTERED = 4


class Moments:
    """Reads records, and gives the letter of each moment to `on_moment`.

    Bit n of a letter is set if the n-th of `propositions` is true. `state`: the bits that are true
    now, without completions.
    """

    def __init__(
        self,
        propositions: Sequence[Proposition],
        mission: Mission,
        fleet: Fleet | None,
        on_moment: Callable[[int], None],
    ) -> None:
        self.propositions = tuple(propositions)
        self.state = 0
        self._on_moment = on_moment
        self._elements = mission.elements
        self._teams = fleet.teams if fleet is not None else {}
        self._stage = _Stage.NOTHING
        self._has_completed = False
        self._left = 0
        self._left_element = ""
        self._caught_by = ""
        self._thrower = 0
        self._completed = 0
        self._process = ""
        self._active: dict[str, int] = {}
        self._when_completed: dict[str, int] = {}
        self._processes: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._commanded: list[tuple[int, frozenset[str], str]] = []
        self._ended: list[tuple[int, str]] = []
        self._read: dict[str, list[tuple[int, Data]]] = {}
        self._behaviors: dict[str, list[int]] = {}
        self._data: dict[int, dict[str, Value]] = {_ROOT: {}, _SHARED: {}}
        for number, each in enumerate(self.propositions):
            self._add(1 << number, each, mission)
        self._readers: dict[type, Callable[[Any], None]] = {
            r.RunStarted: self._run_started,
            r.RunEnded: self._run_ended,
            r.ScopeOpened: self._scope_opened,
            r.ScopeClosed: self._scope_closed,
            r.TokenEntered: self._token_entered,
            r.TokenLeft: self._token_left,
            r.BehaviorRequested: self._behavior_requested,
            r.BehaviorCancelRequested: self._behavior_over,
            r.BehaviorEnded: self._behavior_over,
            r.DataWritten: self._data_written,
            r.SignalThrown: self._thrown,
            r.MessageThrown: self._thrown,
            r.EscalationThrown: self._escalation_thrown,
            r.ScopeInterrupted: self._scope_interrupted,
        }

    def _add(self, bit: int, each: Proposition, mission: Mission) -> None:
        match each:
            case Active(element):
                known = mission.elements.get(element)
                by_element = self._processes if isinstance(known, Process) else self._active
                by_element[element] = by_element.get(element, 0) | bit
            case Completed(element):
                self._when_completed[element] = self._when_completed.get(element, 0) | bit
            case Commanded(resource, behavior):
                team = self._teams.get(resource)
                wanted = frozenset(spelled_out(team)) if team else frozenset({resource})
                self._commanded.append((bit, wanted, behavior))
            case Ended(outcome):
                self._ended.append((bit, outcome))
            case Data():
                for name in each.expression.names:
                    self._read.setdefault(name.partition(".")[0], []).append((bit, each))
                self._set(bit, self._holds(each))

    def extend(self, propositions: Sequence[Proposition], state: RunState) -> None:
        """Go on with a new version of the mission, and more propositions: those before come first.

        The new ones are as the state says, after all records that were read.
        """
        self._elements = state.mission.elements
        known = len(self.propositions)
        self.propositions = tuple(propositions)
        for number, each in enumerate(self.propositions[known:], known):
            self._add(1 << number, each, state.mission)
            self._take_from(state, 1 << number, each)

    def take_data(self, state: RunState) -> None:
        """Take what was written before from the state."""
        root = state.scopes.get(_ROOT)
        self._process = state.root.container.id if state.root is not None else ""
        self._data = {_ROOT: dict(root.data) if root else {}, _SHARED: dict(state.shared.data)}

    def _take_from(self, state: RunState, bit: int, each: Proposition) -> None:
        match each:
            case Active(element):
                self._count(bit, sum(token.node.id == element for token in state.tokens.values()))
                if element == self._process:
                    self._set(bit, True)
                elif element in self._processes:
                    there = (token.node.container.process.id for token in state.tokens.values())
                    self._count(bit, sum(process == element for process in there))
            case Commanded():
                _, wanted, name = self._commanded[-1]
                for behavior in state.behaviors.values():
                    meant = wanted <= {*behavior.resources} and name in ("", behavior.name)
                    if meant and behavior.phase is not BehaviorPhase.CANCELLING:
                        self._behaviors.setdefault(behavior.id, []).append(bit)
                        self._count(bit, 1)
            case Data():
                self._set(bit, self._holds(each))

    def read(self, records: Iterable[r.Record]) -> None:
        """Read the records of one input, in their order."""
        readers = self._readers
        for record in records:
            reader = readers.get(type(record))
            if reader is not None:
                reader(record)
        if self._stage:
            self._flush()

    def set_state(self, bits: int, value: int) -> None:
        """Set propositions that are in no record; that is a moment, too."""
        state = (self.state & ~bits) | value
        if state != self.state:
            self.state = state
            self._on_moment(state)

    # --- steps ----------------------------------------------------------------------------------

    def _flush(self) -> None:
        """The step is over: its moment, and the quiet one after completions."""
        self._stage = _Stage.NOTHING
        self._has_completed = False
        self._thrower = 0
        self._caught_by = ""
        if self._completed:
            letter, self._completed = self.state | self._completed, 0
            self._on_moment(letter)
        self._on_moment(self.state)

    def _flush_unless_thrown(self) -> None:
        """What a throw event causes elsewhere belongs to its own step, which comes last."""
        if not self._thrower:
            self._flush()

    def _begin(self, stage: _Stage, before: _Stage) -> None:
        """A record of a stage follows; after one of stage `before` or later a new step begins."""
        if self._stage >= before:
            self._flush_unless_thrown()
        self._stage = max(self._stage, stage)

    def _set(self, bits: int, value: bool) -> None:
        self.state = self.state | bits if value else self.state & ~bits

    def _count(self, bits: int, change: int) -> None:
        """Count what makes propositions true: they are while there is any of it."""
        counts = self._counts
        count = counts.get(bits, 0) + change
        counts[bits] = count
        if count > 0:
            self.state |= bits
        else:
            self.state &= ~bits

    # --- records --------------------------------------------------------------------------------

    def _run_started(self, record: r.RunStarted) -> None:
        self._process = record.process
        self._set(self._processes.get(record.process, 0), True)
        self._stage = _Stage.CAUSE

    def _run_ended(self, record: r.RunEnded) -> None:
        self._stage = _Stage.ENTERED
        self._set(self._processes.get(self._process, 0), False)
        for bit, outcome in self._ended:
            if outcome in ("", record.outcome.value):
                self.state |= bit

    def _scope_opened(self, record: r.ScopeOpened) -> None:
        if self._stage is _Stage.ENTERED:
            self._flush_unless_thrown()

    def _scope_closed(self, record: r.ScopeClosed) -> None:
        """A process has completed, which no token leaves."""
        if record.element == record.process and record.outcome is r.TokenOutcome.COMPLETED:
            self._begin(_Stage.COMPLETED, _Stage.COMPLETED)
            self._has_completed = True
            self._completed |= self._when_completed.get(record.element, 0)

    def _token_entered(self, record: r.TokenEntered) -> None:
        of_another_step = record.token != self._left and record.element != self._caught_by
        if not record.flow and self._has_completed and of_another_step:
            self._flush_unless_thrown()
        self._stage = _Stage.ENTERED
        bits = self._active.get(record.element)
        if bits:
            self._count(bits, 1)
        if self._processes:
            self._count_process(record.process, 1)

    def _token_left(self, record: r.TokenLeft) -> None:
        if record.outcome is r.TokenOutcome.COMPLETED:
            if not self._joins(record):
                self._begin(_Stage.COMPLETED, _Stage.COMPLETED)
            self._has_completed = True
            self._completed |= self._when_completed.get(record.element, 0)
        else:
            self._begin(_Stage.INTERRUPTED, _Stage.ENTERED)
        if record.token == self._thrower:
            self._thrower = 0
        self._left, self._left_element = record.token, record.element
        bits = self._active.get(record.element)
        if bits:
            self._count(bits, -1)
        if self._processes:
            self._count_process(record.process, -1)

    def _joins(self, record: r.TokenLeft) -> bool:
        """Whether the token leaves a join together with the one that left before."""
        return (
            self._stage is _Stage.COMPLETED
            and record.element == self._left_element
            and isinstance(self._elements.get(record.element), Gateway)
        )

    def _count_process(self, process: str, change: int) -> None:
        if process != self._process and (bits := self._processes.get(process)):
            self._count(bits, change)

    def _thrown(self, record: r.SignalThrown | r.MessageThrown | r.EscalationThrown) -> None:
        if isinstance(self._elements.get(record.element), _THROWING):
            self._begin(_Stage.CAUSE, _Stage.COMPLETED)
            self._thrower = record.token

    def _escalation_thrown(self, record: r.EscalationThrown) -> None:
        self._thrown(record)
        self._caught_by = record.caught_by

    def _scope_interrupted(self, record: r.ScopeInterrupted) -> None:
        """An event subprocess begins in the step that interrupts what is around it."""
        self._caught_by = record.element

    def _behavior_requested(self, record: r.BehaviorRequested) -> None:
        self._begin(_Stage.ENTERED, _Stage.CAUSE)
        held = frozenset(record.resources)
        bits = [
            bit
            for bit, wanted, behavior in self._commanded
            if wanted <= held and behavior in ("", record.name)
        ]
        if bits:
            self._behaviors[record.behavior] = bits
            for bit in bits:
                self._count(bit, 1)

    def _behavior_over(self, record: r.BehaviorEnded | r.BehaviorCancelRequested) -> None:
        """A behavior that is being cancelled counts no more, as in the net of the checker."""
        bits = self._behaviors.pop(record.behavior, ())
        self._begin(_Stage.CAUSE, _Stage.ENTERED)
        for bit in bits:
            self._count(bit, -1)

    def _data_written(self, record: r.DataWritten) -> None:
        self._begin(_Stage.CAUSE, _Stage.COMPLETED)
        store = self._data.get(record.store)
        if store is None or record.own:
            return
        store[record.key] = record.value
        for bit, each in self._read.get(record.key.partition(".")[0], ()):
            self._set(bit, self._holds(each))

    def _holds(self, each: Data) -> bool:
        try:
            return each.expression.holds(self._value)
        except ExpressionError:
            return False

    def _value(self, name: str) -> Value:
        """Read a name as the process that the run begins with sees it."""
        stores = (self._data[_ROOT], self._data[_SHARED])
        for store in stores:
            if name in store:
                return store[name]
        head, dot, tail = name.rpartition(".")
        while dot:
            for store in stores:
                value = store.get(head)
                if isinstance(value, dict):
                    return _entry(value, tail)
            head, dot, rest = head.rpartition(".")
            tail = f"{rest}.{tail}"
        return None


def _entry(value: Value, path: str) -> Value:
    for key in path.split("."):
        if not isinstance(value, dict):
            return None
        value = value.get(key)
    return value
