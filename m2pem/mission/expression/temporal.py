"""Dates, times and durations of FEEL: values of an expression, which data holds as ISO 8601 texts.

FEEL has two kinds of durations, as how many days a month has depends on where it begins (DMN 1.5,
clause 10.3.2.3). Years are 1 to 9999, times are to the microsecond.
"""

import re
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta, timezone, tzinfo
from decimal import Decimal
from typing import Any, TypeAlias
from zoneinfo import ZoneInfo

import isodate

NOW = "now()"
"""The name under which an expression reads the time of the input that is decided, an ISO 8601 text.
No data has it: to what only reads data, it is a name whose value is not known."""


@dataclass(frozen=True, slots=True, order=True)
class Months:
    """A duration of years and months."""

    months: int

    def __neg__(self) -> "Months":
        return Months(-self.months)

    def __abs__(self) -> "Months":
        return Months(abs(self.months))


Temporal: TypeAlias = date | datetime | time | timedelta | Months
Computed: TypeAlias = Any
"""A value while an expression is evaluated: of data, or FEEL's (`feel_values.FeelValue`)."""

DATE, MOMENT, TIME, DAYS, MONTHS = (
    "date",
    "date and time",
    "time",
    "days and time duration",
    "years and months duration",
)
"""What FEEL calls them."""

_DATE = r"(?P<day>[0-9]{4}-[0-9]{2}-[0-9]{2})"
_CLOCK = (
    r"(?P<clock>[0-9]{2}:[0-9]{2}:[0-9]{2})(?:\.(?P<part>[0-9]+))?"
    r"(?P<zone>Z|[+-][0-9]{2}:[0-9]{2}(?::[0-9]{2})?|@[A-Za-z0-9_+/-]+)?"
)
_PATTERNS = {
    DATE: re.compile(_DATE),
    TIME: re.compile(rf"T?{_CLOCK}"),
    MOMENT: re.compile(rf"{_DATE}(?:T{_CLOCK})?"),
}
_DAYS = re.compile(
    r"(?P<sign>-?)P(?=.*[0-9])(?:(?P<days>[0-9]+)D)?"
    r"(?:T(?=.)(?:(?P<hours>[0-9]+)H)?(?:(?P<minutes>[0-9]+)M)?(?:(?P<seconds>[0-9]*\.?[0-9]*)S)?)?"
)
_MONTHS = re.compile(r"(?P<sign>-?)P(?=.)(?:(?P<years>[0-9]+)Y)?(?:(?P<months>[0-9]+)M)?")
_MIDNIGHT = "24:00:00"
_MOST_OFFSET = timedelta(hours=18)


def iso(value: Temporal) -> str:
    """The ISO 8601 text of a date, time or duration; a named zone follows an @."""
    match value:
        case Months(months):
            years, rest = divmod(abs(months), 12)
            text = (f"{years}Y" if years else "") + (f"{rest}M" if rest or not years else "")
            return f"{'-' if months < 0 else ''}P{text}"
        case timedelta():
            return str(isodate.duration_isoformat(value)) if value else "PT0S"
        case datetime() | time():
            zone = getattr(value.tzinfo, "key", None)
            text = value.replace(tzinfo=None).isoformat() if zone else value.isoformat()
            if "." in text.partition("+")[0]:
                text = re.sub(r"(\.[0-9]*?)0+(?![0-9])", r"\1", text)
            return f"{text}@{zone}" if zone else re.sub(r"\+00:00$", "Z", text)
    return value.isoformat()


def read_date(text: str) -> date:
    """A date as written; raises ValueError."""
    return date.fromisoformat(_matched(DATE, text)["day"])


def read_time(text: str) -> time:
    """A time as written; raises ValueError."""
    return _clock(_matched(TIME, text))


def read_moment(text: str) -> datetime:
    """A date and time as written, midnight where it has no time; raises ValueError."""
    found = _matched(MOMENT, text)
    day = date.fromisoformat(found["day"])
    moment = datetime.combine(day, _clock(found) if found["clock"] else time())
    return moment + timedelta(days=1) if found["clock"] == _MIDNIGHT else moment


def _matched(kind: str, text: str) -> re.Match[str]:
    if found := _PATTERNS[kind].fullmatch(text):
        return found
    raise ValueError(text)


def _clock(found: re.Match[str]) -> time:
    clock, part, zone = found["clock"], found["part"] or "0", found["zone"] or ""
    if part[6:].strip("0"):
        raise ValueError(found[0])
    if clock == _MIDNIGHT and not part.strip("0"):
        clock = "00:00:00"
    if zone.startswith("@"):
        try:
            return time.fromisoformat(f"{clock}.{part[:6]}").replace(tzinfo=ZoneInfo(zone[1:]))
        except (KeyError, OSError):
            raise ValueError(zone) from None
    read = time.fromisoformat(f"{clock}.{part[:6]}{zone}")
    offset = read.utcoffset()
    return read if offset is None else read.replace(tzinfo=offset_zone(offset))


def offset_zone(offset: timedelta) -> tzinfo:
    """The zone of an offset from UTC; raises ValueError beyond 18 hours."""
    if abs(offset) > _MOST_OFFSET:
        raise ValueError(offset)
    return timezone(offset) if offset else UTC


def read_duration(text: str) -> timedelta | Months:
    """A duration as written, of days and time, or of years and months; raises ValueError."""
    if found := _MONTHS.fullmatch(text):
        months = int(found["years"] or 0) * 12 + int(found["months"] or 0)
        return Months(-months if found["sign"] else months)
    found = _DAYS.fullmatch(text)
    if found is None or found["seconds"] in ("", "."):
        raise ValueError(text)
    try:
        length = timedelta(
            days=int(found["days"] or 0),
            hours=int(found["hours"] or 0),
            minutes=int(found["minutes"] or 0),
            microseconds=int(Decimal(found["seconds"] or 0) * 1_000_000),
        )
    except OverflowError:
        raise ValueError(text) from None
    return -length if found["sign"] else length
