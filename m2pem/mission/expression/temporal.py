"""Dates and durations of FEEL: values of an expression, which data holds as ISO 8601 texts.

FEEL has two kinds of durations, as how many days a month has depends on where it begins (DMN 1.3,
table 44). Without an offset, a date and time is UTC.
"""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from typing import Any, TypeAlias, Union

import isodate

import m2pem.mission.timers as times  # imports this package too: only its name is bound yet
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression.tree import Operation
from m2pem.mission.values import Value

NOW = "now()"
"""The name under which an expression reads the time of the input that is decided, an ISO 8601 text.
No data has it: to what only reads data, it is a name whose value is not known."""


@dataclass(frozen=True, slots=True, order=True)
class Months:
    """A duration of years and months."""

    months: int


Temporal: TypeAlias = date | datetime | timedelta | Months
Computed: TypeAlias = Union[Value, Temporal]
"""A value while an expression is evaluated."""

DATE, MOMENT, DAYS, MONTHS = (
    "date",
    "date and time",
    "days and time duration",
    "years and months duration",
)
KINDS: dict[type, str] = {date: DATE, datetime: MOMENT, timedelta: DAYS, Months: MONTHS}
"""What FEEL calls them."""


_OF_DURATIONS = ("days", "hours", "minutes", "seconds")
_OF_DATES = ("year", "month", "day", "hour", "minute", "second")


def iso(value: Temporal) -> str:
    """The ISO 8601 text of a date or duration."""
    match value:
        case Months(months):
            years, rest = divmod(abs(months), 12)
            text = (f"{years}Y" if years else "") + (f"{rest}M" if rest or not years else "")
            return f"{'-' if months < 0 else ''}P{text}"
        case timedelta():
            return str(isodate.duration_isoformat(value)) if value else "PT0S"
        case datetime():
            return value.isoformat().replace("+00:00", "Z")
    return value.isoformat()


def parts(value: Temporal) -> dict[str, int]:
    """The properties of a date or duration (DMN 1.3, table 61)."""
    match value:
        case Months(months):
            return {"years": int(months / 12), "months": int(math.fmod(months, 12))}
        case timedelta():
            sign, size = (-1, -value) if value.days < 0 else (1, value)
            whole = (size.days, size.seconds // 3600, size.seconds // 60 % 60, size.seconds % 60)
            return {n: sign * each for n, each in zip(_OF_DURATIONS, whole, strict=True)}
    found = {name: getattr(value, name) for name in _OF_DATES if hasattr(value, name)}
    return {**found, "weekday": value.isoweekday()}


def to_data(value: Computed) -> Value:
    """The value as data holds it."""
    if type(value) in KINDS:
        return iso(value)  # type: ignore[arg-type]
    if isinstance(value, list):
        return [to_data(each) for each in value]
    return value  # type: ignore[return-value]


# --- FEEL's functions -----------------------------------------------------------------------------


def read_moment(value: str | date) -> datetime:
    """`date and time(x)`; raises ExpressionError."""
    if isinstance(value, str):
        return _read("date and time", times.moment, value.strip())  # type: ignore[no-any-return]
    whole = isinstance(value, datetime)
    return value if whole else datetime(value.year, value.month, value.day, tzinfo=UTC)  # type: ignore[return-value]


def read_date(value: str | date | int, month: int | None = None, day: int | None = None) -> date:
    """`date(x)`, `date(year, month, day)`; raises ExpressionError."""
    if month is not None and day is not None:
        whole = [_whole(each) for each in (value, month, day)]
        try:
            return date(*whole)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise ExpressionError(f"date(): there is no date {value}, {month}, {day}") from None
    if isinstance(value, int | float):
        raise ExpressionError("date() takes a text, a date, or a year, a month and a day")
    return read_moment(value).date()


def read_duration(value: str | timedelta | Months) -> timedelta | Months:
    """`duration(x)`; raises ExpressionError."""
    if not isinstance(value, str):
        return value
    text = value.strip()
    sign = -1 if text.startswith("-") else 1
    text = text.removeprefix("-")
    _read("duration", times.duration_us, text, 0)
    found = isodate.parse_duration(text)
    days = text.partition("T")[0]
    if isinstance(found, timedelta) and "Y" not in days and "M" not in days:
        return sign * found
    if getattr(found, "tdelta", found):
        raise ExpressionError(
            f"duration(): '{text}' has months and days; it is of years and months, or of days and "
            "time"
        )
    return Months(sign * int(getattr(found, "years", 0) * 12 + getattr(found, "months", 0)))


def read_cycle(first: int | timedelta | Months, second: timedelta | Months | None = None) -> str:
    """Camunda's `cycle(duration)` and `cycle(repetitions, duration)`: a text such as R3/PT10S."""
    period = first if second is None else second
    count = "" if second is None else _whole(first)
    if isinstance(period, int | float) or not (count == "" or isinstance(count, int)):
        raise ExpressionError("cycle() takes a duration, or a whole number and a duration")
    return f"R{count}/{iso(period)}"


def _whole(value: Computed) -> Computed:
    """FEEL has one kind of number: 3.0 is as whole as 3."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _read(name: str, read: Callable[..., Any], *arguments: str | int) -> Any:
    try:
        return read(*arguments)
    except ExpressionSyntaxError as error:
        raise ExpressionError(f"{name}(): {error}") from None


# --- arithmetic (DMN 1.3, tables 55 to 57) --------------------------------------------------------

_PLUS, _MINUS, _TIMES, _BY = (
    Operation.ADD,
    Operation.SUBTRACT,
    Operation.MULTIPLY,
    Operation.DIVIDE,
)
_NUMBER = "number"
_RESULTS: dict[tuple[str, Operation, str], str] = {
    **{(each, sign, each): each for each in (DAYS, MONTHS) for sign in (_PLUS, _MINUS)},
    **{(when, sign, each): when for when in (DATE, MOMENT) for sign in (_PLUS, _MINUS)
       for each in (DAYS, MONTHS)},
    **{(each, _PLUS, when): when for when in (DATE, MOMENT) for each in (DAYS, MONTHS)},
    **{(when, _MINUS, other): DAYS for when in (DATE, MOMENT) for other in (DATE, MOMENT)},
    **{(each, sign, _NUMBER): each for each in (DAYS, MONTHS) for sign in (_TIMES, _BY)},
    **{(_NUMBER, _TIMES, each): each for each in (DAYS, MONTHS)},
    **{(each, _BY, each): _NUMBER for each in (DAYS, MONTHS)},
}  # fmt: skip
_COMPUTE: dict[Operation, Callable[[Any, Any], Any]] = {
    _PLUS: operator.add,
    _MINUS: operator.sub,
    _TIMES: operator.mul,
    _BY: operator.truediv,
}


def result_kind(left: str, sign: Operation, right: str) -> str | None:
    """The kind of `left sign right` with a date or duration; None: FEEL does not have it."""
    return _RESULTS.get((left, sign, right))


def calculate(left: Computed, sign: Operation, right: Computed, kinds: tuple[str, str]) -> Computed:
    """The value of an operation that `result_kind` knows; raises ExpressionError."""
    if sign is _PLUS and kinds[0] in (DAYS, MONTHS):
        left, right, kinds = right, left, (kinds[1], kinds[0])
    if kinds[0] in (DATE, MOMENT) and kinds[1] in (DATE, MOMENT) and kinds[0] != kinds[1]:
        left, right = read_moment(left), read_moment(right)  # type: ignore[arg-type]
    try:
        match left, right:
            case date(), Months(months):
                step = isodate.Duration(months=months)
                return left + step if sign is _PLUS else left - step  # type: ignore[no-any-return]
            case date(), timedelta() if kinds[0] == DATE:
                moment = _COMPUTE[sign](read_moment(left), right)
                return moment.date()  # type: ignore[no-any-return]
            case Months(), Months():
                found = _COMPUTE[sign](left.months, right.months)
                return found if sign is _BY else Months(found)
            case Months(), _:
                return Months(int(_COMPUTE[sign](left.months, right)))
            case _, Months():
                return Months(int(_COMPUTE[sign](left, right.months)))
        return _COMPUTE[sign](left, right)  # type: ignore[no-any-return]
    except ZeroDivisionError:
        raise ExpressionError(f"'{sign}' divides {iso(left)} by zero") from None  # type: ignore[arg-type]
    except (ValueError, ArithmeticError):
        raise ExpressionError(f"the result of '{sign}' is beyond the years 1 to 9999") from None
