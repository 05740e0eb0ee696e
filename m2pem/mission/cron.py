"""Cron texts: dates that come again and again, in a time zone.

They are those of other engines:

* 5 fields, as cron has them: minute, hour, day of the month, month, day of the week (0 and 7 are
  Sunday). When both days are restricted, either matches.
* 6 fields begin with seconds (Quartz, Spring); 7 end with years (Quartz).
* `@yearly`, `@annually`, `@monthly`, `@weekly`, `@daily`, `@midnight`, `@hourly`.

Engines differ about which day of the week 1 is once there is a seconds field (Quartz: Sunday;
Spring: Monday), so days have names there; with years it can only be Quartz.

Where clocks are put forward, a date that does not exist comes at the next instant that does; where
they are put back, a date comes once, when clocks show it first. A text that is due in every hour is
due in both hours then, and in none that does not exist.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from typing import NoReturn

from cronsim import CronSim, CronSimError

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.literals import shorten

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_MAX_CHARACTERS = 100
_SECOND = timedelta(seconds=1)

MACROS = {
    "@yearly": "0 0 1 1 *",
    "@annually": "0 0 1 1 *",
    "@monthly": "0 0 1 * *",
    "@weekly": "0 0 * * 0",
    "@daily": "0 0 * * *",
    "@midnight": "0 0 * * *",
    "@hourly": "0 * * * *",
}
_DAYS = ("SUN", "MON", "TUE", "WED", "THU", "FRI", "SAT")
_DAY = r"[0-9]+|SUN|MON|TUE|WED|THU|FRI|SAT"
_DAY_TERM = re.compile(
    rf"(?P<first>{_DAY}|\*)(?:-(?P<last>{_DAY}))?(?:/(?P<step>[1-9][0-9]*))?"
    rf"|(?P<day>{_DAY})(?P<which>L|\#[1-5])"
)
_YEAR_TERM = re.compile(
    r"(?P<first>[0-9]{4}|\*)(?:-(?P<last>[0-9]{4}))?(?:/(?P<step>[1-9][0-9]*))?"
)
_FIRST_YEAR, _LAST_YEAR = 1970, 2099  # Quartz's
_STEP = re.compile(r"/([0-9]+)")
_MOST = (59, 59, 23, 31, 12, 7)
"""The longest step of each field, as in Quartz."""

_ONE_VALUE = re.compile(r"\b(\w+)-\1/[0-9]+")
"""cronsim reads 15-15/3 as 15/3."""


@dataclass(frozen=True, slots=True)
class Cron:
    """`fields`: the six that cronsim reads; `years`: None for all; `hourly`: due in each hour."""

    fields: str
    years: tuple[int, ...] | None
    hourly: bool

    def after_us(self, at_us: int, zone: tzinfo = UTC) -> int | None:
        """The first of its dates after an instant (both: microseconds since the Unix epoch).

        `zone`: in which its fields are read. None: there is none, at least for 50 years.
        """
        moment = (_EPOCH + timedelta(microseconds=at_us)).astimezone(zone)
        return next((due for due in self._dates(moment, reverse=False) if due > at_us), None)

    def before_us(self, at_us: int, zone: tzinfo = UTC) -> int | None:
        """The last of its dates before an instant, as `after_us`; None: there is none."""
        moment = (_EPOCH + timedelta(microseconds=at_us)).astimezone(zone)
        return next((due for due in self._dates(moment, reverse=True) if due < at_us), None)

    def _dates(self, moment: datetime, *, reverse: bool) -> Iterator[int]:
        """Its dates from a moment on, or back; the first ones may be on its other side."""
        zone, start = moment.tzinfo, moment
        if not self.hourly:
            start = moment.replace(tzinfo=None, fold=0)
            if reverse and moment.fold:  # what comes once has come when clocks show it first
                start += _offset(moment.replace(fold=0)) - _offset(moment)
        try:
            while True:
                for found in CronSim(self.fields, start, reverse):
                    if self.years is not None and found.year not in self.years:
                        break
                    due = found if found.tzinfo is not None else _existing(found, zone)
                    yield (due - _EPOCH) // _MICROSECOND
                following = [
                    year
                    for year in self.years or ()
                    if (year < found.year if reverse else year > found.year)
                ]
                if not following:
                    return
                begin = datetime(following[0], 1, 1, tzinfo=found.tzinfo)
                start = begin - _SECOND
                if reverse:
                    start = datetime(following[-1] + 1, 1, 1, tzinfo=found.tzinfo)
        except (OverflowError, ValueError):  # the calendar ends
            return


def _existing(local: datetime, zone: tzinfo | None) -> datetime:
    """The first instant at which clocks show a local time, or have passed it by a jump."""
    first = local.replace(tzinfo=zone)
    before, after = _offset(first), _offset(first.replace(fold=1))
    if after <= before:
        return first
    # The jump is the instant at which the later offset begins, within the local times it skips.
    low, high = first.astimezone(UTC) - (after - before), first.astimezone(UTC)
    while high - low > _SECOND:
        middle = low + (high - low) / 2
        low, high = (low, middle) if _offset(middle.astimezone(zone)) == after else (middle, high)
    return high.replace(microsecond=0)


def _offset(moment: datetime) -> timedelta:
    offset = moment.utcoffset()
    assert offset is not None, "it has a time zone"
    return offset


def is_cron(text: str) -> bool:
    """Whether a text looks like cron's rather than like ISO 8601."""
    return text.lstrip().startswith("@") or len(text.split()) > 1


def parse_cron(text: str) -> Cron:
    """Read a cron text.

    Raises:
        ExpressionSyntaxError: it is none, or it means different things to different engines.
    """
    stripped = text.strip()
    if len(stripped) > _MAX_CHARACTERS:
        _refuse(f"a cron text has at most {_MAX_CHARACTERS} characters", text)
    if stripped.startswith("@"):
        macro = MACROS.get(stripped.lower())
        if macro is None:
            _refuse(f"expected one of {', '.join(MACROS)}", text)
        stripped = macro
    words = stripped.upper().split()
    if len(words) not in (5, 6, 7):
        _refuse(
            f"a cron text has 5, 6 (seconds first) or 7 fields (years last), not {len(words)}", text
        )
    quartz = len(words) == 7
    years = _years(text, words.pop()) if quartz else None
    day, weekday = words[-3], words[-1]
    if len(words) == 6 and not (_is_any(day) or _is_any(weekday)):
        _refuse("give the day of the month or the day of the week, and '?' for the other", text)
    words[-3] = day.replace("?", "*")
    if len(words) == 6:
        words[-1] = _weekdays(text, weekday, quartz)
    else:
        terms = weekday.replace("?", "*").split(",")
        words = ["0", *words[:-1], ",".join(_five_fields(text, term) for term in terms)]
    for word, most in zip(words, _MOST, strict=True):
        if any(int(step) > most for step in _STEP.findall(word)):
            _refuse(f"the step of '{word}' is longer than its field: at most {most}", text)
    fields = _ONE_VALUE.sub(r"\1", " ".join(words))
    try:
        hours = CronSim(fields, _EPOCH).hours
    except CronSimError as error:
        _refuse(f"{str(error).lower()} in the cron text", text)
    return Cron(fields, years, len(hours) == _MOST[2] + 1)


def _is_any(field: str) -> bool:
    return field == "?" or field.startswith("*")


def _five_fields(text: str, term: str) -> str:
    """A term of named days (FRIL, FRI-MON) in numbers; cronsim reads the others there."""
    match = _DAY_TERM.fullmatch(term)
    if match is None or match["step"]:
        return term
    days = {match["first"], match["last"], match["day"]} - {None}
    return _weekdays(text, term, False) if days <= {*_DAYS} else term


def _weekdays(text: str, field: str, quartz: bool) -> str:
    """Days of the week as numbers from Sunday 0: what cronsim reads."""
    if field in ("?", "*"):
        return "*"
    found: list[str] = []
    for term in field.split(","):
        match = _DAY_TERM.fullmatch(term)
        if match is None:
            _refuse(f"'{term}' is no day of the week such as MON, MON-FRI, FRIL or MON#1", text)
        if match["day"]:
            found.append(f"{_weekday(text, match['day'], quartz)}{match['which']}")
            continue
        step = int(match["step"] or 1)
        first = 0 if match["first"] == "*" else _weekday(text, match["first"], quartz)
        if match["last"]:
            last = _weekday(text, match["last"], quartz)
        else:
            last = 6 if match["step"] or match["first"] == "*" else first
        # A range may pass the end of the week: FRI-MON.
        days = range(first, last + 1 if last >= first else last + 8)
        found += [str(each % 7) for each in days[::step]]
    return ",".join(found)


def _weekday(text: str, name: str, quartz: bool) -> int:
    if name in _DAYS:
        return _DAYS.index(name)
    if not quartz:
        _refuse(
            f"which day of the week '{name}' is depends on the engine (1 is Sunday for Quartz, "
            "Monday for Spring): write MON, TUE, ...",
            text,
        )
    if not 1 <= int(name) <= 7:
        _refuse(f"'{name}' is no day of the week: 1 (SUN) to 7 (SAT)", text)
    return int(name) - 1


def _years(text: str, field: str) -> tuple[int, ...] | None:
    if field in ("*", "?"):
        return None
    found: set[int] = set()
    for term in field.split(","):
        match = _YEAR_TERM.fullmatch(term)
        if match is None:
            _refuse(f"'{term}' is no year such as 2026, 2026-2028 or 2026/2", text)
        first = _FIRST_YEAR if match["first"] == "*" else int(match["first"])
        if match["last"]:
            last = int(match["last"])
        else:
            last = _LAST_YEAR if match["step"] or match["first"] == "*" else first
        if not _FIRST_YEAR <= first <= last <= _LAST_YEAR:
            _refuse(f"years are {_FIRST_YEAR} to {_LAST_YEAR}, the first one first", text)
        found.update(range(first, last + 1, int(match["step"] or 1)))
    return tuple(sorted(found))


def _refuse(message: str, text: str) -> NoReturn:
    raise ExpressionSyntaxError(message, shorten(text), 0) from None
