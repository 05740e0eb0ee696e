"""Arithmetic of FEEL: numbers, texts, dates, times and durations (DMN 1.5, tables 55 to 57)."""

import operator
from calendar import monthrange
from collections.abc import Callable, Mapping
from datetime import UTC, date, datetime, time, timedelta
from decimal import Decimal
from typing import Any, TypeAlias

from m2pem.mission.expression.feel_values import (
    DIGITS,
    NUMBERS,
    FeelValue,
    as_written,
    describe,
    instant,
    is_number,
    kind,
    number,
    without_value,
)
from m2pem.mission.expression.operators import WHOLE, bounded_text
from m2pem.mission.expression.temporal import DATE, DAYS, MOMENT, MONTHS, TIME, Months
from m2pem.mission.expression.tree import Operation

_MOST_WHOLE = 10**18
_Compute: TypeAlias = Callable[[Any, Any], FeelValue]

_COMPUTE: Mapping[Operation, Callable[[Any, Any], Decimal]] = {
    Operation.ADD: DIGITS.add,
    Operation.SUBTRACT: DIGITS.subtract,
    Operation.MULTIPLY: DIGITS.multiply,
    Operation.DIVIDE: DIGITS.divide,
    Operation.POWER: DIGITS.power,
}


def _arithmetic(symbol: Operation, compute: Callable[[Any, Any], Decimal]) -> _Compute:
    whole = WHOLE.get(symbol)

    def apply(left: FeelValue, right: FeelValue) -> FeelValue:
        one, other = type(left), type(right)
        if one is other is int and whole:
            sure: int = whole(left, right)
            if -_MOST_WHOLE < sure < _MOST_WHOLE:
                return sure
        try:
            if one in NUMBERS and other in NUMBERS:
                found = compute(
                    as_written[left] if one is float else left,
                    as_written[right] if other is float else right,
                )
                if found.is_finite():
                    return found
            elif left is None or right is None:
                return None
            elif one is other is str and symbol is Operation.ADD:
                return bounded_text(left + right, "'+'")
            elif (value := _TEMPORAL[kind(left), symbol, kind(right)][1](left, right)) is not None:
                return value
        except (KeyError, ArithmeticError, ValueError):
            pass
        without_value(f"'{symbol}' of {describe(left)} and {describe(right)}")
        return None

    return apply


def _size(value: timedelta | Months) -> Decimal:
    """A duration in microseconds or months."""
    return Decimal(
        value.months if isinstance(value, Months) else value // timedelta(microseconds=1)
    )


def _quotient(left: Any, right: Any) -> Decimal:
    return DIGITS.divide(_size(left), _size(right))


def _scaled(value: timedelta | Months, by: FeelValue) -> timedelta | Months:
    size = int(_size(value) * number(by))
    return Months(size) if isinstance(value, Months) else timedelta(microseconds=size)


def _months_later(value: Any, by: Months) -> Any:
    year, month = divmod(value.year * 12 + value.month - 1 + by.months, 12)
    day = min(value.day, monthrange(year, month + 1)[1])
    return value.replace(year=year, month=month + 1, day=day)


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


def _clock_later(value: time, by: timedelta) -> time:
    moved = datetime.combine(date(2000, 1, 2), value.replace(tzinfo=None)) + by
    return moved.time().replace(tzinfo=value.tzinfo)


def _swapped(compute: _Compute) -> _Compute:
    return lambda left, right: compute(right, left)


def _back(later: _Compute) -> _Compute:
    return lambda value, by: later(value, negate(by))


_LATER: Mapping[tuple[str, str], _Compute] = {
    (DATE, DAYS): lambda day, by: (datetime.combine(day, time()) + by).date(),
    (DATE, MONTHS): _months_later,
    (MOMENT, DAYS): _later,
    (MOMENT, MONTHS): _months_later,
    (TIME, DAYS): _clock_later,
    (DAYS, DAYS): operator.add,
    (MONTHS, MONTHS): lambda left, right: Months(left.months + right.months),
}
_LENGTHS, _NUMBER = (DAYS, MONTHS), "number"
_TEMPORAL: Mapping[tuple[str, Operation, str], tuple[str, _Compute]] = {
    **{(by, Operation.ADD, to): (to, _swapped(later)) for (to, by), later in _LATER.items()},
    **{(to, Operation.ADD, by): (to, later) for (to, by), later in _LATER.items()},
    **{(to, Operation.SUBTRACT, by): (to, _back(later)) for (to, by), later in _LATER.items()},
    **{(one, Operation.SUBTRACT, other): (DAYS, _between)
       for one in (DATE, MOMENT) for other in (DATE, MOMENT)},
    (TIME, Operation.SUBTRACT, TIME): (DAYS, lambda one, other: instant(one) - instant(other)),
    **{(each, Operation.MULTIPLY, _NUMBER): (each, _scaled) for each in _LENGTHS},
    **{(_NUMBER, Operation.MULTIPLY, each): (each, _swapped(_scaled)) for each in _LENGTHS},
    **{(each, Operation.DIVIDE, _NUMBER): (each, lambda value, by: _scaled(value, 1 / number(by)))
       for each in _LENGTHS},
    **{(each, Operation.DIVIDE, each): (_NUMBER, _quotient) for each in _LENGTHS},
}  # fmt: skip
"""The kind of the result, and what computes it (DMN 1.5, tables 55 to 57)."""


def result_kind(left: str, sign: Operation, right: str) -> str | None:
    """The kind of `left sign right` with a date or duration; None: FEEL does not have it."""
    return _TEMPORAL.get((left, sign, right), (None,))[0]


ARITHMETIC: Mapping[Operation, Callable[[Any, Any], FeelValue]] = {
    sign: _arithmetic(sign, compute) for sign, compute in _COMPUTE.items()
}
"""`left symbol right`; null of null, and without a value otherwise."""


def negate(value: FeelValue) -> FeelValue:
    """`-value`."""
    if type(value) is int and -_MOST_WHOLE < value < _MOST_WHOLE:
        return -value
    if type(value) is float and not value.is_integer():
        return -value
    if is_number(value):
        return number(value).copy_negate()
    if isinstance(value, timedelta | Months):
        return -value
    if value is not None:
        without_value(f"'-' of {describe(value)}")
    return None
