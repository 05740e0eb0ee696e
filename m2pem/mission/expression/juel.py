"""How JUEL coerces values: Jakarta Expression Language 5.0, clauses 1.6 to 1.10 and 1.23.

A text in arithmetic, or beside a number, is read as a number; null and "" count as 0 there, and as
false where a boolean is wanted. Computing with doubles may be infinite on the way; what is so at
the end is an error.
"""

import math
import operator
import re
from collections.abc import Callable
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression.operators import ORDERS, WHOLE, Binary, Test, bounded, describe, equal
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.expression.tree import Comparison, Operation
from m2pem.mission.values import Value

_LONG = re.compile(r"[+-]?[0-9]+")
_DOUBLE = re.compile(r"\s*[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\s*")
_OF_DOUBLES = frozenset(".eE")
_NUMBERS = frozenset({int, float})
_DIRECT = frozenset({bool, int, str})
"""Types whose values Python compares as Java does."""


def truth(value: Computed, what: str) -> bool:
    """The boolean that a value is coerced to; `what` names the value in the error."""
    if isinstance(value, bool):
        return value
    if value is None:
        return False
    if isinstance(value, str):
        return value.lower() == "true"
    raise ExpressionError(f"{what} takes true or false, not {describe(value)}")


def result(value: Computed) -> Value:
    """What data holds of a value: no number that is infinite or none."""
    if isinstance(value, float):
        bounded(value, "the expression")
    return value  # type: ignore[no-any-return]


def _is_double(value: Computed) -> bool:
    return isinstance(value, float) or (
        isinstance(value, str) and not _OF_DOUBLES.isdisjoint(value)
    )


def _double(value: Computed) -> float:
    return float(_number(value, _DOUBLE))


def _long(value: Computed) -> int:
    return int(_number(value, _LONG))


def _number(value: Computed, written: re.Pattern[str]) -> Any:
    if type(value) in _NUMBERS:
        return value
    if value is None or value == "":
        return 0
    if isinstance(value, str) and written.fullmatch(value):
        return value
    whole = " whole" if isinstance(value, str) and written is _LONG else ""
    raise ExpressionError(f"{describe(value)} is no{whole} number")


def negate(value: Computed) -> Computed:
    """`-value`; of null 0."""
    if type(value) is int:
        return bounded(-value, "'-'", value)
    if value == "":
        raise ExpressionError("'-' takes a number, not an empty text")
    if value is None:
        return 0
    return -_double(value) if _is_double(value) else bounded(-_long(value), "'-'", value)


def _arithmetic(
    symbol: Operation,
    compute: Callable[[Any, Any], Any],
    doubles: Callable[[float, float], float],
) -> Binary:
    what, divides = f"'{symbol}'", symbol is Operation.DIVIDE

    def apply(left: Computed, right: Computed) -> Computed:
        if divides or not type(left) is type(right) is int:
            if left is None and right is None:
                return 0
            if divides or _is_double(left) or _is_double(right):
                return doubles(_double(left), _double(right))
            left, right = _long(left), _long(right)
        try:
            return bounded(compute(left, right), what, left, right)
        except ZeroDivisionError:
            raise ExpressionError(f"'{symbol}' divides {describe(left)} by zero") from None

    return apply


def divide(left: float, right: float) -> float:
    """The quotient of two doubles (IEEE 754): infinite, or not a number, for a divisor of 0."""
    if right:
        return left / right
    if left == 0 or math.isnan(left):
        return math.nan
    return math.copysign(math.inf, left) * math.copysign(1.0, right)


def remainder(left: float, right: float) -> float:
    """The remainder of two doubles, with the sign of the dividend; not a number for 0."""
    return math.nan if right == 0 or math.isinf(left) else math.fmod(left, right)


def _whole_remainder(left: int, right: int) -> int:
    rest = abs(left) % abs(right)
    return -rest if left < 0 else rest


ARITHMETIC: dict[Operation, Binary] = {
    **{sign: _arithmetic(sign, compute, compute) for sign, compute in WHOLE.items()},
    Operation.DIVIDE: _arithmetic(Operation.DIVIDE, operator.truediv, divide),
    Operation.MODULO: _arithmetic(Operation.MODULO, _whole_remainder, remainder),
}


def _text(value: Computed) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        raise ExpressionError(f"{describe(value)} is not compared with a text")
    return value


def _pair(left: Computed, right: Computed, *, ordered: bool) -> tuple[Any, Any]:
    """Two values, neither null, coerced to one type."""
    values = left, right
    numbers = [
        each for each in values if isinstance(each, int | float) and not isinstance(each, bool)
    ]
    if any(isinstance(each, float) for each in numbers):
        return _ordered_double(left), _ordered_double(right)
    if numbers:
        return _long(left), _long(right)
    texts = any(isinstance(each, str) for each in values)
    if any(isinstance(each, bool) for each in values) and not (ordered and texts):
        return truth(left, "a comparison"), truth(right, "a comparison")
    if texts:
        return _text(left), _text(right)
    if ordered:
        raise ExpressionError(f"{describe(left)} and {describe(right)} have no order")
    return values


def _ordered_double(value: Computed) -> tuple[float, float]:
    """A double by Java's order, in which -0.0 is before 0.0."""
    number = _double(value)
    if math.isnan(number):
        raise ExpressionError("what is compared is not a number: it comes of a division of 0 by 0")
    return number, math.copysign(1.0, number)


def _equal(left: Computed, right: Computed) -> bool:
    if left is None or right is None:
        return left is right
    if type(left) is type(right) and type(left) in _DIRECT:
        return bool(left == right)
    one, other = _pair(left, right, ordered=False)
    return equal(one, other) if isinstance(one, list | dict) else bool(one == other)


def _ordering(compare: Callable[[Any, Any], bool], *, or_equal: bool) -> Test:
    """An order. A boolean beside a text is ordered as a text, but where `==` holds it is equal."""

    def test(left: Computed, right: Computed) -> bool:
        if left is None or right is None:
            return or_equal and left is right
        if type(left) is type(right) and type(left) in _DIRECT:
            return compare(left, right)
        if type(left) in _NUMBERS and type(right) in _NUMBERS:
            low, high = float(left), float(right)
            if low < high or low > high:
                return compare(low, high)
        one, other = _pair(left, right, ordered=True)
        if isinstance(one, str) and _equal(left, right):
            return or_equal
        return compare(one, other)

    return test


COMPARISONS: dict[Comparison, Test] = {
    Comparison.EQUAL: _equal,
    Comparison.NOT_EQUAL: lambda left, right: not _equal(left, right),
    **{sign: _ordering(compare, or_equal=compare(0, 0)) for sign, compare in ORDERS.items()},
}
