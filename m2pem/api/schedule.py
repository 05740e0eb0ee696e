"""The schedule as operators see it: missions that start later (docs/scheduling.md)."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from zoneinfo import ZoneInfo

from m2pem.scheduling.entry import Concurrency, EntryId, Missed, SettledTime, Settlement, When
from m2pem.scheduling.times import described
from m2pem.units import US_PER_S

__all__ = [
    "Concurrency",
    "EntryId",
    "Missed",
    "Schedule",
    "ScheduleChanged",
    "ScheduledMission",
    "ScheduledStatus",
    "SettledTime",
    "Settlement",
    "WHEN_FREE",
    "When",
    "host_time_zone",
]


WHEN_FREE = When()
"""At once, or as soon as the vehicles that the mission names are free."""


class ScheduledStatus(StrEnum):
    """SCHEDULED: its time is to come. WAITING: its time has come, and something is missing.
    STARTING: operators are warned, and it starts in a moment. The others are as they are called;
    an ENDED entry has started, or missed, all its times."""

    SCHEDULED = "scheduled"
    WAITING = "waiting"
    STARTING = "starting"
    HELD = "held"
    ENDED = "ended"
    CANCELLED = "cancelled"
    FAILED = "failed"

    @property
    def over(self) -> bool:
        """Whether the entry starts nothing any more."""
        return self in (
            ScheduledStatus.ENDED,
            ScheduledStatus.CANCELLED,
            ScheduledStatus.FAILED,
        )


@dataclass(frozen=True, slots=True)
class ScheduledMission:
    """An entry of the schedule. Times are microseconds since the Unix epoch by the executive's
    clock; None: there is none.

    `next_us`: its next time. `due_us`: the time that has come and waits for its start, until
    `deadline_us`. `starts_us`: when it starts, once operators are warned. `reason`: why it waits,
    is held, or has ended. `run`: the last that it started. `times`: what became of its last times.
    `when_text`: `when` in words.
    """

    entry: EntryId
    mission: str
    process: str
    when: When
    when_text: str
    status: ScheduledStatus
    priority: int = 0
    by: str = ""
    scheduled_us: int = 0
    next_us: int | None = None
    due_us: int | None = None
    deadline_us: int | None = None
    starts_us: int | None = None
    reason: str = ""
    run: str = ""
    times: tuple[SettledTime, ...] = ()

    def __str__(self) -> str:
        zone = self.when.time_zone
        said = [f"{self.entry} {self.status.value}: {self.mission} {described(self.when)}"]
        if self.starts_us is not None:
            said.append(f"starts {time_in(self.starts_us, zone)}")
        elif self.next_us is not None and not self.status.over:
            said.append(f"next {time_in(self.next_us, zone)}")
        if self.priority:
            said.append(f"priority {self.priority}")
        if self.run:
            said.append(f"last run {self.run}")
        return "; ".join(said) + (f": {self.reason}" if self.reason else "")


@dataclass(frozen=True, slots=True)
class Schedule:
    """All entries of an executive's fleet, those that may start something in the order of service.

    `hold`: who holds the whole schedule and why; "": no operator. `served`: whether this executive
    starts scheduled missions. `warning_s`: how long before a start operators are warned.
    """

    entries: tuple[ScheduledMission, ...] = ()
    hold: str = ""
    served: bool = False
    warning_s: float = 0.0

    def lines(self, *, every: bool = False) -> Sequence[str]:
        """Return a line for each entry, of all or of those that may still start something."""
        said = [f"the schedule is {self.hold}"] if self.hold else []
        return [*said, *(str(each) for each in self.entries if every or not each.status.over)]


@dataclass(frozen=True, slots=True)
class ScheduleChanged:
    """The schedule has changed; `MissionControl.scheduled` has it. It concerns all runs."""

    run: str = ""


def time_in(time_us: int, zone: str = "") -> str:
    """Return an instant as a date and time of a zone, to the second; "": UTC."""
    moment = datetime.fromtimestamp(0, UTC) + timedelta(seconds=time_us // US_PER_S)
    return moment.astimezone(ZoneInfo(zone or "UTC")).isoformat()


LOCAL_TIME = Path("/etc/localtime")


def host_time_zone() -> str:
    """Return the IANA name of this host's time zone: `TZ`, else /etc/localtime, else UTC."""
    for name in (os.environ.get("TZ", "").lstrip(":"), _linked(LOCAL_TIME)):
        try:
            if name and not name.startswith("/"):
                return ZoneInfo(name).key
        except (KeyError, ValueError, OSError):
            continue
    return "UTC"


def _linked(path: Path) -> str:
    try:
        return str(path.resolve()).partition("zoneinfo/")[2]
    except OSError:
        return ""
