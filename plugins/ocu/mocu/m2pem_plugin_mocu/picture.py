"""One run, folded from its records: how it stands, and where its tokens are.

Times are of the executive's clock, in microseconds since the Unix epoch.
"""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from m2pem.api import RunStatus, RunSummary, StampedRecord
from m2pem.api import records as r

if TYPE_CHECKING:
    from m2pem.api import Mission

US_PER_S = 1_000_000

OF_THE_RUN = (r.RunStarted, r.RunClaimed, r.RunPaused, r.RunResumed, r.RunEnded)
OF_TOKENS = (r.TokenEntered, r.TokenLeft, r.BehaviorRequested, r.BehaviorEnded, r.RunEnded)


@dataclass(frozen=True, slots=True)
class Work:
    """A behavior that a token has commanded and waits for."""

    name: str
    resources: tuple[str, ...]


@dataclass(slots=True)
class Token:
    """A token on an element. `instance`: of a loop or multi-instance activity, which one."""

    element: str
    instance: int | None
    since_us: int
    work: dict[str, Work] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Active:
    """An element in which tokens are. `work`: what they have commanded."""

    element: str
    tokens: int
    since_us: int
    work: tuple[Work, ...]


class Picture:
    """Apply a run's records in order; those that are known change nothing."""

    def __init__(self, summary: RunSummary, mission: "Mission | None") -> None:
        self.summary = summary
        self.mission = mission
        self.seq = 0
        self.page_seq = 0
        """Up to here, the journal was read."""
        self.told_seq = 0
        """Up to here, operators were told."""
        self._tokens: dict[int, Token] = {}
        self._commanded_by: dict[str, int] = {}
        self._paused_us = 0
        self._paused_at_us = 0

    def label(self, element: str) -> str:
        """What the diagram calls an element."""
        found = self.mission.elements.get(element) if self.mission is not None else None
        return found.label if found is not None else element

    def at_us(self, mission_time_s: float) -> int:
        """When a mission time was, or is: pauses so far are counted in."""
        return self.summary.started_us + self._paused_us + round(mission_time_s * US_PER_S)

    def apply(self, stamped: StampedRecord) -> bool:
        """Take a record in. False: it was known already."""
        if stamped.seq <= self.seq:
            return False
        self.seq = stamped.seq
        self._of_run(stamped.record, stamped.t_s)
        self._of_tokens(stamped.record, stamped.t_s)
        return True

    def _of_run(self, record: r.Record, t_s: float) -> None:
        match record:
            case r.RunStarted():
                self._stands(RunStatus.RUNNING, process=record.process, started=record.started_us)
            case r.RunClaimed() if self.summary.status is RunStatus.INTERRUPTED:
                self._stands(RunStatus.PAUSED if self._paused_at_us else RunStatus.RUNNING)
            case r.RunPaused(at_us=at_us):
                self._paused_at_us = at_us
                self._stands(RunStatus.PAUSED)
            case r.RunResumed(at_us=at_us):
                self._paused_us += max(0, at_us - self._paused_at_us)
                self._paused_at_us = 0
                self._stands(RunStatus.RUNNING)
            case r.RunEnded(outcome=outcome, detail=detail):
                ended_us = max(self.at_us(t_s), self._paused_at_us)
                self._stands(RunStatus(outcome.value))
                self.summary = replace(self.summary, ended_us=ended_us, detail=detail)

    def _stands(self, status: RunStatus, *, process: str = "", started: int = 0) -> None:
        now = self.summary
        self.summary = replace(
            now,
            status=status,
            process=process or now.process,
            started_us=started or now.started_us,
        )

    def _of_tokens(self, record: r.Record, t_s: float) -> None:
        match record:
            case r.TokenEntered(token=token, element=element, instance=instance):
                self._tokens[token] = Token(element, instance, self.at_us(t_s))
            case r.TokenLeft(token=token):
                self._tokens.pop(token, None)
            case r.BehaviorRequested(token=token, behavior=behavior):
                if token in self._tokens:
                    self._commanded_by[behavior] = token
                    self._tokens[token].work[behavior] = Work(record.name, record.resources)
            case r.BehaviorEnded(behavior=behavior):
                token = self._commanded_by.pop(behavior, -1)
                if token in self._tokens:
                    self._tokens[token].work.pop(behavior, None)
            case r.RunEnded():
                self._tokens.clear()
                self._commanded_by.clear()

    def active(self) -> list[Active]:
        """The elements with tokens, in the order in which the first of them came."""
        found: dict[str, list[Token]] = {}
        for token in self._tokens.values():
            found.setdefault(token.element, []).append(token)
        return [_active(element, tokens) for element, tokens in found.items()]


def _active(element: str, tokens: list[Token]) -> Active:
    # An activity with several instances has a token of its own, which is none of them.
    instances = [token for token in tokens if token.instance is not None]
    return Active(
        element,
        len(instances) or len(tokens),
        min(token.since_us for token in tokens),
        tuple(work for token in tokens for work in token.work.values()),
    )
