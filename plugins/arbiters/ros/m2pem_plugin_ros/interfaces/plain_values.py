"""Fields of messages of any type as values of missions, for conditions and templates.

Bytes and characters are whole numbers, times are maps of `sec` and `nanosec`. What is not a finite
number is null. Long texts and lists are cut: a message may come from anybody.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from m2pem.api import Value
from m2pem_plugin_ros.interfaces.texts import sendable

LONGEST_TEXT = 1_000
LONGEST_LIST = 100
MOST_VALUES = 2_000
"""Values of one field, in all its lists and maps."""

MAX_INTEGER = 2**63 - 1


class MessageFields(Mapping[str, Any]):
    """The fields of a message by name. Each is converted when it is read: one condition reads one
    field of an image, for instance."""

    def __init__(self, message: Any) -> None:
        self._message = message
        self._names: Mapping[str, str] = message.get_fields_and_field_types()

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError(name)
        value = getattr(self._message, name)
        return MessageFields(value) if _is_message(value) else _plain(value, [MOST_VALUES])

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _printable(text: str) -> str:
    """The text without what would steer a terminal; lines stay."""
    if text.isprintable():
        return text
    return "".join(each if each.isprintable() or each in "\n\t" else "?" for each in text)


def _is_message(value: Any) -> bool:
    return hasattr(value, "get_fields_and_field_types")


def _plain(value: Any, left: list[int]) -> Value:
    """Convert a value. `left`: how many values may still be converted, a list of one."""
    left[0] -= 1
    if isinstance(value, bool | None):
        return value
    if isinstance(value, int):
        return value if value <= MAX_INTEGER else float(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return _printable(sendable(value[:LONGEST_TEXT]))
    if isinstance(value, bytes) and len(value) == 1:
        return value[0]
    if _is_message(value):
        names = value.get_fields_and_field_types()
        return {name: _plain(getattr(value, name), left) for name in names if left[0] > 0}
    items: list[Value] = []
    for each in value[:LONGEST_LIST]:
        if left[0] <= 0:
            break
        items.append(_plain(each.item() if hasattr(each, "item") else each, left))
    return items
