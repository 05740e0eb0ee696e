"""One run folded from its records: which elements are active, what is commanded, how it stands.

What has changed since somebody last asked is kept in sets, so that a record costs the same
whatever the number of browsers.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import msgspec

from m2pem.api import RunStatus, RunSummary, StampedRecord
from m2pem.api import records as r

US_PER_S = 1_000_000

NEWEST = 200
"""Records that are kept for event logs."""

Place: TypeAlias = tuple[str, str]
"""A process and an element of it."""


class ElementState(msgspec.Struct):
    """What the page shows of an element. `last`: mission time of its last change, in seconds."""

    active: int = 0
    hits: int = 0
    last: float = 0.0
    failed: bool = False
    asking: bool = False


class Command(msgspec.Struct, frozen=True):
    """A behavior that has not ended. `since`: mission time, in seconds."""

    name: str
    resources: tuple[str, ...]
    process: str
    element: str
    since: float


class Seen:
    """An element: its state, the prompts that stand there, and its state as JSON."""

    __slots__ = ("asked", "encoded", "state")

    def __init__(self) -> None:
        self.state = ElementState()
        self.asked: set[str] = set()
        self.encoded: msgspec.Raw | None = None


class Picture:
    """Apply a run's records in order, without a gap."""

    def __init__(self, summary: RunSummary) -> None:
        self.summary = summary
        self.seq = 0
        """Of the last record: as they count from 1 without a gap, how many there were."""
        self.page_seq = 0
        """Up to here, whole pages of the journal were read."""
        self.t_s = 0.0
        self.elements: dict[Place, Seen] = {}
        self.commands: dict[str, Command] = {}
        self.asked: dict[str, Place] = {}
        """Where each prompt that stands was asked."""
        self.newest: deque[StampedRecord] = deque(maxlen=NEWEST)
        self.dirty: set[Place] = set()
        self.dirty_commands: set[str] = set()
        self.dirty_summary = False
        self._around: set[int] = set()
        """Tokens that wait on an activity around its instances, and are none of them."""
        self._paused_us = 0
        self._paused_at_us = 0

    def apply(self, stamped: StampedRecord) -> None:
        """Take in the record after the last one."""
        self.seq = stamped.seq
        self.t_s = stamped.t_s
        self.newest.append(stamped)
        fold = _FOLDS.get(type(stamped.record))
        if fold is not None:
            fold(self, stamped.record, stamped.t_s)

    def encoded(self, place: Place) -> msgspec.Raw:
        """The state of an element as JSON; made once, for however many browsers."""
        seen = self.elements[place]
        if seen.encoded is None:
            seen.encoded = msgspec.Raw(_encode(seen.state))
        return seen.encoded

    def counted(self) -> RunSummary:
        """The summary, with the number of records up to now."""
        return replace(self.summary, records=self.seq)

    def interrupted(self) -> None:
        """No executive drives the run: its records cannot say so."""
        self._stands(status=RunStatus.INTERRUPTED)

    # --- the run --------------------------------------------------------------------------------

    def _stands(self, **changes: Any) -> None:
        self.summary = replace(self.summary, **changes)
        self.dirty_summary = True

    def _started(self, record: r.RunStarted, _: float) -> None:
        self._stands(status=RunStatus.RUNNING, process=record.process, started_us=record.started_us)

    def _claimed(self, _: r.RunClaimed, __: float) -> None:
        self._stands(status=RunStatus.PAUSED if self._paused_at_us else RunStatus.RUNNING)

    def _paused(self, record: r.RunPaused, _: float) -> None:
        self._paused_at_us = record.at_us
        self._stands(status=RunStatus.PAUSED)

    def _resumed(self, record: r.RunResumed, _: float) -> None:
        self._paused_us += max(0, record.at_us - self._paused_at_us)
        self._paused_at_us = 0
        self._stands(status=RunStatus.RUNNING)

    def _ended(self, record: r.RunEnded, t_s: float) -> None:
        at_us = self.summary.started_us + self._paused_us + round(t_s * US_PER_S)
        self._stands(
            status=RunStatus(record.outcome.value),
            ended_us=max(at_us, self._paused_at_us),
            detail=record.detail,
        )
        for place, seen in self.elements.items():
            if seen.state.active or seen.asked:
                seen.state.active = 0
                seen.asked.clear()
                self._changed(place, seen, t_s)
        self.asked.clear()
        self._around.clear()

    # --- tokens ---------------------------------------------------------------------------------

    def _entered(self, record: r.TokenEntered, t_s: float) -> None:
        place = (record.process, record.element)
        seen = self.elements.get(place)
        if seen is None:
            seen = self.elements[place] = Seen()
        seen.state.active += 1
        seen.state.hits += 1
        seen.state.failed = False
        self._changed(place, seen, t_s)

    def _left(self, record: r.TokenLeft, t_s: float) -> None:
        place = (record.process, record.element)
        seen = self.elements.get(place)
        if seen is None:
            return
        if record.token in self._around:
            self._around.discard(record.token)
        else:
            seen.state.active -= 1
        seen.state.failed = record.outcome is r.TokenOutcome.FAILED
        self._changed(place, seen, t_s)

    def _opened(self, record: r.ScopeOpened, _: float) -> None:
        """Instances are counted in its place, where a token waits around some."""
        seen = self.elements.get((record.process, record.element))
        if record.instances is not None and record.token is not None and seen is not None:
            self._around.add(record.token)
            seen.state.active -= 1
            seen.state.hits -= 1

    def _changed(self, place: Place, seen: Seen, t_s: float) -> None:
        seen.state.asking = bool(seen.asked)
        seen.state.last = t_s
        seen.encoded = None
        self.dirty.add(place)

    # --- what tokens wait for -------------------------------------------------------------------

    def _requested(self, record: r.BehaviorRequested, t_s: float) -> None:
        self.commands[record.behavior] = Command(
            record.name, record.resources, record.process, record.element, t_s
        )
        self.dirty_commands.add(record.behavior)

    def _behavior_ended(self, record: r.BehaviorEnded, _: float) -> None:
        self.commands.pop(record.behavior, None)
        self.dirty_commands.add(record.behavior)

    def _asked(self, record: r.PromptOpened, t_s: float) -> None:
        place = (record.process, record.element)
        self.asked[record.prompt] = place
        seen = self.elements.setdefault(place, Seen())
        seen.asked.add(record.prompt)
        self._changed(place, seen, t_s)

    def _no_more_asked(self, record: r.PromptAnswered | r.PromptWithdrawn, t_s: float) -> None:
        place = self.asked.pop(record.prompt, None)
        seen = self.elements.get(place) if place is not None else None
        if place is not None and seen is not None:
            seen.asked.discard(record.prompt)
            self._changed(place, seen, t_s)


_encode = msgspec.json.Encoder().encode

_FOLDS: dict[type, Callable[[Picture, Any, float], None]] = {
    r.RunStarted: Picture._started,
    r.RunClaimed: Picture._claimed,
    r.RunPaused: Picture._paused,
    r.RunResumed: Picture._resumed,
    r.RunEnded: Picture._ended,
    r.TokenEntered: Picture._entered,
    r.TokenLeft: Picture._left,
    r.ScopeOpened: Picture._opened,
    r.BehaviorRequested: Picture._requested,
    r.BehaviorEnded: Picture._behavior_ended,
    r.PromptOpened: Picture._asked,
    r.PromptAnswered: Picture._no_more_asked,
    r.PromptWithdrawn: Picture._no_more_asked,
}
