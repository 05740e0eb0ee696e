"""Values of FEEL: their kinds, comparison and arithmetic (DMN 1.5, clauses 10.3.2.3 and 10.3.2.11).

Numbers are decimals of 34 digits, beside the integers and doubles of data. An operation that has no
value gives null, and the first such cause of an evaluation is kept: see `without_value`.
"""

from collections.abc import Callable, Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta, timezone
from decimal import Context, Decimal
from functools import partial
from math import isfinite
from typing import Any, TypeAlias

from m2pem.errors import ExpressionError
from m2pem.mission.expression import literals
from m2pem.mission.expression.literals import MAX_INTEGER, MIN_INTEGER
from m2pem.mission.expression.operators import (
    MAX_VALUE_DEPTH,
    ORDERS,
    bounded,
    bounded_text,
    look_at,
)
from m2pem.mission.expression.temporal import DATE, DAYS, MOMENT, MONTHS, TIME, Months, iso
from m2pem.mission.expression.tree import Comparison, Node

DIGITS = Context(prec=34, Emin=-6143, Emax=6144)
"""Decimal128 of IEEE 754-2008."""

FeelValue: TypeAlias = Any
"""A value of data, a decimal, a date or duration, a `Range` or a `Closure`, also in lists, maps."""


@dataclass(frozen=True, slots=True)
class Range:
    """Values from `low` to `high`; `open_low`, `open_high`: without that end. `negated`: all but
    `low`. `descends`: an iteration may go from a higher value to a lower one."""

    low: FeelValue
    high: FeelValue
    low_included: bool
    high_included: bool
    negated: bool = False
    descends: bool = False
    open_low: bool = False
    open_high: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """A function that an expression defines. `read`: reads the names around it."""

    parameters: tuple[str, ...]
    body: Node
    read: Callable[[str], FeelValue]
    call: Callable[["Closure", list[FeelValue]], FeelValue]


_cause: ContextVar[str] = ContextVar("_cause", default="")


def begin() -> None:
    """Forget what the evaluation before had no value for."""
    _cause.set("")


cause = _cause.get
"""Return why the first operation without a value had none; "": each had one."""


def without_value(why: str) -> None:
    """Note why an operation gives null."""
    if not _cause.get():
        _cause.set(why)


_KINDS: dict[type, str] = {
    bool: "boolean",
    int: "number",
    float: "number",
    Decimal: "number",
    str: "text",
    list: "list",
    dict: "context",
    date: DATE,
    datetime: MOMENT,
    time: TIME,
    timedelta: DAYS,
    Months: MONTHS,
    Range: "range",
    Closure: "function",
    type(None): "null",
}


def kind(value: FeelValue) -> str:
    """The kind of a value."""
    return _KINDS[type(value)]


def describe(value: FeelValue) -> str:
    """The value with its kind, shortened, for a message."""
    if isinstance(value, Decimal):
        return f"the number {_plain(value)}"
    if isinstance(value, date | time | timedelta | Months):
        return f"the {kind(value)} {iso(value)}"
    return f"a {kind(value)}" if isinstance(value, Range | Closure) else literals.describe(value)


class _AsWritten(dict[float, Decimal]):
    """The decimals that doubles are written as: those of a mission come again and again."""

    def __missing__(self, value: float) -> Decimal:
        if len(self) >= MAX_DOUBLES:
            self.clear()
        found = self[value] = Decimal(repr(value))
        return found


MAX_DOUBLES = 1_000
as_written = _AsWritten()
NUMBERS = frozenset({int, float, Decimal})


def number(value: FeelValue) -> Decimal:
    """A number as a decimal."""
    if type(value) is Decimal:
        return value
    return as_written[value] if type(value) is float else Decimal(value)


def is_number(value: FeelValue) -> bool:
    """Whether a value is a number."""
    return type(value) in NUMBERS


def to_data(value: FeelValue) -> Any:
    """The value as data holds it: decimals as integers or doubles, dates as ISO 8601 texts.

    Raises:
        ExpressionError: a number does not fit into either.
    """
    kind = type(value)
    if kind in _DIRECT:
        return value
    if kind is Decimal:
        double = float(value)
        exact = double if abs(double) < 2**53 else value
        if double.is_integer() and value == (whole := int(exact)):
            return whole if MIN_INTEGER <= whole <= MAX_INTEGER else double
        return double if isfinite(double) else bounded(double, "the expression")
    if isinstance(value, list):
        return [to_data(each) for each in value]
    if isinstance(value, dict):
        return {key: to_data(each) for key, each in value.items()}
    if isinstance(value, datetime) and (offset := value.utcoffset()) is not None:
        return iso(value.replace(tzinfo=timezone(offset)))  # ISO 8601 has no names of zones
    if isinstance(value, date | time | timedelta | Months):
        return iso(value)
    return text(value) if isinstance(value, Range | Closure) else value


def refuse_null() -> None:
    """Raise ExpressionError where the value of an expression is null as an operation had none."""
    if why := _cause.get():
        raise ExpressionError(f"it has no value: {why}")


# --- texts ----------------------------------------------------------------------------------------


def _plain(value: FeelValue) -> str:
    found = number(value)
    if found == found.to_integral_value():
        return str(found.quantize(Decimal(1), context=Context(prec=7000))) if found else "0"
    return f"{found.normalize(DIGITS):f}"


def text(value: FeelValue, quoted: bool = False, in_range: bool = False) -> str:
    """`string(value)`; texts in lists, contexts and ranges are quoted."""
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"' if quoted else value
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if is_number(value):
        return _plain(value)
    if isinstance(value, date | time | timedelta | Months):
        return f'@"{iso(value)}"' if in_range else iso(value)
    if isinstance(value, list):
        return bounded_text("[" + ", ".join(text(each, True) for each in value) + "]", "string()")
    if isinstance(value, dict):
        items = ", ".join(f"{_key(key)}: {text(each, True)}" for key, each in value.items())
        return bounded_text("{" + items + "}", "string()")
    return _range_text(value) if isinstance(value, Range) else "function"


def _key(key: str) -> str:
    return key if key.replace("_", "a").replace(" ", "a").isalnum() else text(key, True)


def _range_text(value: Range) -> str:
    ends = [text(each, quoted=True, in_range=True) for each in (value.low, value.high)]
    if value.negated:
        return f"!={ends[0]}"
    if value.open_low:
        return f"(<{'=' if value.high_included else ''} {ends[1]})"
    if value.open_high:
        return f"(>{'=' if value.low_included else ''} {ends[0]})"
    brackets = "[" if value.low_included else "(", "]" if value.high_included else ")"
    return f"{brackets[0]}{ends[0]}..{ends[1]}{brackets[1]}"


# --- comparison -----------------------------------------------------------------------------------


def equal(left: FeelValue, right: FeelValue, depth: int = MAX_VALUE_DEPTH) -> bool | None:
    """Whether two values of one kind are equal; null: they are of different kinds."""
    if left is None or right is None:
        return left is right
    if type(left) is type(right) and type(left) in _DIRECT:
        return bool(left == right)
    if type(left) in NUMBERS and type(right) in NUMBERS:
        return number(left) == number(right)
    kinds = kind(left), kind(right)
    if kinds[0] != kinds[1] or depth == 0:
        without_value(f"'=' of {describe(left)} and {describe(right)}")
        return None
    match kinds[0]:
        case "list":
            look_at(len(left))
            if len(left) != len(right):
                return False
            return all_equal(zip(left, right, strict=True), depth)
        case "context":
            look_at(len(left))
            if left.keys() != right.keys():
                return False
            return all_equal(((each, right[key]) for key, each in left.items()), depth)
        case "range":
            ends = ((left.low, right.low), (left.high, right.high))
            return _shape(left) == _shape(right) and all_equal(ends, depth)
    if kinds[0] == TIME:  # the tests of the standard compare times to the millisecond
        left, right = (
            each.replace(microsecond=each.microsecond // 1000 * 1000) for each in (left, right)
        )
    return bool(instant(left) == instant(right))


def _shape(value: Range) -> tuple[bool, ...]:
    included = value.low_included, value.high_included
    return (*included, value.negated, value.open_low, value.open_high)


def all_equal(pairs: Any, depth: int) -> bool | None:
    """Whether all pairs are equal."""
    found = [equal(a, b, depth - 1) for a, b in pairs]
    return False if False in found else None if None in found else True


def instant(value: FeelValue) -> FeelValue:
    """What two values of one kind are compared by: a time with an offset by its instant."""
    if isinstance(value, datetime):
        offset = value.utcoffset()
        return value.replace(tzinfo=UTC) if offset is None else value.astimezone(UTC)
    if isinstance(value, time):
        of_day = datetime.combine(date.min, value.replace(tzinfo=None)) - datetime.min
        return of_day - (value.utcoffset() or timedelta())
    return value


_DIRECT = frozenset({bool, int, float, str})
"""Types whose values Python compares as FEEL does: two doubles have the order of what they are
written as."""

_ORDERED = frozenset({"number", "text", DATE, MOMENT, TIME, DAYS, MONTHS})
Ordered = Callable[[Any, Any], bool]


def ordered(symbol: str, compare: Ordered, left: FeelValue, right: FeelValue) -> bool | None:
    """Whether two values of one ordered kind have an order; null: they have none."""
    if left is None or right is None:
        return None
    if type(left) is type(right) and type(left) in _DIRECT and type(left) is not bool:
        return compare(left, right)
    if type(left) in NUMBERS and type(right) in NUMBERS:
        return compare(number(left), number(right))
    kinds = kind(left), kind(right)
    if kinds[0] != kinds[1] or kinds[0] not in _ORDERED:
        without_value(f"'{symbol}' of {describe(left)} and {describe(right)}")
        return None
    return compare(instant(left), instant(right))


def _unequal(left: FeelValue, right: FeelValue) -> bool | None:
    same = equal(left, right)
    return None if same is None else not same


COMPARISONS: Mapping[Comparison, Callable[[Any, Any], bool | None]] = {
    Comparison.EQUAL: equal,
    Comparison.NOT_EQUAL: _unequal,
    **{sign: partial(ordered, sign, compare) for sign, compare in ORDERS.items()},
}


def is_ordered(value: FeelValue) -> bool:
    """Whether values of its kind have an order, so that it may be the end of a range."""
    return kind(value) in _ORDERED or isinstance(value, bool)


def in_range(value: FeelValue, within: Range) -> bool | None:
    """Whether a value is in a range; null: it cannot be compared with its ends."""
    if within.negated:
        return _unequal(value, within.low)
    found: list[bool | None] = []
    if not within.open_low:
        above = Comparison.GREATER_EQUAL if within.low_included else Comparison.GREATER
        found.append(COMPARISONS[above](value, within.low))
    if not within.open_high:
        below = Comparison.LESS_EQUAL if within.high_included else Comparison.LESS
        found.append(COMPARISONS[below](value, within.high))
    return False if False in found else None if None in found else True


def contains(container: FeelValue, item: FeelValue) -> bool | None:
    """`item in container`: equal to it, in a range, or one of a list of such."""
    if isinstance(container, Range):
        return in_range(item, container)
    if isinstance(container, list) and not isinstance(item, list):
        look_at(len(container))
        return any(contains(each, item) for each in container)
    if isinstance(container, list):
        look_at(len(container))
        inside = (equal(each, item) for each in container if isinstance(each, list))
        return equal(container, item) or any(inside)
    return equal(item, container)


def truth(value: FeelValue) -> bool | None:
    """A boolean, or null; another value has no truth."""
    if value is None or isinstance(value, bool):
        return value
    without_value(f"{describe(value)} is not true or false")
    return None


# --- paths ----------------------------------------------------------------------------------------


def path(value: FeelValue, key: str) -> FeelValue:
    """`value.key`: an entry of a context, or of each context of a list; a property."""
    if value is None:
        return None
    if isinstance(value, dict):
        return value.get(key)
    if isinstance(value, list):
        look_at(len(value))
        return [path(each, key) for each in value]
    found = properties(value)
    if key in found:
        return found[key]
    without_value(f"{describe(value)} has no '{key}'")
    return None


def properties(value: FeelValue) -> dict[str, FeelValue]:
    """The properties of a date, duration or range (DMN 1.5, table 65)."""
    match value:
        case Months(months):
            sign = -1 if months < 0 else 1
            years, rest = divmod(abs(months), 12)
            return {"years": sign * years, "months": sign * rest}
        case timedelta():
            sign, size = (-1, -value) if value.days < 0 else (1, value)
            minutes, seconds = divmod(size.seconds, 60)
            parts = (size.days, minutes // 60, minutes % 60, seconds)
            names = ("days", "hours", "minutes", "seconds")
            return {name: sign * each for name, each in zip(names, parts, strict=True)}
        case Range():
            return {
                "start": value.low,
                "end": value.high,
                "start included": value.low_included,
                "end included": value.high_included,
            }
    found: dict[str, FeelValue] = {}
    if isinstance(value, date):
        found = {"year": value.year, "month": value.month, "day": value.day}
        found["weekday"] = value.isoweekday()
    if isinstance(value, datetime | time):
        found |= {"hour": value.hour, "minute": value.minute}
        found["second"] = Decimal(value.second)
        found["time offset"] = value.utcoffset()
        found["timezone"] = getattr(value.tzinfo, "key", None)
    return found
