"""ISO 8601 durations, dates and cycles, as timers carry them. All times are whole microseconds.

`..._us` counts microseconds: instants from the Unix epoch (UTC), durations by themselves. Values
come from expressions, so each reader takes any value and refuses what is no text.
Every reader raises ExpressionSyntaxError.
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import NoReturn

import isodate

from m2pem.errors import ExpressionSyntaxError
from m2pem.model.expression.literals import describe, shorten
from m2pem.model.values import Value

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_MAX_CHARACTERS = 100

_NUMBER = r"[0-9]+(?:[.,][0-9]+)?"
_DURATION = re.compile(
    rf"P(?=[0-9T])(?:[0-9]+Y)?(?:[0-9]+M)?(?:{_NUMBER}W)?(?:{_NUMBER}D)?"
    rf"(?:T(?=[0-9])(?:{_NUMBER}H)?(?:{_NUMBER}M)?(?:{_NUMBER}S)?)?"
)
_DATE = re.compile(r"([0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{8})(T[0-9:.,]+(Z|[+-][0-9:]+)?)?")
_CYCLE = re.compile(r"R(?P<repetitions>[0-9]{0,9})/(?:(?P<start>[^/P]*)/)?(?P<period>P[^/]*)")
_CRON = re.compile(r"@\w+|\S+(?:\s+\S+){4,6}")


@dataclass(frozen=True, slots=True)
class Cycle:
    """A repeating timer. `repetitions`: how often it fires; None is for ever.

    `start_us`: the first firing, when the text says one. `period`: an ISO 8601 duration that is
    longer than nothing.
    """

    repetitions: int | None
    start_us: int | None
    period: str

    def first_us(self, at_us: int) -> int:
        """When it fires first, if it is armed at `at_us`: at its start, at once when that has
        passed; without a start, one period later."""
        if self.start_us is None:
            return self.next_us(at_us)
        return max(self.start_us, at_us)

    def next_us(self, due_us: int) -> int:
        """When it fires after it was due at `due_us`; lateness does not add up.

        Raises:
            ExpressionSyntaxError: that is after the year 9999.
        """
        return due_us + duration_us(self.period, due_us)


def duration_us(text: Value, at_us: int) -> int:
    """The length of a duration (`PT30S`, `P1DT2H`, `PT0.5S`, `P2W`) that begins at `at_us`.

    Years and months are those of the calendar (UTC) from `at_us` on; where the month is too short
    for the day, its last day counts. Rounded to a microsecond.

    Raises:
        ExpressionSyntaxError: no duration, a negative one, or one that ends after the year 9999.
    """
    what = "a duration such as PT30S, PT0.5S or P1DT2H"
    stripped = _text(text, what)
    if stripped.startswith("-"):
        _refuse("a duration cannot be negative", stripped)
    if not _DURATION.fullmatch(stripped):
        _refuse(f"expected {what} (ISO 8601)", stripped)
    try:
        begin = _EPOCH + timedelta(microseconds=at_us)
        end: datetime = begin + isodate.parse_duration(stripped)
    except (ValueError, ArithmeticError):
        _refuse("the duration ends after the year 9999", stripped)
    return (end - begin) // _MICROSECOND


def date_us(text: Value) -> int:
    """The instant of a date and time (`2026-01-01T12:00:00Z`, `...+02:00`).

    Without an offset it is UTC; without a time it is midnight.

    Raises:
        ExpressionSyntaxError: no date and time, or one that does not exist.
    """
    what = "a date and time such as 2026-01-01T12:00:00Z"
    stripped = _text(text, what)
    if not _DATE.fullmatch(stripped):
        _refuse(f"expected {what} (ISO 8601)", stripped)
    try:
        if "T" in stripped:
            instant: datetime = isodate.parse_datetime(stripped)
        else:
            instant = datetime.combine(isodate.parse_date(stripped), datetime.min.time())
        if instant.tzinfo is None:
            instant = instant.replace(tzinfo=UTC)
        return (instant - _EPOCH) // _MICROSECOND
    except (ValueError, ArithmeticError) as error:
        _refuse(f"expected {what} (ISO 8601): {error}", stripped)


def cycle(text: Value) -> Cycle:
    """Read a cycle: `R3/PT10S`, `R/PT1M` (for ever), `R3/2026-01-01T00:00:00Z/PT10S`.

    Raises:
        ExpressionSyntaxError: no cycle, one that never fires, or one in cron's form.
    """
    what = "a cycle such as R3/PT10S, R/PT1M or R3/2026-01-01T12:00:00Z/PT10S"
    stripped = _text(text, what)
    match = _CYCLE.fullmatch(stripped)
    if match is None:
        if _CRON.fullmatch(stripped):
            _refuse(f"cron expressions are not supported; write {what} (ISO 8601)", stripped)
        if re.fullmatch(r"R[0-9]*/P[^/]*/[^P]+", stripped):
            _refuse("a cycle with an end is not supported; write its start first", stripped)
        _refuse(f"expected {what} (ISO 8601)", stripped)
    repetitions = int(match["repetitions"]) if match["repetitions"] else None
    if repetitions == 0:
        _refuse("the cycle would never fire; leave the number out to repeat for ever", stripped)
    start = date_us(match["start"]) if match["start"] is not None else None
    if duration_us(match["period"], 0) == 0:
        _refuse("the period of a cycle must be longer than nothing", stripped)
    return Cycle(repetitions, start, match["period"])


def _text(value: Value, what: str) -> str:
    if not isinstance(value, str):
        _refuse(f"expected {what} (ISO 8601), not {describe(value)}", "")
    stripped = value.strip()
    if len(stripped) > _MAX_CHARACTERS:
        _refuse(f"expected {what} (ISO 8601)", stripped)
    return stripped


def _refuse(message: str, text: str) -> NoReturn:
    raise ExpressionSyntaxError(message, shorten(text), 0)
