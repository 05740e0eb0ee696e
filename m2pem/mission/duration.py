"""ISO 8601 durations and dates, as timers carry them. All times are whole microseconds.

`..._us` counts microseconds: instants from the Unix epoch (UTC), durations by themselves. Values
come from expressions, so each reader takes any value and refuses what is no text.
Every reader raises ExpressionSyntaxError.
"""

import re
from datetime import UTC, datetime, timedelta
from typing import NoReturn

import isodate

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.literals import describe, shorten
from m2pem.mission.values import Value

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_MAX_CHARACTERS = 100

_NUMBER = r"[0-9]+(?:[.,][0-9]+)?"
_DURATION = re.compile(
    rf"P(?=[0-9T])(?:[0-9]+Y)?(?:[0-9]+M)?(?:{_NUMBER}W)?(?:{_NUMBER}D)?"
    rf"(?:T(?=[0-9])(?:{_NUMBER}H)?(?:{_NUMBER}M)?(?:{_NUMBER}S)?)?"
)
_DATE = re.compile(r"([0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{8})(T[0-9:.,]+(Z|[+-][0-9:]+)?)?")


def duration_us(text: Value, at_us: int) -> int:
    """The length of a duration (`PT30S`, `P1DT2H`, `PT0.5S`, `P2W`) that begins at `at_us`.

    Years and months are those of the calendar (UTC) from `at_us` on; where the month is too short
    for the day, its last day counts. Rounded to a microsecond.

    Raises:
        ExpressionSyntaxError: no duration, a negative one, or one that ends after the year 9999.
    """
    what = "a duration such as PT30S, PT0.5S or P1DT2H"
    stripped = text_from(text, what)
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
    stripped = text_from(text, what)
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


def fixed_us(text: Value) -> int | None:
    """The length of a duration that is the same whenever it begins; None: it has months or years.

    Raises:
        ExpressionSyntaxError: as for `duration_us`.
    """
    length_us = duration_us(text, 0)
    days, _, _ = str(text).partition("T")
    return None if "Y" in days or "M" in days else length_us


def text_from(value: Value, what: str) -> str:
    """A value's text, without the space around it; `what` says what it should have been.

    Raises:
        ExpressionSyntaxError: it is none, or far too long.
    """
    if not isinstance(value, str):
        _refuse(f"expected {what} (ISO 8601), not {describe(value)}", "")
    stripped = value.strip()
    if len(stripped) > _MAX_CHARACTERS:
        _refuse(f"expected {what} (ISO 8601)", stripped)
    return stripped


def _refuse(message: str, text: str) -> NoReturn:
    raise ExpressionSyntaxError(message, shorten(text), 0)
