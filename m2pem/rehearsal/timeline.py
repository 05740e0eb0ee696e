"""What a run's records say about who was busy when: the matter of a Gantt chart."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.api.runs import StampedRecord
from m2pem.engine import records as r
from m2pem.mission.catalogue import BehaviorState


class Outcome(StrEnum):
    """The end of the behavior, prompt or service of a bar."""

    SUCCEEDED = "succeeded"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    ANSWERED = "answered"
    OPEN = "not ended"


@dataclass(slots=True)
class Span:
    """A behavior, service or prompt. Times are mission time in seconds.

    `what`: the behavior, service class or decision; `element`: where in the mission; `note`: an
    error code, or who answered.
    """

    start_s: float
    end_s: float
    what: str
    element: str
    outcome: Outcome = Outcome.OPEN
    note: str = ""


@dataclass(frozen=True, slots=True)
class Mark:
    """Something thrown: a signal, message, escalation or error. `label`: where, or by whom."""

    t_s: float
    kind: str
    label: str
    note: str = ""


@dataclass(slots=True)
class Timeline:
    """`resources`: spans of each resource that was commanded, in order of their start. `waits`:
    tasks that waited for resources."""

    process: str = ""
    started_us: int = 0
    end_s: float = 0.0
    ended_s: float | None = None
    outcome: str = ""
    detail: str = ""
    prompts: list[Span] = field(default_factory=list)
    waits: list[Span] = field(default_factory=list)
    services: list[Span] = field(default_factory=list)
    resources: dict[str, list[Span]] = field(default_factory=dict)
    marks: list[Mark] = field(default_factory=list)


def read_timeline(records: Iterable[StampedRecord]) -> Timeline:
    """Read the records of one run, in their order."""
    reader = _Reader()
    for stamped in records:
        reader.take(stamped.t_s, stamped.record)
    reader.finish()
    return reader.line


_BEHAVIOR_OUTCOMES = {
    BehaviorState.SUCCEEDED: Outcome.SUCCEEDED,
    BehaviorState.CANCELLED: Outcome.INTERRUPTED,
}


class _Reader:
    def __init__(self) -> None:
        self.line = Timeline()
        self._open: dict[str, Span] = {}
        self._asked: dict[str, tuple[float, r.AllocationRequested]] = {}

    def take(self, t_s: float, record: r.Record) -> None:
        line = self.line
        line.end_s = max(line.end_s, t_s)
        match record:
            case r.RunStarted():
                line.process, line.started_us = record.process, record.started_us
            case r.RunEnded():
                line.outcome, line.detail = record.outcome.value, record.detail
                line.ended_s = t_s
            case r.AllocationRequested() | r.AllocationDelayed():
                self._ask(t_s, record)
            case r.ResourcesAllocated() | r.AllocationEnded():
                self._end_asking(t_s, record)
            case r.BehaviorRequested():
                span = self._begin(t_s, record.behavior, record.name, record.element)
                for resource in record.resources:
                    line.resources.setdefault(resource, []).append(span)
            case r.BehaviorEnded():
                outcome = _BEHAVIOR_OUTCOMES.get(record.state, Outcome.FAILED)
                self._end(t_s, record.behavior, outcome, record.code)
            case r.PromptOpened():
                line.prompts.append(self._begin(t_s, record.prompt, "", record.element))
            case r.PromptAnswered():
                span = self._open[record.prompt]
                span.what = record.decision
                self._end(t_s, record.prompt, Outcome.ANSWERED, f"by {record.by}")
            case r.PromptWithdrawn():
                self._end(t_s, record.prompt, Outcome.INTERRUPTED, "withdrawn")
            case r.ServiceRequested():
                span = self._begin(t_s, record.service, record.name, record.element)
                line.services.append(span)
            case r.ServiceEnded():
                outcome = Outcome.FAILED if record.code else Outcome.SUCCEEDED
                self._end(t_s, record.service, outcome, record.code)
            case r.ServiceWithdrawn():
                self._end(t_s, record.service, Outcome.INTERRUPTED)
            case r.SignalThrown():
                self._mark(t_s, "signal", _thrower(record, record.signal), record.signal)
            case r.MessageThrown():
                self._mark(t_s, "message", _thrower(record, record.message), record.message)
            case r.EscalationThrown():
                self._mark(t_s, "escalation", record.element, record.code)
            case r.ErrorThrown():
                label = f"{record.code} from {record.element}"
                self._mark(t_s, "error", label, record.reason)
            case _:
                pass

    def finish(self) -> None:
        """Let bars without an end last to the end of the records."""
        for span in self._open.values():
            span.end_s = self.line.end_s

    def _ask(self, t_s: float, record: r.AllocationRequested | r.AllocationDelayed) -> None:
        if isinstance(record, r.AllocationRequested):
            self._asked[record.allocation] = (t_s, record)
        elif record.allocation not in self._open:
            since_s, asked = self._asked[record.allocation]
            span = self._begin(since_s, record.allocation, asked.name, asked.element)
            self.line.waits.append(span)

    def _end_asking(self, t_s: float, record: r.ResourcesAllocated | r.AllocationEnded) -> None:
        del self._asked[record.allocation]
        if record.allocation not in self._open:
            return  # it did not wait
        if isinstance(record, r.ResourcesAllocated):
            given = ", ".join(each for resources in record.roles.values() for each in resources)
            self._end(t_s, record.allocation, Outcome.SUCCEEDED, given)
        else:
            outcome = Outcome.FAILED if record.code else Outcome.INTERRUPTED
            self._end(t_s, record.allocation, outcome, record.code)

    def _begin(self, t_s: float, key: str, what: str, element: str) -> Span:
        span = self._open[key] = Span(t_s, t_s, what, element)
        return span

    def _end(self, t_s: float, key: str, outcome: Outcome, note: str = "") -> None:
        span = self._open.pop(key)
        span.end_s, span.outcome, span.note = t_s, outcome, note

    def _mark(self, t_s: float, kind: str, label: str, note: str) -> None:
        self.line.marks.append(Mark(t_s, kind, label, note))


def _thrower(record: r.SignalThrown | r.MessageThrown, thrown: str) -> str:
    """The element that threw it; from outside, who sent what (an id may be a UUID)."""
    shown = thrown if len(thrown) <= 16 else f"{thrown[:8]}\u2026"
    return record.element or f"{shown} by {record.by}"
