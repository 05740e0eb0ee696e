"""An entry of the schedule: what is to start and when, and what became of its times so far.

The journal keeps both parts. A plan never changes; the state is replaced, and counts its revisions,
so that of two executives which change an entry at once the second one is refused. The words are
those of others: `cron` and time zone, starting deadline and concurrency policy of Kubernetes'
CronJob, hold and release of batch queues.
"""

from enum import StrEnum
from pathlib import PurePath
from typing import Any, TypeAlias

import msgspec

from m2pem.mission.library import Source
from m2pem.mission.values import Value

EntryId: TypeAlias = str
"""s1, s2, ... in a journal."""

KEPT_TIMES = 100
"""Of each entry: what became of its last times."""


class Missed(StrEnum):
    """What becomes of a time whose starting deadline has passed."""

    SKIP = "skip"
    RUN_ONCE = "run-once"


class Concurrency(StrEnum):
    """What becomes of a time while the run of the entry's time before goes on."""

    FORBID = "forbid"
    ALLOW = "allow"


class When(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """When a mission is to start. Without `at` and `cron` it is due at once, one time.

    `at`: a date and time (ISO 8601). `cron`: a cron text, as for timer events. `time_zone`: of
    both, an IANA name; "": that of the executive's host. `until`: the last moment of a start.
    `after`: a run or an entry; the mission starts when that has ended with one of `outcomes`.
    `condition`: over the facts of a vehicle, true of each of `vehicles` (none: of all that the
    mission names) for `held_for_s`. `starting_deadline_s`: how long after its time a start may
    come; None: `STARTING_DEADLINE_S`, and no limit without `at` and `cron`.
    """

    at: str = ""
    cron: str = ""
    time_zone: str = ""
    until: str = ""
    after: str = ""
    outcomes: tuple[str, ...] = ("completed",)
    condition: str = ""
    vehicles: tuple[str, ...] = ()
    held_for_s: float = 0.0
    starting_deadline_s: float | None = None
    missed: Missed = Missed.SKIP
    concurrency: Concurrency = Concurrency.FORBID


class SchedulePlan(msgspec.Struct, frozen=True):
    """What is to start: the mission itself with its library, its process and data.

    `fleet`: the name of the fleet whose executive starts it; `simulated`: whether nothing in that
    fleet was real. `by`: who scheduled it, at `scheduled_us` of the executive's clock.
    """

    mission_name: str
    mission: bytes
    process: str
    fleet: str
    scheduled_us: int
    when: When = When()
    library: tuple[Source, ...] = ()
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    simulated: bool = True
    priority: int = 0
    by: str = ""

    @property
    def title(self) -> str:
        """What operators call the mission: its file's name, without folder and suffix."""
        return PurePath(self.mission_name).stem


class Settlement(StrEnum):
    """What became of a time of an entry."""

    STARTED = "started"
    MISSED = "missed"
    REFUSED = "refused"


class SettledTime(msgspec.Struct, frozen=True, omit_defaults=True):
    """What became of a time: of several that were missed together, of the last of `times`.

    Times are microseconds since the Unix epoch by the executive's clock. `run`: what was started.
    `owed`: the time had been missed before, and this start stands for it, or was given up.
    """

    due_us: int
    at_us: int
    settlement: Settlement
    run: str = ""
    text: str = ""
    times: int = 1
    owed: bool = False


class EntryStatus(StrEnum):
    """Whether an entry may still start something. FAILED: `check` refuses its mission now."""

    ACTIVE = "active"
    ENDED = "ended"
    CANCELLED = "cancelled"
    FAILED = "failed"


class Hold(msgspec.Struct, frozen=True):
    """Nothing starts until an operator releases it. `at_us`: by the executive's clock."""

    by: str = ""
    reason: str = ""
    at_us: int = 0

    def __str__(self) -> str:
        who = f"held by {self.by}" if self.by else "held"
        return f"{who}: {self.reason}" if self.reason else who


class EntryState(msgspec.Struct, frozen=True, omit_defaults=True):
    """How an entry stands.

    `settled_us`: what became of all its times up to this one is settled. `owed_us`: a missed time
    for which it starts once (`Missed.RUN_ONCE`); 0: none. `run`: the last that it started;
    `judged_run`: the last whose end was looked at, as an entry whose run has failed is held.
    `times`: the last `KEPT_TIMES` that were settled. `detail`: why it has ended, failed or was
    cancelled.
    """

    settled_us: int
    owed_us: int = 0
    status: EntryStatus = EntryStatus.ACTIVE
    run: str = ""
    judged_run: str = ""
    hold: Hold | None = None
    times: tuple[SettledTime, ...] = ()
    detail: str = ""
    revision: int = 0

    @property
    def active(self) -> bool:
        """Whether it may still start something."""
        return self.status is EntryStatus.ACTIVE

    @property
    def end(self) -> str:
        """How it is over, in words: "ended: it has started r1"."""
        detail = self.detail or f"it has started {self.run}"
        return detail if detail.startswith(self.status.value) else f"{self.status.value}: {detail}"

    def changed(self, **fields: Any) -> "EntryState":
        """Return the next state, with other values of some fields."""
        return msgspec.structs.replace(self, **fields, revision=self.revision + 1)

    def cancelled(self, by: str) -> "EntryState":
        """Return the state after someone has cancelled the entry."""
        detail = f"cancelled by {by or 'an operator'}"
        return self.changed(status=EntryStatus.CANCELLED, detail=detail, owed_us=0)


class ScheduleEntry(msgspec.Struct, frozen=True):
    """An entry as the journal has it."""

    id: EntryId
    plan: SchedulePlan
    state: EntryState


class EntryChange(msgspec.Struct, frozen=True):
    """A new state of an entry, in place of that with the revision before it."""

    entry: EntryId
    state: EntryState

    def with_run(self, run: str) -> "EntryChange":
        """Return it with the id of the run that its last time has started."""
        last = msgspec.structs.replace(self.state.times[-1], run=run)
        times = (*self.state.times[:-1], last)
        return EntryChange(self.entry, msgspec.structs.replace(self.state, run=run, times=times))


def entry_number(entry: EntryId) -> int | None:
    """Return the number of an entry's id; None: it is not the id of an entry."""
    digits = entry[1:]
    plain = entry[:1] == "s" and digits.isascii() and digits.isdecimal() and len(digits) < 18
    return int(digits) if plain and digits[0] != "0" else None


def entry_id(number: int) -> EntryId:
    """Return the id of a journal's `number`th entry."""
    return f"s{number}"
