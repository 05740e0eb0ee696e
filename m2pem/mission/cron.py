"""Cron texts, as the timers of other engines carry them. Always in UTC.

* 5 fields, as cron has them: minute, hour, day of the month, month, day of the week (0 and 7 are
  Sunday). When both days are restricted, either will do.
* 6 fields begin with seconds (Quartz, Spring); 7 end with years (Quartz).
* `@yearly`, `@annually`, `@monthly`, `@weekly`, `@daily`, `@midnight`, `@hourly`.

Engines differ about which day of the week 1 is once there is a seconds field (Quartz: Sunday;
Spring: Monday), so days have names there; with years it can only be Quartz.
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cronsim import CronSim, CronSimError

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.literals import shorten

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_SECOND = timedelta(seconds=1)
_MAX_CHARACTERS = 100

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


@dataclass(frozen=True, slots=True)
class Cron:
    """`fields`: what cronsim reads; `years`: None for all."""

    fields: str
    years: tuple[int, ...] | None

    def after_us(self, at_us: int) -> int | None:
        """The first of its dates after an instant (both: microseconds since the Unix epoch).

        None: there is none, at least for 50 years.
        """
        try:
            moment = _EPOCH + timedelta(microseconds=at_us)
            while True:
                found = next(CronSim(self.fields, moment))
                if self.years is None or found.year in self.years:
                    return (found - _EPOCH) // _MICROSECOND
                following = [year for year in self.years if year > found.year]
                if not following:
                    return None
                moment = datetime(following[0], 1, 1, tzinfo=UTC) - _SECOND
        except (StopIteration, OverflowError, ValueError):  # the calendar ends
            return None


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
        raise _wrong(text, f"a cron text has at most {_MAX_CHARACTERS} characters")
    if stripped.startswith("@"):
        macro = MACROS.get(stripped.lower())
        if macro is None:
            raise _wrong(text, f"expected one of {', '.join(MACROS)}")
        return Cron(macro, None)
    words = stripped.upper().split()
    if len(words) not in (5, 6, 7):
        raise _wrong(
            text, f"a cron text has 5, 6 (seconds first) or 7 fields (years last), not {len(words)}"
        )
    quartz = len(words) == 7
    years = _years(text, words.pop()) if quartz else None
    day, weekday = words[-3], words[-1]
    if len(words) == 6 and not (_is_any(day) or _is_any(weekday)):
        raise _wrong(
            text, "give the day of the month or the day of the week, and '?' for the other"
        )
    words[-3] = day.replace("?", "*")
    words[-1] = _weekdays(text, weekday, quartz) if len(words) == 6 else weekday.replace("?", "*")
    fields = " ".join(words)
    try:
        CronSim(fields, _EPOCH)
    except CronSimError as error:
        raise _wrong(text, f"{str(error).lower()} in the cron text") from None
    return Cron(fields, years)


def _is_any(field: str) -> bool:
    return field == "?" or field.startswith("*")


def _weekdays(text: str, field: str, quartz: bool) -> str:
    """Days of the week as numbers from Sunday 0: what cronsim reads."""
    if field in ("?", "*"):
        return "*"
    found: list[str] = []
    for term in field.split(","):
        match = _DAY_TERM.fullmatch(term)
        if match is None:
            raise _wrong(
                text, f"'{term}' is no day of the week such as MON, MON-FRI, FRIL or MON#1"
            )
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
        raise _wrong(
            text,
            f"which day of the week '{name}' is depends on the engine (1 is Sunday for Quartz, "
            "Monday for Spring): write MON, TUE, ...",
        )
    if not 1 <= int(name) <= 7:
        raise _wrong(text, f"'{name}' is no day of the week: 1 (SUN) to 7 (SAT)")
    return int(name) - 1


def _years(text: str, field: str) -> tuple[int, ...] | None:
    if field in ("*", "?"):
        return None
    found: set[int] = set()
    for term in field.split(","):
        match = _YEAR_TERM.fullmatch(term)
        if match is None:
            raise _wrong(text, f"'{term}' is no year such as 2026, 2026-2028 or 2026/2")
        first = _FIRST_YEAR if match["first"] == "*" else int(match["first"])
        if match["last"]:
            last = int(match["last"])
        else:
            last = _LAST_YEAR if match["step"] or match["first"] == "*" else first
        if not _FIRST_YEAR <= first <= last <= _LAST_YEAR:
            raise _wrong(text, f"years are {_FIRST_YEAR} to {_LAST_YEAR}, the first one first")
        found.update(range(first, last + 1, int(match["step"] or 1)))
    return tuple(sorted(found))


def _wrong(text: str, message: str) -> ExpressionSyntaxError:
    return ExpressionSyntaxError(message, shorten(text), 0)
