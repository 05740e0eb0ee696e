"""The requirements that a run is monitored for, and what is certain of each, by its records."""

from collections import Counter
from collections.abc import Iterable, Sequence

import msgspec

from m2pem.api import records as r
from m2pem.engine.state import RunState
from m2pem.units import US_PER_S


class RequirementState(msgspec.Struct):
    """A requirement that a run is monitored for. `verdict`: "open": it holds so far, or has not
    come yet; "satisfied" or "violated": whatever follows, since mission time `since_s`. `because`:
    what made it certain, or why the end of the run has left it open. `elements`: those that it is
    about. `formula`: see docs/requirements.md. `on_violation`: what a violation does to the
    mission, "" for nothing. `recorded_s`: mission time of the record of the verdict, which may come
    after `since_s`. `conditions`: what telemetry says of its conditions now; None: nothing."""

    id: str
    english: str
    elements: tuple[str, ...] = ()
    verdict: str = "open"
    since_s: float | None = None
    because: str = ""
    formula: str = ""
    on_violation: str = ""
    recorded_s: float | None = None
    conditions: dict[str, bool | None] = msgspec.field(default_factory=dict)

    def __str__(self) -> str:
        """What is certain of it, in a line."""
        since = "" if self.since_s is None else f" since {self.since_s:.1f} s"
        text = f"{self.id} is {self.verdict}{since}: {self.english.rstrip('.')}"
        return f"{text} ({self.reason})" if self.reason else text

    @property
    def reason(self) -> str:
        """`because`, and while it is open: of what telemetry says nothing now; "" for nothing."""
        if self.because or self.verdict != "open":
            return self.because
        unknown = [text for text, holds in self.conditions.items() if holds is None]
        if not unknown:
            return ""
        # What reads formulas takes time to load, and most runs have no such conditions.
        from m2pem.verify.ltl import parse  # noqa: PLC0415
        from m2pem.verify.ltl.formula import Measured  # noqa: PLC0415
        from m2pem.verify.requirements.english import measured_subject  # noqa: PLC0415

        read = (parse(each) for each in unknown)
        subjects = (measured_subject(each) for each in read if isinstance(each, Measured))
        return f"nothing is known of {', '.join(dict.fromkeys(subjects))}"


_ORDER = ("violated", "open", "satisfied")
_READ = frozenset(
    (
        r.RequirementMonitored,
        r.RequirementDropped,
        r.RequirementDecided,
        r.RequirementLeftOpen,
        r.TelemetryConditionChanged,
        r.RunClaimed,
    )
)


def worst_first(requirements: Iterable[RequirementState]) -> list[RequirementState]:
    """Return what is violated, then what is open, then what is satisfied."""
    return sorted(requirements, key=lambda each: _ORDER.index(each.verdict))


def in_short(requirements: Iterable[RequirementState]) -> str:
    """Return how many there are of each verdict: "1 violated, 2 satisfied"."""
    counts = Counter(each.verdict for each in requirements)
    return ", ".join(f"{counts[each]} {each}" for each in _ORDER if counts[each])


class RequirementStates(dict[str, RequirementState]):
    """The requirements of one run, by id."""

    def take(self, record: r.Record, t_s: float) -> Sequence[str]:
        """Read the next record; `t_s`: its mission time. Return the ids of the requirements that
        it changes."""
        if type(record) not in _READ:
            return ()
        match record:
            case r.RequirementMonitored(requirement=name):
                self._monitor(record)
                return [name]
            case r.RequirementDropped(requirement=name):
                self.pop(name, None)
                return [name]
            case r.RequirementDecided(requirement=name) | r.RequirementLeftOpen(requirement=name):
                self._decide(record, t_s)
                return [name]
            case r.TelemetryConditionChanged(condition=text, holds=holds):
                return self._set(text, holds)
            case r.RunClaimed():  # no executive has looked since the last record
                known = {text for each in self.values() for text in each.conditions}
                return [name for text in known for name in self._set(text, None)]
            case _:
                return []

    def _monitor(self, record: r.RequirementMonitored) -> None:
        known = self.get(record.requirement)
        if known is not None:  # in the words of a new version of the mission
            known.english, known.elements = record.english, record.elements
            known.on_violation = record.on_violation
            return
        read = {text: holds for each in self.values() for text, holds in each.conditions.items()}
        self[record.requirement] = RequirementState(
            record.requirement,
            record.english,
            record.elements,
            formula=record.formula,
            on_violation=record.on_violation,
            conditions={text: read.get(text) for text in record.conditions},
        )

    def _decide(self, record: r.RequirementDecided | r.RequirementLeftOpen, t_s: float) -> None:
        state = self.get(record.requirement)
        if state is None:
            return
        state.because = record.because
        if isinstance(record, r.RequirementDecided):
            state.verdict = record.verdict.value
            state.since_s = record.decided_us / US_PER_S
            state.recorded_s = t_s

    def _set(self, text: str, holds: bool | None) -> list[str]:
        found = [each for each in self.values() if text in each.conditions]
        for each in found:
            each.conditions[text] = holds
        return [each.id for each in found]


def requirements_of(state: RunState) -> RequirementStates:
    """Return those of a run, by its state: without `recorded_s`."""
    states = RequirementStates()
    for monitored in state.requirements.values():
        states.take(monitored, 0.0)
    for text, holds in state.telemetry_conditions.items():
        states.take(r.TelemetryConditionChanged(text, holds), 0.0)
    for judged in state.verdicts.values():
        states.take(judged, 0.0)
    for each in states.values():
        each.recorded_s = None
    return states
