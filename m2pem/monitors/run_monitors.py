"""The monitors of one run: they read its records, and find what is certain of its requirements.

    monitors = RunMonitors(run.state, fleet)
    monitors.observe(step.t_us, step.records)       # after each input, also in a replay
    monitors.advance(t_us)                          # at `due_us`, if nothing came before
    for item in monitors.take(): ...                # inputs for the run: `RequirementDecided`,
                                                    # `RequirementLeftOpen`

Pure: a verdict depends on the records and their mission times alone, so a replay finds the same.

When the mission is revised, a requirement of the same formula goes on, and its monitor with what it
knows. Another one is monitored from the revision on, as if the run began there.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from m2pem.engine import records as r
from m2pem.engine.inputs import (
    RequirementDecided,
    RequirementLeftOpen,
    TelemetryConditionChanged,
)
from m2pem.engine.state import RunState, RunStatus
from m2pem.fleet.fleet import Fleet

if TYPE_CHECKING:
    from m2pem.monitors.anticipation import Verdict
    from m2pem.monitors.moments import Moments
    from m2pem.monitors.monitor import MonitorPlan, Plans, TimedMonitor
    from m2pem.monitors.product import Position, Product, State
    from m2pem.monitors.telemetry_conditions import Latest
    from m2pem.verify.ltl.formula import Measured, Proposition

ENDED = "the run has ended"
STOPPED = "the run was stopped"
NOT_CERTAIN = "its end does not decide it"
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
        self._timed_mask = 0
        self._product: Product | None = None
        self._at: State | None = None
        self._names: tuple[str, ...] = ()
        self._recorded: set[str] = set()
        self._found: dict[str, RequirementDecided | RequirementLeftOpen] = {}
        self._conditions: dict[str, tuple[int, Measured]] = {}
        self._measured: dict[str, bool | None] = {}
        self._mission = state.mission
        self._unknown = 0
        self._was_unknown = 0
        self._was_known = 0
        self._t_us = 0

    # --- records and time -----------------------------------------------------------------------

    def observe(self, t_us: int, records: Sequence[r.Record]) -> None:
        """Read the records of one input. `t_us`: their mission time."""
        state = self._state
        moments = self._moments
        begins = moments is None and self._begins(records)
        if begins:
            self._begin([each for each in records if type(each) is r.RequirementMonitored])
            moments = self._moments
        if moments is not None:
            if self._conditions and not begins:
                self._read_conditions(t_us, records)
            if self._timed:
                self.advance(t_us)
            self._t_us = t_us
            moments.read(records)
        if len(self._recorded) != len(state.verdicts):
            for record in records:
                if type(record) is r.RequirementDecided or type(record) is r.RequirementLeftOpen:
                    self._note(record.requirement)
        if state.mission is not self._mission:
            self._mission = state.mission
            self._t_us = t_us
            self._revise(records)
        if self._open:
            if state.status is RunStatus.ENDED:
                for record in records:
                    if type(record) is r.RunEnded:
                        self._end(record)
        elif moments is not None:
            self._read_no_more()

    @staticmethod
    def _begins(records: Sequence[r.Record]) -> bool:
        return bool(records) and type(records[0]) is r.RunStarted

    def advance(self, t_us: int) -> None:
        """Mission time has passed without a record."""
        if (least := self.due_us) is None or least > t_us:
            return
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
        least: int | None = None
        for each in self._timed.values():
            due_us = each.evaluation.due_us
            if due_us is not None and (least is None or due_us < least):
                least = due_us
        return least

    @property
    def propositions(self) -> "Sequence[Proposition]":
        """What the letters of the run are about."""
        return self._moments.propositions if self._moments is not None else ()

    def positions(self) -> "dict[str, Position | None]":
        """Where the monitor of each open requirement is; None: its formula has bounds."""
        from m2pem.monitors.product import Position  # noqa: PLC0415  # as in `_begin`

        found: dict[str, Position | None] = dict.fromkeys(self._open)
        at = self._at.parts if self._at is not None else ()
        for name, state in zip(self._names, at, strict=True):
            untimed = self._open[name].untimed if name in self._open else None
            if untimed is not None:
                found[name] = Position(*untimed, state)
        return found

    def take(self) -> list[RequirementDecided | RequirementLeftOpen]:
        """Return what has become certain, and is not recorded yet; each once."""
        if not self._found:
            return []
        found, self._found = list(self._found.values()), {}
        return found

    def _begin(self, monitored: Sequence[r.RequirementMonitored]) -> None:
        if not monitored:
            return
        # What reads formulas takes time to load, and most runs have none.
        from m2pem.monitors.moments import NO_LETTER, Moments  # noqa: PLC0415
        from m2pem.monitors.monitor import plans, tables  # noqa: PLC0415

        made = plans(tuple(each.formula for each in monitored))
        mission = self._state.mission
        self._moments = Moments(made.known, mission, self._fleet, self._read, tables(made, mission))
        self._add(monitored, made)
        # What telemetry has said before the start is true from the first moment on, to come.
        self._moments.letter = NO_LETTER
        self._product, self._at = made.product, made.product.start

    def _add(self, monitored: Sequence[r.RequirementMonitored], made: "Plans") -> None:
        """Monitor requirements from now on."""
        from m2pem.monitors.monitor import TimedMonitor  # noqa: PLC0415  # as in `_begin`

        for each, plan in zip(monitored, made.each, strict=True):
            self._open[each.requirement] = plan
            if plan.timed is not None:
                self._timed[each.requirement] = TimedMonitor(plan, plan.timed)
                self._timed_mask |= plan.mask
        self._names = tuple(name for name, plan in self._open.items() if plan.timed is None)
        for bit, text, condition in made.measured:
            if text not in self._conditions:
                self._conditions[text] = (bit, condition)
                self._measured[text] = now = self._state.telemetry_conditions.get(text)
                if now is None:
                    self._unknown |= bit
                    self._was_unknown |= bit
                elif self._moments is not None:
                    self._was_known |= bit
                    self._moments.set_bit(bit, now)

    def _read_no_more(self) -> None:
        """All is decided: records say nothing new, unless the mission is revised."""
        self._moments = None
        self._product = self._at = None
        self._names = ()
        self._conditions.clear()
        self._unknown = self._was_unknown = self._was_known = 0

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
        from m2pem.monitors.monitor import Plans  # noqa: PLC0415
        from m2pem.monitors.product import Product  # noqa: PLC0415

        if self._moments is None:
            self._moments = Moments((), self._state.mission, self._fleet, self._read)
        moments = self._moments
        made = Plans(tuple(each.formula for each in begun), moments.propositions)
        moments.extend(made.known, self._state)
        moments.letter = moments.state
        states = dict(zip(self._names, self._at.parts if self._at else (), strict=True))
        self._add(begun, made)
        for each in begun:
            states.pop(each.requirement, None)
        parts = [self._open[name].untimed for name in self._names]
        self._product = product = Product([each for each in parts if each is not None])
        begin = zip(self._names, product.start.parts, strict=True)
        self._at = product.state_of(tuple(states.get(name, start) for name, start in begin))
        self._read_moment(moments.letter, _NO_LETTER, ~0, FROM_THE_REVISION)

    def _goes_on(self, requirement: str) -> bool:
        return any(requirement in each for each in (self._open, self._recorded, self._found))

    def _read(self, letter: int, before: int) -> None:
        """Read a moment. `before`: the letter of the one before it."""
        changed = letter ^ before if before != _NO_LETTER else ~0
        self._read_moment(letter, before, changed, BEGINNING)

    def _read_moment(self, letter: int, before: int, changed: int, otherwise: str) -> None:
        """Have monitors read a moment. `changed`: the bits that differ from the moment before;
        `otherwise`: what made a verdict certain if none does."""
        product, at = self._product, self._at
        certain: list[tuple[str, Verdict]] = []
        first = before == _NO_LETTER  # a formula may be decided whatever its propositions are
        if at is not None and product is not None and (changed & product.mask or first):
            # Written out, as most moments of long runs end here.
            after = None if self._unknown else at.after.get(letter & product.mask)
            if after is None:
                after = product.step(at, letter, self._unknown)
            if after is not at or first:
                self._at = after
                known = () if first else at.certain
                if len(after.certain) != len(known):
                    certain = [
                        (self._names[place], verdict)
                        for place, verdict in after.certain
                        if (place, verdict) not in known
                    ]
        if changed & self._timed_mask:
            for name, each in self._timed.items():
                if changed & each.mask:
                    verdict = each.read(self._t_us, letter, self._unknown)
                    if verdict.is_certain:
                        certain.append((name, verdict))
        for name, verdict in certain:
            if name in self._open:
                because = self._because(name, letter, 0 if before == _NO_LETTER else before)
                self._decide(name, verdict, self._t_us, because or otherwise)

    def _because(self, name: str, letter: int, before: int) -> str:
        from m2pem.monitors.monitor import english_of  # noqa: PLC0415  # as in `_begin`

        return self._open[name].changes(before, letter, english_of(self._state.mission))

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
        moments, bit = self._moments, self._conditions[text][0]
        before, unknown = moments.letter, self._unknown
        self._measured[text] = now
        if now is None:
            self._unknown |= bit
            self._was_unknown |= bit
        else:
            self._unknown &= ~bit
            self._was_known |= bit
        if unknown == self._unknown and bool(before & bit) == bool(now):
            return
        moments.set_bit(bit, bool(now))
        if unknown & bit and now is not None:  # it becomes known, so it counts as a change
            before = moments.letter ^ bit
        self._read_moment(moments.letter, before, bit, BEGINNING)

    # --- verdicts -------------------------------------------------------------------------------

    def _end(self, record: r.RunEnded) -> None:
        """Decide all, unless operators have stopped the run: it could have gone on. Say why what
        stays open does."""
        if record.outcome is not r.RunOutcome.STOPPED:
            certain: list[tuple[str, Verdict]] = []
            moments = self._moments
            if self._product is not None and self._at is not None and moments is not None:
                found = self._product.at_end(self._at, moments.letter, self._unknown)
                certain += [(self._names[place], verdict) for place, verdict in found]
            for name, each in self._timed.items():
                verdict = each.evaluation.end()
                if verdict.is_certain:
                    certain.append((name, verdict))
            for name, verdict in certain:
                if name in self._open:
                    self._decide(name, verdict, self._t_us, ENDED)
        stopped = [STOPPED] if record.outcome is r.RunOutcome.STOPPED else []
        for name, plan in self._open.items():
            because = [*stopped, *self._not_known(plan.mask)] or [NOT_CERTAIN]
            self._found[name] = RequirementLeftOpen(name, ", ".join(because))
        self._open.clear()
        self._timed.clear()

    def _decide(self, name: str, verdict: "Verdict", t_us: int, because: str) -> None:
        del self._open[name]
        self._timed.pop(name, None)
        if name not in self._recorded:
            decided = r.RequirementVerdict(verdict.value)
            self._found[name] = RequirementDecided(name, decided, t_us, because)

    def _not_known(self, mask: int) -> list[str]:
        """What telemetry did not say, or not all the time, of conditions."""
        from m2pem.verify.requirements.english import measured_subject  # noqa: PLC0415  # as above

        found: dict[str, bool] = {}
        for bit, condition in self._conditions.values():
            if bit & mask & self._was_unknown:
                subject, known = measured_subject(condition), bool(bit & self._was_known)
                found[subject] = found.get(subject, False) or known
        return [
            f"{subject} was not known all the time" if known else f"nothing was known of {subject}"
            for subject, known in found.items()
        ]

    def _note(self, requirement: str) -> None:
        """A verdict is recorded, perhaps by an earlier release: it stays."""
        self._recorded.add(requirement)
        self._found.pop(requirement, None)
        self._open.pop(requirement, None)
        self._timed.pop(requirement, None)
