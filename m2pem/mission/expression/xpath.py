"""How XPath 1.0 converts values (clauses 3.4, 3.5 and 4), and its functions of texts and numbers.

Null is a node that is not there: not a number, "" as a text, false; nothing but a boolean is equal
to it, and unequal neither. Numbers are doubles: they may be infinite, or not a number, on the way.
"""

import math
import operator
import re
from collections.abc import Callable
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression.juel import divide, remainder
from m2pem.mission.expression.operators import Binary, Test, bounded_text, describe, equal
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
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
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
    Operation.ADD: _arithmetic(operator.add),
    Operation.SUBTRACT: _arithmetic(operator.sub),
    Operation.MULTIPLY: _arithmetic(operator.mul),
    Operation.DIVIDE: _arithmetic(divide),
    Operation.MODULO: _arithmetic(remainder),
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
    Comparison.EQUAL: _equality(operator.eq),
    Comparison.NOT_EQUAL: _equality(operator.ne),
    Comparison.LESS: _ordering(operator.lt),
    Comparison.LESS_EQUAL: _ordering(operator.le),
    Comparison.GREATER: _ordering(operator.gt),
    Comparison.GREATER_EQUAL: _ordering(operator.ge),
}


# --- functions ------------------------------------------------------------------------------------


def rounded(value: Computed) -> Computed:
    """`round(value)`: of two whole numbers that are as near, the larger one."""
    return _whole(value, lambda found: math.floor(found + 0.5))


def floor(value: Computed) -> Computed:
    """`floor(value)`."""
    return _whole(value, math.floor)


def ceiling(value: Computed) -> Computed:
    """`ceiling(value)`."""
    return _whole(value, math.ceil)


def _whole(value: Computed, to_whole: Callable[[float], int]) -> Computed:
    found = number(value)
    return to_whole(found) if math.isfinite(found) else found


def concat(*values: Computed) -> Computed:
    """`concat(a, b, ...)`."""
    return bounded_text("".join(map(string, values)), "concat()")


def contains(value: Computed, part: Computed) -> Computed:
    """`contains(value, part)`."""
    return string(part) in string(value)


def starts_with(value: Computed, part: Computed) -> Computed:
    """`starts-with(value, part)`."""
    return string(value).startswith(string(part))


def before(value: Computed, mark: Computed) -> Computed:
    """`substring-before(value, mark)`: "" if the mark is not in it."""
    head, found, _ = _parted(value, mark)
    return head if found else ""


def after(value: Computed, mark: Computed) -> Computed:
    """`substring-after(value, mark)`: "" if the mark is not in it."""
    return _parted(value, mark)[2]


def _parted(value: Computed, mark: Computed) -> tuple[str, str, str]:
    text, wanted = string(value), string(mark)
    return text.partition(wanted) if wanted else ("", "", text)


def substring(value: Computed, start: Computed, length: Computed = math.inf) -> Computed:
    """`substring(value, start, length)`: the characters, counted from 1, that lie within both,
    rounded; none where one is not a number."""
    first, size = rounded(start), rounded(length)
    assert isinstance(first, int | float)
    assert isinstance(size, int | float)
    end = first + size
    return "".join(each for place, each in enumerate(string(value), 1) if first <= place < end)


def string_length(value: Computed) -> Computed:
    """`string-length(value)`."""
    return len(string(value))


def normalize_space(value: Computed) -> Computed:
    """`normalize-space(value)`."""
    return " ".join(re.split(f"[{_SPACE}]+", string(value).strip(_SPACE)))


def translate(value: Computed, wanted: Computed, by: Computed) -> Computed:
    """`translate(value, wanted, by)`: the characters of `wanted` by those at their places."""
    found: dict[int, str] = {}
    texts = string(wanted), string(by)
    for place, each in enumerate(texts[0]):
        found.setdefault(ord(each), texts[1][place : place + 1])
    return string(value).translate(found)
