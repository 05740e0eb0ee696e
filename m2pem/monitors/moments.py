"""The moments of a run of the engine, made of its records: what is true in each.

They are the moments of the checker (docs/verification-internals.md): a step of a token, with all
that happens in it, is one; what completes is true in that moment alone, and a quiet one follows.
The state of a moment is that after the step. The order of records tells the steps apart.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Self

from m2pem.engine import records as r
from m2pem.engine.state import BehaviorPhase, RunState
from m2pem.errors import ExpressionError
from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import EndEvent, Gateway, IntermediateThrowEvent, Process, SendTask
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value, value_within
from m2pem.verify.ltl.formula import Active, Commanded, Completed, Data, Ended, Proposition

_ROOT = 1
"""The scope of the process that a run begins with."""
NO_LETTER = -1
"""The letter before the first moment."""
_THROWING = (IntermediateThrowEvent, EndEvent, SendTask)
_SHARED = 0
"""The store of what all processes of a run share."""


_NOTHING, _CAUSE, _INTERRUPTED, _COMPLETED, _ENTERED = range(5)
"""What the records since the last moment were, as far as it says which ones belong together.
`_CAUSE`: why a token is going to move: a behavior has ended, data was written."""


class MomentTables:
    """Which records say something of which propositions; the same for all runs of a mission."""

    def __init__(self, propositions: Sequence[Proposition], mission: Mission) -> None:
        self.active: dict[str, int] = {}
        self.completed: dict[str, int] = {}
        self.processes: dict[str, int] = {}
        self.commanded: list[tuple[int, Commanded]] = []
        self.ended: list[tuple[int, str]] = []
        self.conditions: list[tuple[int, Data]] = []
        self.data: dict[str, list[tuple[int, Data]]] = {}
        """By the first part of the names that a condition reads."""
        for number, each in enumerate(propositions):
            bit = 1 << number
            match each:
                case Active(element):
                    is_process = isinstance(mission.elements.get(element), Process)
                    (self.processes if is_process else self.active)[element] = bit
                case Completed(element):
                    self.completed[element] = bit
                case Commanded():
                    self.commanded.append((bit, each))
                case Ended(outcome):
                    self.ended.append((bit, outcome))
                case Data():
                    self.conditions.append((bit, each))
                    for name in each.expression.names:
                        self.data.setdefault(name.partition(".")[0], []).append((bit, each))
        self.elements = frozenset((*self.active, *self.completed))
        """Those whose tokens change a proposition."""


class Moments:
    """Reads records, and gives the letter of each moment, and that of the moment before, to
    `on_moment`. A moment that is as the one before is left out.

    Bit n of a letter is set if the n-th of `propositions` is true. `state`: the bits that are true
    now, without completions. `letter`: that of the last moment; -1 before the first one.
    """

    def __init__(
        self,
        propositions: Sequence[Proposition],
        mission: Mission,
        fleet: Fleet | None,
        on_moment: Callable[[int, int], None],
        tables: MomentTables | None = None,
    ) -> None:
        """`tables`: those of the propositions and the mission, if they are made already."""
        self.propositions = tuple(propositions)
        self.state = 0
        self.letter = NO_LETTER
        self._on_moment = on_moment
        self._teams = fleet.teams if fleet is not None else {}
        self._stage = _NOTHING
        self._has_completed = False
        self._left = 0
        self._left_element = ""
        self._caught_by = ""
        self._thrower = 0
        self._completed = 0
        self._process = ""
        self._counts: dict[int, int] = {}
        self._behaviors: dict[str, list[int]] = {}
        self._data: dict[int, dict[str, Value]] = {_ROOT: {}, _SHARED: {}}
        self._follow(tables or MomentTables(self.propositions, mission), mission)
        for bit, each in self._tables.conditions:
            self._set(bit, self._holds(each))

    def _follow(self, tables: MomentTables, mission: Mission) -> None:
        self._tables = tables
        self._elements = mission.elements
        self._active, self._when_completed = tables.active, tables.completed
        self._processes = tables.processes
        self._meant: dict[tuple[tuple[str, ...], str], list[int]] = {}

    def extend(self, propositions: Sequence[Proposition], state: RunState) -> None:
        """Go on with a new version of the mission, and more propositions: those before come first.

        The new ones are as the state says, after all records that were read.
        """
        known = len(self.propositions)
        self.propositions = tuple(propositions)
        self._follow(MomentTables(self.propositions, state.mission), state.mission)
        self._take_state(state, known)

    @classmethod
    def after(
        cls,
        state: RunState,
        propositions: Sequence[Proposition],
        fleet: Fleet | None,
        on_moment: Callable[[int, int], None],
        tables: MomentTables,
    ) -> Self:
        """Go on from a state in which no input is half done, as if all records had been read."""
        moments = cls(propositions, state.mission, fleet, on_moment, tables)
        moments._take_state(state, 0)
        moments.letter = moments.state
        return moments

    def _take_state(self, state: RunState, known: int) -> None:
        """Take propositions from the state, but the first `known`."""
        self.take_data(state)
        for number, each in enumerate(self.propositions[known:], known):
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
                for behavior in state.behaviors.values():
                    meant = self._is_meant(each, behavior.resources, behavior.name)
                    if meant and behavior.phase is not BehaviorPhase.CANCELLING:
                        self._behaviors.setdefault(behavior.id, []).append(bit)
                        self._count(bit, 1)
            case Data():
                self._set(bit, self._holds(each))

    def _is_meant(self, each: Commanded, resources: Iterable[str], behavior: str) -> bool:
        """Whether a behavior of resources is one that a proposition is about."""
        team = self._teams.get(each.resource)
        wanted = spelled_out(team) if team else (each.resource,)
        return each.behavior in ("", behavior) and {*wanted} <= {*resources}

    def read(self, records: Sequence[r.Record]) -> None:
        """Read the records of one input, in their order."""
        if not self._may_change(records):
            return
        readers = _READERS
        for record in records:
            reader = readers.get(type(record))
            if reader is not None:
                reader(self, record)
        if self._stage:
            self._flush()
        self._left, self._left_element, self._caught_by = 0, "", ""

    def _may_change(self, records: Sequence[r.Record]) -> bool:
        """Whether any of the records of an input changes a proposition.

        The records of others only tell moments apart, which are all as the one before.
        """
        elements, processes = self._tables.elements, self._processes
        for record in records:
            if type(record) is r.TokenEntered or type(record) is r.TokenLeft:
                if record.element in elements or record.process in processes:
                    return True
            elif (changes := _CHANGES.get(type(record))) and changes(self, record):
                return True
        return False

    def set_bit(self, bit: int, value: bool) -> None:
        """Set a proposition that no record is about: from now on, and in the last moment."""
        self._set(bit, value)
        self.letter = self.state

    # --- steps ----------------------------------------------------------------------------------

    def _flush(self) -> None:
        """The step is over: its moment, and the quiet one after completions."""
        self._stage = _NOTHING
        self._has_completed = False
        self._thrower = 0
        self._caught_by = ""
        if self._completed:
            before, self.letter = self.letter, self.state | self._completed
            self._completed = 0
            if self.letter != before:
                self._on_moment(self.letter, before)
        if self.state != self.letter:
            before, self.letter = self.letter, self.state
            self._on_moment(self.letter, before)

    def _flush_unless_thrown(self) -> None:
        """What a throw event causes elsewhere belongs to its own step, which comes last."""
        if not self._thrower:
            self._flush()

    def _begin(self, stage: int, before: int) -> None:
        """A record of a stage follows; after one of stage `before` or later a new step begins."""
        if self._stage >= before and not self._thrower:
            self._flush()
        if self._stage < stage:  # noqa: PLR1730  # `max` costs a call
            self._stage = stage

    def _set(self, bits: int, value: bool) -> None:
        self.state = self.state | bits if value else self.state & ~bits

    def _count(self, bits: int, change: int) -> None:
        """Count what makes propositions true: they are while there is any of it."""
        count = self._counts.get(bits, 0) + change
        self._counts[bits] = count
        if count > 0:
            self.state |= bits
        else:
            self.state &= ~bits

    # --- records --------------------------------------------------------------------------------

    def _run_started(self, record: r.RunStarted) -> None:
        self._process = record.process
        self._set(self._processes.get(record.process, 0), True)
        self._stage = _CAUSE

    def _run_ended(self, record: r.RunEnded) -> None:
        self._stage = _ENTERED
        self._set(self._processes.get(self._process, 0), False)
        for bit, outcome in self._tables.ended:
            if outcome in ("", record.outcome.value):
                self.state |= bit

    def _scope_opened(self, record: r.ScopeOpened) -> None:
        if self._stage == _ENTERED:
            self._flush_unless_thrown()

    def _scope_closed(self, record: r.ScopeClosed) -> None:
        """A process has completed, which no token leaves."""
        if record.element == record.process and record.outcome is r.TokenOutcome.COMPLETED:
            self._begin(_COMPLETED, _COMPLETED)
            self._has_completed = True
            self._completed |= self._when_completed.get(record.element, 0)

    def _token_entered(self, record: r.TokenEntered) -> None:
        if (
            self._has_completed
            and not record.flow
            and record.token != self._left
            and record.element != self._caught_by
        ):
            self._flush_unless_thrown()
        self._stage = _ENTERED
        bits = self._active.get(record.element)
        if bits:
            self._count(bits, 1)
        if self._processes:
            self._count_process(record.process, 1)

    def _token_left(self, record: r.TokenLeft) -> None:
        element = record.element
        if record.outcome is r.TokenOutcome.COMPLETED:
            if not self._joins(element):
                self._begin(_COMPLETED, _COMPLETED)
            self._has_completed = True
            self._completed |= self._when_completed.get(element, 0)
        else:
            self._begin(_INTERRUPTED, _ENTERED)
        if record.token == self._thrower:
            self._thrower = 0
        self._left, self._left_element = record.token, element
        bits = self._active.get(element)
        if bits:
            self._count(bits, -1)
        if self._processes:
            self._count_process(record.process, -1)

    def _joins(self, element: str) -> bool:
        """Whether the token leaves a join together with the one that left before."""
        return (
            self._stage == _COMPLETED
            and element == self._left_element
            and isinstance(self._elements.get(element), Gateway)
        )

    def _count_process(self, process: str, change: int) -> None:
        if process != self._process and (bits := self._processes.get(process)):
            self._count(bits, change)

    def _thrown(self, record: r.SignalThrown | r.MessageThrown | r.EscalationThrown) -> None:
        if isinstance(self._elements.get(record.element), _THROWING):
            self._begin(_CAUSE, _COMPLETED)
            self._thrower = record.token

    def _error_thrown(self, record: r.ErrorThrown) -> None:
        """A task fails in a step of its own token, not in that of a token that has completed."""
        if self._stage == _COMPLETED and record.token != self._left:
            self._begin(_CAUSE, _COMPLETED)

    def _escalation_thrown(self, record: r.EscalationThrown) -> None:
        self._thrown(record)
        self._caught_by = record.caught_by

    def _scope_interrupted(self, record: r.ScopeInterrupted) -> None:
        """An event subprocess begins in the step that interrupts what is around it."""
        self._caught_by = record.element

    def _bits_of(self, record: r.BehaviorRequested) -> list[int]:
        """What a requested behavior makes true."""
        key = (record.resources, record.name)
        bits = self._meant.get(key)
        if bits is None:
            bits = self._meant[key] = [
                bit for bit, each in self._tables.commanded if self._is_meant(each, *key)
            ]
        return bits

    def _behavior_requested(self, record: r.BehaviorRequested) -> None:
        self._begin(_ENTERED, _CAUSE)
        bits = self._bits_of(record)
        if bits:
            self._behaviors[record.behavior] = bits
            for bit in bits:
                self._count(bit, 1)

    def _behavior_over(self, record: r.BehaviorEnded | r.BehaviorCancelRequested) -> None:
        """A behavior that is being cancelled counts no more, as in the net of the checker."""
        bits = self._behaviors.pop(record.behavior, ())
        self._begin(_CAUSE, _ENTERED)
        for bit in bits:
            self._count(bit, -1)

    def _data_written(self, record: r.DataWritten) -> None:
        self._begin(_CAUSE, _COMPLETED)
        read = self._tables.data.get(record.key.partition(".")[0])
        if not read or record.own or record.store not in self._data:
            return
        self._data[record.store][record.key] = record.value
        for bit, each in read:
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
                    return value_within(value, tail)
            head, dot, rest = head.rpartition(".")
            tail = f"{rest}.{tail}"
        return None


_READERS: Mapping[type, Callable[[Moments, Any], None]] = {
    r.RunStarted: Moments._run_started,
    r.RunEnded: Moments._run_ended,
    r.ScopeOpened: Moments._scope_opened,
    r.ScopeClosed: Moments._scope_closed,
    r.TokenEntered: Moments._token_entered,
    r.TokenLeft: Moments._token_left,
    r.BehaviorRequested: Moments._behavior_requested,
    r.BehaviorCancelRequested: Moments._behavior_over,
    r.BehaviorEnded: Moments._behavior_over,
    r.DataWritten: Moments._data_written,
    r.SignalThrown: Moments._thrown,
    r.MessageThrown: Moments._thrown,
    r.ErrorThrown: Moments._error_thrown,
    r.EscalationThrown: Moments._escalation_thrown,
    r.ScopeInterrupted: Moments._scope_interrupted,
}
_CHANGES: Mapping[type, Callable[[Moments, Any], object]] = {
    r.RunStarted: lambda moments, record: True,
    r.RunEnded: lambda moments, record: True,
    r.ScopeClosed: lambda moments, record: record.element in moments._when_completed,
    r.BehaviorRequested: lambda moments, record: moments._bits_of(record),
    r.BehaviorCancelRequested: lambda moments, record: record.behavior in moments._behaviors,
    r.BehaviorEnded: lambda moments, record: record.behavior in moments._behaviors,
    r.DataWritten: lambda moments, record: record.key.partition(".")[0] in moments._tables.data,
}
"""By kind of record, apart from those of tokens, whether it may change a proposition."""
