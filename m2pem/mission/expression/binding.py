"""Conditions on the items of a list, under a name of their own."""

from m2pem.mission.expression.tree import binds
from m2pem.mission.values import ReadValue, Value


def bind(variable: str, item: Value, read: ReadValue) -> ReadValue:
    """What reads `variable`, and what is below it, from the item, and all else as before."""

    def bound(name: str) -> Value:
        return _part(item, name[len(variable) + 1 :]) if binds(variable, name) else read(name)

    return bound


def _part(value: Value, path: str) -> Value:
    """What a dotted path leads to in maps; null where it leads nowhere."""
    for key in path.split(".") if path else ():
        value = value.get(key) if isinstance(value, dict) else None
    return value
