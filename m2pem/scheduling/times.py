"""When an entry of the schedule is due: dates and cron texts in a time zone, deadlines, misses.

Cron texts are those of timer events, in a time zone (`m2pem.mission.cron`). Instants are
microseconds since the Unix epoch.
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, time, timedelta
from functools import lru_cache
from zoneinfo import ZoneInfo

import msgspec

from m2pem.errors import ExpressionSyntaxError, ScheduleError
from m2pem.mission.candidate_facts import CANDIDATE_FACTS
from m2pem.mission.cron import Cron, parse_cron
from m2pem.mission.expression import Expression, parse
from m2pem.scheduling.entry import (
    KEPT_TIMES,
    EntryState,
    EntryStatus,
    Missed,
    SchedulePlan,
    SettledTime,
    Settlement,
    When,
    entry_number,
)
from m2pem.suggestions import did_you_mean
from m2pem.units import US_PER_S

STARTING_DEADLINE_S = 600.0
"""How long after a date or a time of cron a start may come, if the entry does not say."""

COUNTED_TIMES = 1000
"""Missed times are counted up to that; more is said as "at least"."""

OUTCOMES = ("completed", "terminated", "failed", "stopped")

NO_CONDITION_FACTS = ("vehicle.distance", "vehicle.travel_time")
"""Facts of candidates that depend on a task's place, which a schedule has not."""

CONDITION_FACTS = {
    name: what
    for name, what in CANDIDATE_FACTS.items()
    if name.startswith("vehicle.") and name not in NO_CONDITION_FACTS
}
"""What conditions of the schedule may read, and what each is."""

_AT = "at (--when)"
_FIELDS = {_AT: "at", "until": "until"}
"""The fields of `When` that are dates, by what they are called in errors."""
_CRON = "'0 8 * * MON-FRI': minute, hour, day, month, weekday"

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


def resolved(when: When, now_us: int, host_zone: str) -> When:
    """Check what an operator wants, and say it with the time zone and the offsets that it means.

    A time without a date (08:00) is the next one of the time zone.

    `host_zone`: what stands for a time zone that is not named.

    Raises:
        ScheduleError: it makes no sense, or lies in the past; the error says what would be right.
    """
    if when.at and when.cron:
        raise ScheduleError("give a date (at, --when) or a cron text (cron), not both", "cron")
    zone = when.time_zone or host_zone
    if when.at or when.cron or when.until or when.time_zone:
        zone_of(zone)
    if when.at or when.cron or when.until:
        when = msgspec.structs.replace(when, time_zone=zone)
    if when.at:
        moment = _next(when.at, now_us, zone) or _with_offset(_AT, when.at, zone)
        when = msgspec.structs.replace(when, at=moment)
        if instant_us(when.at) <= now_us:
            raise ScheduleError(
                f"{_AT}: {when.at} has passed: it is {local(now_us, zone)}; give a later one",
                "at",
            )
    if when.until:
        when = msgspec.structs.replace(when, until=_with_offset("until", when.until, zone))
        first_us = instant_us(when.at) if when.at else now_us
        if instant_us(when.until) <= first_us:
            raise ScheduleError(
                f"until: nothing can start until {when.until}: that is too early; give a later one",
                "until",
            )
    if when.cron:
        first = _cron(when.cron).after_us(now_us, zone_of(zone))
        if first is None or (when.until and first > instant_us(when.until)):
            raise ScheduleError(
                f"cron: {when.cron!r} has no time from now on, or none before until; write for "
                f"example {_CRON}",
                "cron",
            )
    _check_rest(when)
    return when


def _check_rest(when: When) -> None:
    if when.after and when.cron:
        raise ScheduleError(
            "after: what starts again and again by cron cannot start after one run: give a date, "
            "or none",
            "after",
        )
    wrong = [each for each in when.outcomes if each not in OUTCOMES]
    if wrong or not when.outcomes:
        raise ScheduleError(
            f"outcomes of a run are {', '.join(OUTCOMES)}, not {', '.join(wrong) or 'none'}",
            "outcomes",
        )
    if when.outcomes != When().outcomes and not when.after:
        raise ScheduleError("outcomes of a run (--outcome) go with after: name the run", "after")
    if when.condition:
        condition_of(when.condition)
    elif when.vehicles or when.held_for_s:
        raise ScheduleError(
            "vehicles (--of) and a time to hold (held_for_s, --held-for) go with a condition: "
            "give one",
            "condition",
        )
    for field in ("held_for_s", "starting_deadline_s"):
        if (getattr(when, field) or 0) < 0:
            raise ScheduleError("a duration cannot be negative", field)


_TIME = re.compile(r"[0-9]{1,2}:[0-9]{2}(:[0-9]{2})?")


def _next(text: str, now_us: int, zone: str) -> str:
    """Return the next date with a time of day; "" if the text is none."""
    if not _TIME.fullmatch(text.strip()):
        return ""
    try:
        wanted = time.fromisoformat(text.strip().rjust(len("08:00"), "0"))
    except ValueError:
        raise ScheduleError(f"{_AT}: {text} is no time of a day such as 08:00", "at") from None
    now = (_EPOCH + timedelta(microseconds=now_us)).astimezone(zone_of(zone))
    for days in (0, 1, 2):
        moment = datetime.combine(now.date() + timedelta(days=days), wanted, now.tzinfo)
        if moment.timestamp() > now.timestamp() and _exists(moment):
            return moment.isoformat()
    raise ScheduleError(f"{_AT}: {text} does not come within two days in {zone}", "at")


def _exists(moment: datetime) -> bool:
    """Whether clocks do not skip a local time: it would come back from UTC as another one."""
    again = moment.astimezone(UTC).astimezone(moment.tzinfo)
    return again.replace(tzinfo=None, fold=0) == moment.replace(tzinfo=None, fold=0)


def _with_offset(what: str, text: str, zone: str) -> str:
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ScheduleError(
            f"{what}: {text!r} is no date and time such as 2026-01-01T08:00 or "
            "2026-01-01T08:00:00+01:00",
            _FIELDS[what],
        ) from None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=zone_of(zone))
        if not _exists(moment):
            raise ScheduleError(
                f"{what}: {text} does not exist in {zone}: clocks skip it; give another",
                _FIELDS[what],
            )
    return moment.isoformat()


def zone_of(name: str) -> ZoneInfo:
    """Return a time zone by its IANA name.

    Raises:
        ScheduleError: there is none.
    """
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise ScheduleError(
            f"time zone: there is no {name!r}; they are named as Europe/Berlin or UTC",
            "time_zone",
        ) from None


def instant_us(text: str) -> int:
    """Return the instant of a date with its offset."""
    return (datetime.fromisoformat(text) - _EPOCH) // _MICROSECOND


def local(time_us: int, zone: str) -> str:
    """Return an instant as the date and time of a zone, to the second."""
    moment = (_EPOCH + timedelta(microseconds=time_us)).astimezone(ZoneInfo(zone or "UTC"))
    return moment.isoformat(timespec="seconds")


@lru_cache(maxsize=256)
def _cron(text: str) -> Cron:
    try:
        return parse_cron(text)
    except ExpressionSyntaxError as error:
        raise ScheduleError(f"cron: {error}; write for example {_CRON}", "cron") from error


@lru_cache(maxsize=256)
def condition_of(text: str) -> Expression:
    """Read a condition over the facts of a vehicle.

    Raises:
        ScheduleError: it cannot be read, or names what no fact is.
    """
    try:
        found = parse(text)
    except ExpressionSyntaxError as error:
        raise ScheduleError(
            f"condition: {error}; write for example vehicle.battery > 0.9", "condition"
        ) from error
    for name in sorted(found.names):
        if name not in CONDITION_FACTS:
            hint = did_you_mean(name, CONDITION_FACTS) or f"there are {', '.join(CONDITION_FACTS)}"
            raise ScheduleError(f"condition: {name!r} is no fact of a vehicle; {hint}", "condition")
    return found


def after_of(when: When) -> tuple[str, bool]:
    """Return what an entry comes after, and whether that is an entry, not a run."""
    return when.after, entry_number(when.after) is not None


# --- when it is due -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Due:
    """The times of an entry at one moment.

    `due_us`: the last one that has come and is not settled; None: none has. `owed`: it was missed
    before, and a start stands for it. `passed`: how many before it are not settled, either, the
    last of them at `passed_us`. `deadline_us`: when `due_us` is missed; None: never. `next_us`: the
    next one that is to come; None: there is none.
    """

    due_us: int | None = None
    owed: bool = False
    passed: int = 0
    passed_us: int = 0
    deadline_us: int | None = None
    next_us: int | None = None


def due(plan: SchedulePlan, state: EntryState, now_us: int) -> Due:
    """Return which times of an entry are due, and which have passed."""
    when = plan.when
    until_us = instant_us(when.until) if when.until else None
    times, next_us = _times(plan, state.settled_us, now_us, until_us)
    owed = not times and state.owed_us != 0
    if owed:
        return Due(state.owed_us, True, deadline_us=until_us, next_us=next_us)
    if not times:
        return Due(next_us=next_us)
    last_us = times[-1]
    deadlines = [] if until_us is None else [until_us]
    if (limit_s := starting_deadline_s(when)) is not None:
        deadlines.append(last_us + round(limit_s * US_PER_S))
    return Due(
        last_us,
        False,
        len(times) - 1,
        times[-2] if len(times) > 1 else 0,
        min(deadlines, default=None),
        next_us,
    )


def starting_deadline_s(when: When) -> float | None:
    """Return how long after its time a start of an entry may come; None: there is no limit."""
    if when.starting_deadline_s is not None:
        return when.starting_deadline_s
    return STARTING_DEADLINE_S if when.at or when.cron else None


def _times(
    plan: SchedulePlan, settled_us: int, now_us: int, until_us: int | None
) -> tuple[list[int], int | None]:
    """Return the times after `settled_us` up to now, and the one after that. Of more than
    `COUNTED_TIMES` the list has the first ones and the last."""
    when = plan.when
    if not when.cron:
        once_us = instant_us(when.at) if when.at else plan.scheduled_us
        if once_us <= settled_us:
            return [], None
        return ([once_us], None) if once_us <= now_us else ([], once_us)
    cron, zone = _cron(when.cron), zone_of(when.time_zone)
    times: list[int] = []
    found = cron.after_us(settled_us, zone)
    while found is not None and found <= now_us and _is_within(found, until_us):
        times.append(found)
        if len(times) == COUNTED_TIMES:
            break
        found = cron.after_us(found, zone)
    if len(times) == COUNTED_TIMES:
        end_us = now_us if until_us is None else min(now_us, until_us)
        last_us = cron.before_us(end_us + US_PER_S, zone)
        if last_us is not None and last_us > times[-1]:
            times.append(last_us)
        found = cron.after_us(times[-1], zone)
    if found is not None and not _is_within(found, until_us):
        found = None
    return times, found


def _is_within(time_us: int, until_us: int | None) -> bool:
    return until_us is None or time_us <= until_us


# --- what becomes of its times --------------------------------------------------------------------


def settle(
    plan: SchedulePlan, state: EntryState, settled: SettledTime, *, ends: str = ""
) -> EntryState:
    """Return the state after a time was settled: started, missed or refused.

    `ends`: why the entry can start nothing any more; "": whether it can is seen from its times.
    """
    missed = settled.settlement is Settlement.MISSED
    # A missed time stays owed; one that is started, or given up, is not any more.
    owes = missed and plan.when.missed is Missed.RUN_ONCE and not ends
    settled_us = max(state.settled_us, settled.due_us)
    changed = msgspec.structs.replace(
        state,
        settled_us=settled_us,
        owed_us=settled.due_us if owes else 0,
        run=settled.run or state.run,
        times=(*state.times, settled)[-KEPT_TIMES:],
        revision=state.revision + 1,
    )
    if settled.settlement is Settlement.REFUSED:
        return msgspec.structs.replace(changed, status=EntryStatus.FAILED, detail=settled.text)
    if ends:
        return msgspec.structs.replace(changed, status=EntryStatus.ENDED, detail=ends)
    if not changed.owed_us and _is_over(plan, settled_us):
        detail = settled.text if missed else ""
        return msgspec.structs.replace(changed, status=EntryStatus.ENDED, detail=detail)
    return changed


def _is_over(plan: SchedulePlan, settled_us: int) -> bool:
    if not plan.when.cron:
        return True
    following = _cron(plan.when.cron).after_us(settled_us, zone_of(plan.when.time_zone))
    until_us = instant_us(plan.when.until) if plan.when.until else None
    return following is None or not _is_within(following, until_us)


def withdrawn(state: EntryState) -> EntryState:
    """Return the state as if the last start had not been: its run never began."""
    started = state.times[-1]
    return msgspec.structs.replace(
        state,
        settled_us=state.settled_us if started.owed else started.due_us - 1,
        owed_us=started.due_us if started.owed else 0,
        status=EntryStatus.ACTIVE,
        detail="",
        run=next((each.run for each in reversed(state.times[:-1]) if each.run), ""),
        times=state.times[:-1],
        revision=state.revision + 1,
    )


def described(when: When) -> str:
    """Say when a mission starts, in words that end a sentence."""
    parts = []
    if when.at:
        parts.append(f"at {when.at}")
    if when.cron:
        parts.append(f"by cron {when.cron} ({when.time_zone})")
    if when.after:
        parts.append(f"after {when.after} has {' or '.join(map(_ended_with, when.outcomes))}")
    if when.condition:
        of = f" of {', '.join(when.vehicles)}" if when.vehicles else ""
        held = f" for {when.held_for_s:g} s" if when.held_for_s else ""
        parts.append(f"when {when.condition}{of}{held}")
    if not parts:
        parts.append("when its vehicles are free")
    if when.until:
        parts.append(f"until {when.until}")
    return ", ".join(parts)


def _ended_with(outcome: str) -> str:
    return {"terminated": "terminated", "stopped": "been stopped"}.get(outcome, outcome)
