"""What the operators do with values (docs/conditions.md). Errors are ExpressionError."""

import math
import operator
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression import literals
from m2pem.mission.expression.literals import MAX_INTEGER, MIN_INTEGER, show_scalar
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.expression.tree import Comparison, Operation

MAX_SIZE = 100_000
"""How large a computed text or list may be: its characters and values, nested ones included."""

MAX_VALUE_DEPTH = 100
"""How deep lists and maps may nest in each other."""

MAX_WORK = 100_000
"""How many values one evaluation may look at. Nothing else happens in an executive meanwhile, STOP
included, so it must not take long; and a replay must come to the same end on any computer."""

TEXT_AS_VALUE = 1_000
"""So many characters of a text count as one value."""


work_left = ContextVar("work_left", default=MAX_WORK)
"""How many values an evaluation may still look at."""


def begin_work() -> None:
    """Count from 0 what is looked at."""
    work_left.set(MAX_WORK)


def look_at(values: int) -> None:
    """Count values; raises ExpressionError when they are too many."""
    left = work_left.get() - values
    work_left.set(left)
    if left < 0:
        raise ExpressionError(f"it looks at more than {MAX_WORK:,} values")


Binary = Callable[[Computed, Computed], Computed]
Test = Callable[[Computed, Computed], bool]

SAME: Mapping[Comparison, Callable[[Any, Any], bool]] = {
    Comparison.EQUAL: operator.eq,
    Comparison.NOT_EQUAL: operator.ne,
}
ORDERS: Mapping[Comparison, Callable[[Any, Any], bool]] = {
    Comparison.LESS: operator.lt,
    Comparison.LESS_EQUAL: operator.le,
    Comparison.GREATER: operator.gt,
    Comparison.GREATER_EQUAL: operator.ge,
}
WHOLE: Mapping[Operation, Callable[[Any, Any], Any]] = {
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
    Operation.MULTIPLY: operator.mul,
}
"""Those whose results of whole numbers are whole."""

_NUMBERS = frozenset({int, float})


def kind(value: Computed) -> str:
    """The type of a value as messages and the docs call it."""
    match value:
        case None:
            return "null"
        case bool():
            return "boolean"
        case int() | float():
            return "number"
        case str():
            return "text"
        case list():
            return "list"
        case dict():
            return "map"
    raise TypeError(type(value))


def describe(value: Computed) -> str:
    """The value with its kind, shortened, for a message."""
    return literals.describe(value)


def truth(value: Computed, what: str) -> bool:
    """The boolean, null being false. `what` names the value in the message."""
    if value is True or value is False:
        return value
    if value is None:
        return False
    raise ExpressionError(f"{what} takes true or false, not {describe(value)}")


def equal(left: Computed, right: Computed) -> bool:
    """Same kind and same value; integers and doubles compare by exact value. A number and a text
    are an error."""
    return _equal(left, right, MAX_VALUE_DEPTH)


def _equal(left: Computed, right: Computed, depth: int) -> bool:
    if isinstance(left, list) and isinstance(right, list):
        if depth == 0:
            raise ExpressionError(f"'==' compares lists nested deeper than {MAX_VALUE_DEPTH}")
        look_at(len(left))
        return len(left) == len(right) and all(
            _equal(a, b, depth - 1) for a, b in zip(left, right, strict=True)
        )
    if isinstance(left, dict) and isinstance(right, dict):
        if depth == 0:
            raise ExpressionError(f"'==' compares maps nested deeper than {MAX_VALUE_DEPTH}")
        look_at(len(left))
        return left.keys() == right.keys() and all(
            _equal(value, right[key], depth - 1) for key, value in left.items()
        )
    if type(left) is type(right):
        return bool(left == right)
    kinds = kind(left), kind(right)
    if {*kinds} == _CONFUSED:
        raise ExpressionError(_confusion("==", left, right))
    return kinds[0] == kinds[1] and bool(left == right)


_CONFUSED = {"number", "text"}


def _confusion(symbol: str, left: Computed, right: Computed) -> str:
    """Why a number is not compared with a text."""
    pair = f"{describe(left)} with {describe(right)}"
    return f"'{symbol}' compares {pair}; number(x) or text(x) makes one of the other's kind"


def contains(container: Computed, item: Computed) -> bool:
    """`item in container`; nothing is in null."""
    if isinstance(container, list):
        look_at(len(container))
        wanted = kind(item)
        return any(
            each == item if type(each) is str else kind(each) == wanted and equal(each, item)
            for each in container
        )
    if container is None:
        return False
    hint = "; use contains(text, part)" if isinstance(container, str) else ""
    raise ExpressionError(f"'in' takes a list on its right, not {describe(container)}{hint}")


def index(container: Computed, key: Computed) -> Computed:
    """`container[key]`; null for what is not there."""
    if container is None or key is None:
        return None
    if isinstance(container, list) and isinstance(key, int) and not isinstance(key, bool):
        return container[key] if -len(container) <= key < len(container) else None
    if isinstance(container, dict) and isinstance(key, str):
        return container.get(key)
    raise ExpressionError(f"{describe(container)} has no item under {describe(key)}")


def _ordering(symbol: Comparison, compare: Callable[[Any, Any], bool]) -> Test:
    def test(left: Computed, right: Computed) -> bool:
        if type(left) in _NUMBERS and type(right) in _NUMBERS:
            return compare(left, right)
        kinds = {kind(left), kind(right)}
        if kinds in ({"number"}, {"text"}):
            return compare(left, right)
        if "null" in kinds:
            return False
        if kinds == _CONFUSED:
            raise ExpressionError(_confusion(symbol, left, right))
        if len(kinds) > 1:
            return False
        raise ExpressionError(f"'{symbol}' cannot order {describe(left)} and {describe(right)}")

    return test


COMPARISONS: dict[Comparison, Test] = {
    Comparison.EQUAL: equal,
    Comparison.NOT_EQUAL: lambda left, right: not equal(left, right),
    **{sign: _ordering(sign, compare) for sign, compare in ORDERS.items()},
}


def bounded(value: int | float, what: str, *operands: Computed) -> int | float:
    """The result of `what` on the operands, when it is a 64-bit integer or a finite double."""
    if MIN_INTEGER <= value <= MAX_INTEGER if isinstance(value, int) else math.isfinite(value):
        return value
    problem = "does not fit into a 64-bit integer" if isinstance(value, int) else "is not finite"
    of = " of " + " and ".join(describe(operand) for operand in operands) if operands else ""
    raise ExpressionError(f"the result of {what}{of} {problem}")


def bounded_text(value: str, what: str) -> str:
    """The text that an operation made, when it is not too long."""
    if len(value) > MAX_SIZE:
        raise ExpressionError(f"the result of {what} is longer than {MAX_SIZE} characters")
    look_at(len(value) // TEXT_AS_VALUE)
    return value


def bounded_list(items: list[Computed]) -> list[Computed]:
    """A new list, when it is not too large: lists of lists could double with every step."""
    size = 1
    waiting: list[tuple[Computed, int]] = [(items, 0)]
    while waiting:
        container, depth = waiting.pop()
        size += len(container)
        if isinstance(container, dict):
            size += sum(map(len, container))
            container = container.values()
        for each in container:
            if isinstance(each, str):
                size += len(each)
            elif isinstance(each, list | dict):
                waiting.append((each, depth + 1))
        if size > MAX_SIZE:
            raise ExpressionError(f"the list is larger than {MAX_SIZE} values and characters")
        if container and depth >= MAX_VALUE_DEPTH:
            raise ExpressionError(f"the list is nested deeper than {MAX_VALUE_DEPTH}")
    look_at(size)
    return items


def _arithmetic(
    symbol: Operation, compute: Callable[[int | float, int | float], int | float]
) -> Binary:
    takes = "two numbers or two texts" if symbol is Operation.ADD else "two numbers"
    what = f"'{symbol}'"

    def apply(left: Computed, right: Computed) -> Computed:
        if left is None or right is None:
            return None
        if type(left) in _NUMBERS and type(right) in _NUMBERS:
            try:
                result = compute(left, right)
            except ZeroDivisionError:
                raise ExpressionError(f"'{symbol}' divides {describe(left)} by zero") from None
            except OverflowError:
                result = math.inf
            return bounded(result, what, left, right)
        if symbol is Operation.ADD and isinstance(left, str) and isinstance(right, str):
            return bounded_text(left + right, "'+'")
        hint = "; text(x) turns a value into a text" if "text" in (kind(left), kind(right)) else ""
        raise ExpressionError(
            f"'{symbol}' takes {takes}, not {describe(left)} and {describe(right)}"
            + (hint if symbol is Operation.ADD else "")
        )

    return apply


ARITHMETIC: dict[Operation, Binary] = {
    sign: _arithmetic(sign, compute)
    for sign, compute in {**WHOLE, Operation.DIVIDE: operator.truediv}.items()
}


def negate(value: Computed) -> Computed:
    """`-value`."""
    if value is None:
        return None
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return bounded(-value, "'-'", value)
    raise ExpressionError(f"'-' takes a number, not {describe(value)}")


def text_of(value: bool | int | float | str) -> str:
    """The value as a text."""
    if isinstance(value, (int, float)):
        bounded(value, "text()", value)
    return show_scalar(value)


def join(values: list[Computed]) -> str:
    """The values written one after the other: the value of a text with `${...}` parts."""
    texts = []
    for value in values:
        if value is None or isinstance(value, (list, dict)):
            raise ExpressionError(f"a '${{...}}' part of a text must not be {describe(value)}")
        texts.append(text_of(value))
    return bounded_text("".join(texts), "'${...}'")
