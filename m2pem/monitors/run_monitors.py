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
    from m2pem.monitors.monitor import MonitorPlan, TimedMonitor
    from m2pem.monitors.product import Product, State
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
        self._open: dict[str, MonitorPlan] = {}
        self._timed: dict[str, TimedMonitor] = {}
        self._product: Product | None = None
        self._product_state: State = ()
        self._names: tuple[str, ...] = ()
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
        moments = self._moments
        if moments is None:
            if any(type(each) is r.MissionRevised for each in records):
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
            elif type(record) is r.MissionRevised:
                self._revise(records)

    def advance(self, t_us: int) -> None:
        """Mission time has passed without a record."""
        for name, each in list(self._timed.items()):
            while (due_us := each.evaluation.due_us) is not None and due_us <= t_us:
                verdict = each.evaluation.advance(due_us)
                if verdict.is_certain:
                    # A bound belongs to its interval: it is over in the next microsecond.
                    self._decide(name, verdict, due_us - 1, TIME_IS_OVER)

    @property
    def due_us(self) -> int | None:
        """The mission time at which time alone may make a verdict certain; None: it cannot."""
        if not self._timed:
            return None
        dues = (each.evaluation.due_us for each in self._timed.values())
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
    ) -> None:
        """Monitor requirements from now on. `known`: the propositions of the run's letters."""
        from m2pem.monitors.monitor import TimedMonitor  # noqa: PLC0415  # as in `_begin`
        from m2pem.monitors.product import product_of  # noqa: PLC0415
        from m2pem.verify.ltl.formula import Measured, show_measured  # noqa: PLC0415

        states = dict(zip(self._names, self._product_state, strict=True))
        for each, plan in zip(monitored, planned, strict=True):
            self._open[each.requirement] = plan
            states.pop(each.requirement, None)
            if plan.timed is not None:
                self._timed[each.requirement] = TimedMonitor(plan, plan.timed)
        parts = {name: plan.untimed for name, plan in self._open.items() if plan.untimed}
        self._names = tuple(parts)
        self._product = product_of(tuple(parts.values()))
        begun = zip(self._names, self._product.start, strict=True)
        self._product_state = tuple(states.get(name, start) for name, start in begun)
        for bit, named in enumerate(known):
            if isinstance(named, Measured) and show_measured(named) not in self._conditions:
                self._conditions[show_measured(named)] = (1 << bit, named)
                self._unknown |= 1 << bit

    def _revise(self, records: Iterable[r.Record]) -> None:
        """Follow the requirements of a new version of the mission."""
        dropped = [each.requirement for each in records if type(each) is r.RequirementDropped]
        for number in dropped:
            self._open.pop(number, None)
            self._timed.pop(number, None)
            self._found.pop(number, None)
            self._recorded.discard(number)
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
        self._add(begun, planned, known)
        self._read_moment(~0, _NO_LETTER, FROM_THE_REVISION)

    def _goes_on(self, requirement: str) -> bool:
        return any(requirement in each for each in (self._open, self._recorded, self._found))

    def _read(self, letter: int) -> None:
        before = self._letter
        if letter != before:
            self._letter = letter
            changed = ~0 if before == _NO_LETTER else letter ^ before
            self._read_moment(changed, before, BEGINNING)

    def _read_moment(self, changed: int, before: int, otherwise: str) -> None:
        """Have monitors read a moment. `changed`: the bits that differ from the moment before;
        `otherwise`: what made a verdict certain if none does."""
        letter, unknown = self._letter, self._unknown
        certain: list[tuple[str, Verdict]] = []
        product = self._product
        if product is not None and changed & product.mask:
            self._product_state, found = product.step(self._product_state, letter, unknown)
            for place, verdict in found:
                certain.append((self._names[place], verdict))
        for name, each in self._timed.items():
            if changed & each.mask:
                verdict = each.read(self._t_us, letter, unknown)
                if verdict.is_certain:
                    certain.append((name, verdict))
        for name, verdict in certain:
            if name in self._open:
                because = self._because(name, 0 if before == _NO_LETTER else before)
                self._decide(name, verdict, self._t_us, because or otherwise)

    def _because(self, name: str, before: int) -> str:
        from m2pem.monitors.monitor import english_of  # noqa: PLC0415  # as in `_begin`

        return self._open[name].changes(before, self._letter, english_of(self._state.mission))

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
        self._read_moment(bit, before, BEGINNING)

    # --- verdicts -------------------------------------------------------------------------------

    def _end(self, record: r.RunEnded) -> None:
        """Decide all, unless operators have stopped the run: it could have gone on."""
        if record.outcome is not r.RunOutcome.STOPPED:
            certain: list[tuple[str, Verdict]] = []
            if self._product is not None:
                found = self._product.at_end(self._product_state, self._letter, self._unknown)
                certain += [(self._names[place], verdict) for place, verdict in found]
            for name, each in self._timed.items():
                verdict = each.evaluation.end()
                if verdict.is_certain:
                    certain.append((name, verdict))
            for name, verdict in certain:
                if name in self._open:
                    self._decide(name, verdict, self._t_us, ENDED)
        self._open.clear()
        self._timed.clear()

    def _decide(self, name: str, verdict: "Verdict", t_us: int, because: str) -> None:
        del self._open[name]
        self._timed.pop(name, None)
        if name not in self._recorded:
            decided = r.RequirementVerdict(verdict.value)
            self._found[name] = RequirementDecided(name, decided, t_us, because)

    def _note(self, requirement: str) -> None:
        """A verdict is recorded, perhaps by an earlier release: it stays."""
        self._recorded.add(requirement)
        self._found.pop(requirement, None)
        self._open.pop(requirement, None)
        self._timed.pop(requirement, None)
