"""The values a mission's data store holds: what JSON can say, with exact 64-bit integers."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias, Union

if TYPE_CHECKING:
    Value: TypeAlias = Union[bool, int, float, str, list["Value"], dict[str, "Value"], None]
else:
    # msgspec, which reads inputs and records back, cannot follow an alias that names itself.
    Value = Any
"""A value of the data store. Lists and maps are never changed in place once written."""

ReadValue: TypeAlias = Callable[[str], Value]
"""Reads the value under a dotted name; a name that is not in the store is None (null)."""

MAX_DEPTH = 50
"""Levels of lists and maps in each other. Deeper values could not be written to a journal."""


def value_within(value: Value, path: str) -> Value:
    """Return what maps in each other have under a dotted name; None: nothing."""
    for key in path.split("."):
        if not isinstance(value, dict):
            return None
        value = value.get(key)
    return value


def is_too_deep(value: Value, levels: int = MAX_DEPTH) -> bool:
    """Whether lists and maps are nested deeper than `levels`."""
    layer = [value]
    for _ in range(levels + 1):
        containers = [each for each in layer if isinstance(each, list | dict)]
        if not containers:
            return False
        layer = [
            inner
            for each in containers
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
    return True
