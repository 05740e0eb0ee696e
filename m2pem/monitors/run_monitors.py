"""The monitors of one run: they read its records, and find what is certain of its requirements.

    monitors = RunMonitors(run.state, fleet)
    monitors.observe(step.t_us, step.records)       # after each input, also in a replay
    monitors.advance(t_us)                          # at `due_us`, if nothing came before
    for item in monitors.take(): ...                # inputs for the run: `RequirementDecided`

Pure: a verdict depends on the records and their mission times alone, so a replay finds the same.

When the mission is revised, a requirement of the same formula goes on, and its monitor with what it
knows. Another one is monitored from the revision on, as if the run began there.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from m2pem.engine import records as r
from m2pem.engine.inputs import RequirementDecided, TelemetryConditionChanged
from m2pem.engine.state import RunState
from m2pem.fleet.fleet import Fleet

if TYPE_CHECKING:
    from m2pem.monitors.anticipation import Verdict
    from m2pem.monitors.moments import Moments
    from m2pem.monitors.monitor import Monitor, MonitorPlan
    from m2pem.monitors.telemetry_conditions import Latest
    from m2pem.verify.ltl.formula import Measured, Proposition

ENDED = "the run has ended"
BEGINNING = "from the beginning"
FROM_THE_REVISION = "as the mission was revised"
TIME_IS_OVER = "its time is over"
_NO_LETTER = -1


class RunMonitors:
    """The monitors of one run. Records `RequirementMonitored` say which there are."""

    def __init__(self, state: RunState, fleet: Fleet | None) -> None:
        """`state`: of the run, to which records are applied before they are observed."""
        self._state = state
        self._fleet = fleet
        self._moments: Moments | None = None
        self._open: dict[str, Monitor] = {}
        self._timed: list[Monitor] = []
        self._recorded: set[str] = set()
        self._found: dict[str, RequirementDecided] = {}
        self._conditions: dict[str, tuple[int, Measured]] = {}
        self._measured: dict[str, bool | None] = {}
        self._letter = _NO_LETTER
        self._unknown = 0
        self._t_us = 0

    # --- records and time -----------------------------------------------------------------------

    def observe(self, t_us: int, records: Sequence[r.Record]) -> None:
        """Read the records of one input. `t_us`: their mission time."""
        revised = any(type(each) is r.MissionRevised for each in records)
        moments = self._moments
        if moments is None:
            if revised:
                self._t_us = t_us
                self._revise(records)
                return
            if not records or type(records[0]) is not r.RunStarted:
                return
            self._begin([each for each in records if type(each) is r.RequirementMonitored])
            moments = self._moments
            if moments is None:
                return
        if self._conditions:
            self._read_conditions(t_us, records)
        if self._timed:
            self.advance(t_us)
        self._t_us = t_us
        moments.read(records)
        for record in records:
            if type(record) is r.RunEnded:
                self._end(record)
            elif type(record) is r.RequirementDecided:
                self._note(record.requirement)
        if revised:
            self._revise(records)

    def advance(self, t_us: int) -> None:
        """Mission time has passed without a record."""
        for each in [each for each in self._timed if each.id in self._open]:
            while (due_us := each.evaluation.due_us) is not None and due_us <= t_us:
                if self._is_certain(each, each.evaluation.advance(due_us)):
                    # A bound belongs to its interval: it is over in the next microsecond.
                    self._decide(each, due_us - 1, TIME_IS_OVER)

    @property
    def due_us(self) -> int | None:
        """The mission time at which time alone may make a verdict certain; None: it cannot."""
        if not self._timed:
            return None
        dues = (each.evaluation.due_us for each in self._timed if each.id in self._open)
        return min((due for due in dues if due is not None), default=None)

    def take(self) -> list[RequirementDecided]:
        """Return what has become certain, and is not recorded yet; each once."""
        if not self._found:
            return []
        found, self._found = list(self._found.values()), {}
        return found

    def _begin(self, monitored: Sequence[r.RequirementMonitored]) -> None:
        if not monitored:
            return
        # What reads formulas takes time to load, and most runs have none.
        from m2pem.monitors.moments import Moments  # noqa: PLC0415
        from m2pem.monitors.monitor import plans  # noqa: PLC0415

        known, planned = plans(tuple(each.formula for each in monitored))
        self._moments = Moments(known, self._state.mission, self._fleet, self._read)
        self._add(monitored, planned, known)

    def _add(
        self,
        monitored: Sequence[r.RequirementMonitored],
        planned: "Sequence[MonitorPlan]",
        known: "Sequence[Proposition]",
    ) -> "list[Monitor]":
        """Monitor requirements from now on. `known`: the propositions of the run's letters."""
        from m2pem.monitors.monitor import Monitor  # noqa: PLC0415  # as in `_begin`
        from m2pem.verify.ltl.formula import Measured, show_measured  # noqa: PLC0415

        added = [
            Monitor(each.requirement, plan) for each, plan in zip(monitored, planned, strict=True)
        ]
        self._open |= {each.id: each for each in added}
        self._timed = [each for each in self._open.values() if each.is_timed]
        for bit, each in enumerate(known):
            if isinstance(each, Measured) and show_measured(each) not in self._conditions:
                self._conditions[show_measured(each)] = (1 << bit, each)
                self._unknown |= 1 << bit
        return added

    def _revise(self, records: Iterable[r.Record]) -> None:
        """Follow the requirements of a new version of the mission."""
        dropped = [each.requirement for each in records if type(each) is r.RequirementDropped]
        for number in dropped:
            self._open.pop(number, None)
            self._found.pop(number, None)
            self._recorded.discard(number)
        self._timed = [each for each in self._open.values() if each.is_timed]
        begun = [
            each
            for each in records
            if type(each) is r.RequirementMonitored and not self._goes_on(each.requirement)
        ]
        if not begun:
            if self._moments is not None:
                self._moments.extend(self._moments.propositions, self._state)
            return
        from m2pem.monitors.moments import Moments  # noqa: PLC0415  # as in `_begin`
        from m2pem.monitors.monitor import plans  # noqa: PLC0415

        if self._moments is None:
            self._moments = Moments((), self._state.mission, self._fleet, self._read)
            self._moments.take_data(self._state)
        before = self._moments.propositions
        known, planned = plans(tuple(each.formula for each in begun), before)
        self._moments.extend(known, self._state)
        self._letter = self._moments.state
        for each in self._add(begun, planned, known):
            if self._is_certain(each, each.read(self._t_us, self._letter, self._unknown)):
                self._decide(each, self._t_us, FROM_THE_REVISION)

    def _goes_on(self, requirement: str) -> bool:
        return any(requirement in each for each in (self._open, self._recorded, self._found))

    def _read(self, letter: int) -> None:
        before = self._letter
        if letter == before:
            return
        self._letter = letter
        self._read_changed(before, ~0 if before == _NO_LETTER else letter ^ before)

    def _read_changed(self, before: int, changed: int) -> None:
        """Have those monitors read a moment that something has changed for."""
        letter, unknown, t_us = self._letter, self._unknown, self._t_us
        first = before == _NO_LETTER
        certain = [
            each
            for each in self._open.values()
            if (first or changed & each.mask)
            and self._is_certain(each, each.read(t_us, letter, unknown))
        ]
        for each in certain:
            self._decide(each, t_us, self._because(each, 0 if first else before) or BEGINNING)

    def _because(self, monitor: "Monitor", before: int) -> str:
        from m2pem.monitors.monitor import english_of  # noqa: PLC0415  # as in `_begin`

        return monitor.changes(before, self._letter, english_of(self._state.mission))

    # --- telemetry ------------------------------------------------------------------------------

    @property
    def conditions(self) -> "list[Measured]":
        """The conditions on telemetry in requirements that are open."""
        mask = 0
        for each in self._open.values():
            mask |= each.mask
        return [condition for bit, condition in self._conditions.values() if bit & mask]

    def measure(self, resource: str, latest: "Latest") -> list[TelemetryConditionChanged]:
        """Return what telemetry says now of the conditions on a vehicle that it did not say before.

        `latest`: the newest states.
        """
        if not self._conditions:
            return []
        from m2pem.monitors.telemetry_conditions import holds  # noqa: PLC0415  # as in `_begin`

        found = []
        for text, (_, condition) in self._conditions.items():
            if resource in condition.resources:
                now = holds(condition, latest)
                if now is not self._measured.get(text):
                    self._measured[text] = now
                    found.append(TelemetryConditionChanged(text, now))
        return found

    def _read_conditions(self, t_us: int, records: Iterable[r.Record]) -> None:
        for record in records:
            if type(record) is r.RunClaimed:
                # No executive has looked since the last record.
                for text in self._conditions:
                    self._set_condition(text, None)
            elif type(record) is r.TelemetryConditionChanged:
                self.advance(t_us)
                self._t_us = t_us
                self._set_condition(record.condition, record.holds)

    def _set_condition(self, text: str, now: bool | None) -> None:
        if text not in self._conditions or self._moments is None:
            return
        bit = self._conditions[text][0]
        before, unknown = self._letter, self._unknown
        self._measured[text] = now
        self._unknown = self._unknown | bit if now is None else self._unknown & ~bit
        if unknown == self._unknown and bool(before & bit) == bool(now):
            return
        self._moments.state = self._moments.state | bit if now else self._moments.state & ~bit
        self._letter = self._moments.state
        self._read_changed(before, bit)

    # --- verdicts -------------------------------------------------------------------------------

    def _is_certain(self, monitor: "Monitor", verdict: "Verdict") -> bool:
        monitor.verdict = verdict
        return verdict.is_certain

    def _end(self, record: r.RunEnded) -> None:
        """Decide all, unless operators have stopped the run: it could have gone on."""
        if record.outcome is not r.RunOutcome.STOPPED:
            for each in list(self._open.values()):
                if self._is_certain(each, each.evaluation.end()):
                    self._decide(each, self._t_us, ENDED)
        self._open.clear()

    def _decide(self, monitor: "Monitor", t_us: int, because: str) -> None:
        del self._open[monitor.id]
        if monitor.id not in self._recorded:
            verdict = r.RequirementVerdict(monitor.verdict.value)
            self._found[monitor.id] = RequirementDecided(monitor.id, verdict, t_us, because)

    def _note(self, requirement: str) -> None:
        """A verdict is recorded, perhaps by an earlier release: it stays."""
        self._recorded.add(requirement)
        self._found.pop(requirement, None)
        self._open.pop(requirement, None)
