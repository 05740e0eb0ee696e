"""Arithmetic of FEEL: numbers, texts, dates, times and durations (DMN 1.5, tables 55 to 57)."""

import operator
from collections.abc import Callable, Mapping
from datetime import UTC, date, datetime, time, timedelta
from decimal import Decimal
from functools import partial
from typing import Any

from m2pem.mission.expression.feel_values import (
    DIGITS,
    FeelValue,
    describe,
    instant,
    is_number,
    kind,
    number,
    without_value,
)
from m2pem.mission.expression.operators import bounded_text
from m2pem.mission.expression.temporal import DATE, DAYS, MOMENT, MONTHS, TIME, Months
from m2pem.mission.expression.tree import Operation

_WHOLE: Mapping[Operation, Callable[[int, int], int]] = {
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
    Operation.MULTIPLY: operator.mul,
}
_MOST_WHOLE = 10**18


_COMPUTE: Mapping[Operation, Callable[[Decimal, Decimal], Decimal]] = {
    Operation.ADD: DIGITS.add,
    Operation.SUBTRACT: DIGITS.subtract,
    Operation.MULTIPLY: DIGITS.multiply,
    Operation.DIVIDE: DIGITS.divide,
    Operation.POWER: DIGITS.power,
}


def _numbers(symbol: Operation, left: Decimal, right: Decimal) -> Decimal | None:
    try:
        found = _COMPUTE[symbol](left, right)
    except ArithmeticError:
        return None
    return found if found.is_finite() else None


def arithmetic(symbol: Operation, left: FeelValue, right: FeelValue) -> FeelValue:
    """`left symbol right`; null of null, and without a value otherwise."""
    if left is None or right is None:
        return None
    if type(left) is int is type(right) and symbol in _WHOLE:
        whole: int = _WHOLE[symbol](left, right)
        if -_MOST_WHOLE < whole < _MOST_WHOLE:
            return whole
    found: FeelValue = None
    kinds = kind(left), kind(right)
    if kinds == ("number", "number"):
        found = _numbers(symbol, number(left), number(right))
    elif kinds == ("text", "text") and symbol is Operation.ADD:
        return bounded_text(left + right, "'+'")
    else:
        try:
            found = _temporal(symbol, left, right, kinds)
        except (ArithmeticError, ValueError):
            found = None
    if found is None:
        without_value(f"'{symbol}' of {describe(left)} and {describe(right)}")
    return found


_LENGTHS, _WHENS = (DAYS, MONTHS), (DATE, MOMENT, TIME)


def _temporal(
    symbol: Operation, left: FeelValue, right: FeelValue, kinds: tuple[str, str]
) -> FeelValue:
    sign = {Operation.ADD: 1, Operation.SUBTRACT: -1}.get(symbol)
    match kinds:
        case (when, other) if (
            when in (DAYS, MONTHS) and other in (DATE, MOMENT, TIME) and sign == 1
        ):
            return _temporal(symbol, right, left, (other, when))
        case ("date" | "date and time", "years and months duration") if sign:
            return _months_later(left, sign * right.months)
        case ("date", "days and time duration") if sign:
            return (datetime.combine(left, time()) + sign * right).date()
        case ("date and time", "days and time duration") if sign:
            return _later(left, sign * right)
        case ("time", "days and time duration") if sign:
            moved = datetime.combine(date(2000, 1, 2), left.replace(tzinfo=None)) + sign * right
            return moved.time().replace(tzinfo=left.tzinfo)
        case ("date" | "date and time", "date" | "date and time") if sign == -1:
            return _between(left, right)
        case ("time", "time") if sign == -1:
            return instant(left) - instant(right)
        case ("days and time duration", "days and time duration") if sign:
            return left + sign * right
        case ("years and months duration", "years and months duration") if sign:
            return Months(left.months + sign * right.months)
        case ("number", "days and time duration" | "years and months duration") if (
            symbol is Operation.MULTIPLY
        ):
            return _scaled(right, number(left))
        case ("days and time duration" | "years and months duration", "number"):
            if symbol is Operation.MULTIPLY:
                return _scaled(left, number(right))
            if symbol is Operation.DIVIDE and right:
                return _scaled(left, 1 / number(right))
        case ("days and time duration", "days and time duration") if symbol is Operation.DIVIDE:
            return _numbers(symbol, _microseconds(left), _microseconds(right))
        case ("years and months duration", "years and months duration"):
            if symbol is Operation.DIVIDE:
                return _numbers(symbol, Decimal(left.months), Decimal(right.months))
    return None


def _microseconds(value: timedelta) -> Decimal:
    return Decimal(value // timedelta(microseconds=1))


def _scaled(value: timedelta | Months, by: Decimal) -> timedelta | Months:
    if isinstance(value, Months):
        return Months(int(value.months * by))
    return timedelta(microseconds=int(_microseconds(value) * by))


def _months_later(value: Any, months: int) -> Any:
    count = value.year * 12 + value.month - 1 + months
    year, month = divmod(count, 12)
    day = value.day
    while True:
        try:
            return value.replace(year=year, month=month + 1, day=day)
        except ValueError:
            if day <= 28:
                raise
            day -= 1


def _later(value: datetime, by: timedelta) -> datetime:
    """Durations are counted in time that passes, where the zone is known."""
    if value.tzinfo is None:
        return value + by
    return (value.astimezone(UTC) + by).astimezone(value.tzinfo)


def _between(left: date, right: date) -> timedelta | None:
    ends = [
        each if isinstance(each, datetime) else datetime.combine(each, time(), UTC)
        for each in (left, right)
    ]
    if (ends[0].tzinfo is None) != (ends[1].tzinfo is None):
        return None
    return ends[0] - ends[1]


ARITHMETIC: Mapping[Operation, Callable[[Any, Any], FeelValue]] = {
    each: partial(arithmetic, each) for each in Operation
}


def negate(value: FeelValue) -> FeelValue:
    """`-value`."""
    if is_number(value):
        return number(value).copy_negate()
    if isinstance(value, timedelta):
        return -value
    if isinstance(value, Months):
        return Months(-value.months)
    if value is not None:
        without_value(f"'-' of {describe(value)}")
    return None
