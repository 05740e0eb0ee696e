"""Conditions on the items of a list, under a name of their own."""

from collections.abc import Callable

from m2pem.errors import ExpressionError
from m2pem.model.expression.literals import describe
from m2pem.model.expression.tree import binds
from m2pem.model.values import ReadValue, Value


def some(
    variable: str, collection: Callable[[ReadValue], Value], holds: Callable[[ReadValue], bool]
) -> Callable[[ReadValue], bool]:
    """Whether a condition holds for an item of a list, which it reads as `variable`."""

    def test(read: ReadValue) -> bool:
        items = collection(read)
        if items is None:
            return False
        if not isinstance(items, list):
            raise ExpressionError(f"'some' and 'every' take a list, not {describe(items)}")
        return any(holds(_with(variable, item, read)) for item in items)

    return test


def _with(variable: str, item: Value, read: ReadValue) -> ReadValue:
    def bound(name: str) -> Value:
        return _part(item, name[len(variable) + 1 :]) if binds(variable, name) else read(name)

    return bound


def _part(value: Value, path: str) -> Value:
    """What a dotted path leads to in maps; null where it leads nowhere."""
    for key in path.split(".") if path else ():
        value = value.get(key) if isinstance(value, dict) else None
    return value
