"""How XPath 1.0 converts values (clauses 3.4, 3.5 and 4), and its functions of texts and numbers.

Null is a node that is not there: not a number, "" as a text, false; nothing but a boolean is equal
to it, and unequal neither. Numbers are doubles: they may be infinite, or not a number, on the way.
"""

import math
import re
from collections.abc import Callable
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression.juel import divide, remainder
from m2pem.mission.expression.literals import show_scalar
from m2pem.mission.expression.operators import (
    ORDERS,
    SAME,
    WHOLE,
    Binary,
    Test,
    bounded_text,
    describe,
    equal,
)
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.expression.tree import Comparison, Operation

_SPACE = " \t\r\n"
_NUMBER = re.compile(r"-?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_WHOLE = 2.0**53


def truth(value: Computed, what: str) -> bool:
    """`boolean(value)`; `what` is not needed: each value has one."""
    return bool(value) and not (isinstance(value, float) and math.isnan(value))


def number(value: Computed) -> int | float:
    """`number(value)`: of what is none, not a number."""
    if isinstance(value, int | float):
        return value + 0  # true is 1
    if isinstance(value, str):
        digits = value.strip(_SPACE)
        return float(digits) if _NUMBER.fullmatch(digits) else math.nan
    if value is None:
        return math.nan
    raise ExpressionError(f"{describe(value)} is not converted to a number")


def string(value: Computed) -> str:
    """`string(value)`: numbers without exponents, whole ones without a point."""
    if isinstance(value, str):
        return value
    if value is None:
        return ""
    if isinstance(value, int):
        return show_scalar(value)
    if not isinstance(value, float):
        raise ExpressionError(f"{describe(value)} is not converted to a text")
    if math.isnan(value):
        return "NaN"
    if math.isinf(value):
        return "Infinity" if value > 0 else "-Infinity"
    if value == int(value) and abs(value) < _WHOLE:
        return str(int(value))
    mantissa, _, exponent = repr(value).partition("e")
    places = len(mantissa.partition(".")[2]) - int(exponent or 0)
    return f"{value:.{max(0, places)}f}"


def negate(value: Computed) -> Computed:
    """`-value`."""
    return -number(value)


def _arithmetic(compute: Callable[[Any, Any], Any]) -> Binary:
    return lambda left, right: compute(_double(left), _double(right))


def _double(value: Computed) -> int | float:
    """A number; a whole one that a double cannot hold is rounded, as XPath has doubles only."""
    found = number(value)
    return found if abs(found) < _WHOLE else float(found)


ARITHMETIC: dict[Operation, Binary] = {
    sign: _arithmetic(compute)
    for sign, compute in {**WHOLE, Operation.DIVIDE: divide, Operation.MODULO: remainder}.items()
}


def _equality(compare: Callable[[Any, Any], bool]) -> Test:
    def test(left: Computed, right: Computed) -> bool:
        values = left, right
        if any(isinstance(each, bool) for each in values):
            return compare(truth(left, ""), truth(right, ""))
        if None in values:
            return False
        if any(isinstance(each, list | dict) for each in values):
            return compare(equal(left, right), True)
        if any(isinstance(each, int | float) for each in values):
            return compare(number(left), number(right))
        return compare(left, right)

    return test


def _ordering(compare: Callable[[Any, Any], bool]) -> Test:
    def test(left: Computed, right: Computed) -> bool:
        if isinstance(left, bool) or isinstance(right, bool):
            left, right = (truth(each, "") if each is None else each for each in (left, right))
        return compare(number(left), number(right))

    return test


COMPARISONS: dict[Comparison, Test] = {
    **{sign: _equality(compare) for sign, compare in SAME.items()},
    **{sign: _ordering(compare) for sign, compare in ORDERS.items()},
}


# --- functions ------------------------------------------------------------------------------------


def converted(
    compute: Callable[..., Computed], *to: Callable[[Computed], Computed]
) -> Callable[..., Computed]:
    """A function whose arguments are converted first, as each of its parameters says."""
    return lambda *values: compute(*(each(value) for each, value in zip(to, values, strict=False)))


def whole(to_whole: Callable[[float], int]) -> Callable[[Computed], Computed]:
    """A whole number near a value; what is infinite or not a number remains so."""

    def compute(value: Computed) -> Computed:
        found = number(value)
        return to_whole(found) if math.isfinite(found) else found

    return compute


rounded = whole(lambda found: math.floor(found + 0.5))
"""`round(value)`: of two whole numbers that are as near, the larger one."""


def concat(*values: Computed) -> Computed:
    """`concat(a, b, ...)`."""
    return bounded_text("".join(map(string, values)), "concat()")


def substring(text: str, first: float, size: float = math.inf) -> Computed:
    """The characters, counted from 1, that lie within both, rounded; none where one is not a
    number."""
    return "".join(each for place, each in enumerate(text, 1) if first <= place < first + size)


def normalize_space(text: str) -> Computed:
    """The text without spaces at its ends, and with single ones in it."""
    return " ".join(re.split(f"[{_SPACE}]+", text.strip(_SPACE)))


def translate(text: str, wanted: str, by: str) -> Computed:
    """The text with the characters of `wanted` by those at their places."""
    found: dict[int, str] = {}
    for place, each in enumerate(wanted):
        found.setdefault(ord(each), by[place : place + 1])
    return text.translate(found)
