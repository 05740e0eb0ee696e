"""Fields of MAVLink messages of any type: as values of missions, and from what fleet files say."""

import math
import struct
from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import UNKNOWN, Value, did_you_mean
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.protocol.messages import Address, Message, MessageType, message_type

MAX_INTEGER = 2**63 - 1

_SIZES = {"char": 8, "int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}
_FLOATS = ("float", "double")


class FieldError(M2pemError):
    """A field that a message does not have, or a value that it cannot have."""

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"{field}: {problem}")
        self.field = field
        self.problem = problem


def find_message(name: str) -> MessageType:
    """Return a message type of the dialect by its name.

    Raises:
        FieldError: there is none; `field` is "type".
    """
    try:
        return message_type(name)
    except KeyError:
        names = [str(each.msgname) for each in dialect.mavlink_map.values()]
        hint = did_you_mean(name, names) or "write its name as in mavlink.io, such as STATUSTEXT"
        problem = f"the dialect ardupilotmega has no message {name!r}; {hint}"
        raise FieldError("type", problem) from None


def values_of(message: Message, sender: Address) -> dict[str, Value]:
    """Return the fields of a message by their MAVLink names, and `sender` with `system` and
    `component`. Texts are printable; what is not a finite number is null."""
    fields = message.TYPE.make._fields
    values: dict[str, Value] = {
        name: _plain(value) for name, value in zip(fields, message, strict=True)
    }
    values["sender"] = {"system": sender.system, "component": sender.component}
    return values


def _plain(value: Any) -> Value:
    if isinstance(value, bytes):
        text = value.decode("utf-8", "replace")
        return "".join(each if each.isprintable() else " " for each in text)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, int):
        return value if value <= MAX_INTEGER else float(value)
    return [_plain(each) for each in value]


def made(type_: MessageType, fields: Mapping[str, Any]) -> Message:
    """Return a message with these fields; others are 0. A field that is `UNKNOWN` stays 0, but the
    message must have it. Numbers of an enumeration may be given by their names.

    Raises:
        FieldError: it has no such field, or the field cannot have that value.
    """
    source: Any = dialect.mavlink_map[type_.id]
    types = dict(zip(source.fieldnames, source.fieldtypes, strict=True))
    lengths = dict(zip(source.ordered_fieldnames, source.array_lengths, strict=True))
    values = {}
    for name, value in fields.items():
        if name not in types:
            hint = did_you_mean(name, types) or f"it has {', '.join(types)}"
            raise FieldError(name, f"{type_.name} has no such field; {hint}")
        enum = source.fieldenums_by_name.get(name, "")
        read = _value(name, value, types[name], lengths[name], enum)
        if read is not UNKNOWN:
            values[name] = read
    message = type_.make(**values)
    try:
        type_.pack(message)
    except struct.error as error:
        raise FieldError(type_.name, str(error)) from error
    return message


def _value(name: str, value: Any, type_: str, length: int, enum: str) -> Any:
    if value is UNKNOWN:
        return value
    if type_ == "char":
        if not isinstance(value, str):
            raise FieldError(name, f'{value!r} is not a text, such as "level ${{level}}"')
        data = value.encode("utf-8", "replace")
        if len(data) > max(1, length):
            raise FieldError(name, f"it has {len(data)} bytes; {max(1, length)} are the most")
        return data
    if not length:
        return _number(name, value, type_, enum)
    if not isinstance(value, list) or len(value) > length:
        raise FieldError(name, f"it is not a list of {length} numbers, or fewer")
    items = [_number(name, each, type_, enum) for each in value]
    if any(each is UNKNOWN for each in items):
        return UNKNOWN
    return tuple(items) + (0,) * (length - len(items))


def _number(name: str, value: Any, type_: str, enum: str) -> Any:
    if value is UNKNOWN:
        return value
    if isinstance(value, str) and enum:
        value = _enumerated(name, value, enum)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FieldError(name, f"{value!r} is not a number")
    if type_ in _FLOATS:
        return float(value)
    bits = _SIZES[type_.removeprefix("u")]
    lowest, highest = (
        (0, 2**bits - 1) if type_[0] == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )
    if not float(value).is_integer() or not lowest <= value <= highest:
        raise FieldError(name, f"{value!r} is not a whole number from {lowest} to {highest}")
    return int(value)


def _enumerated(name: str, value: str, enum: str) -> int:
    numbers = {
        key: number
        for number, entry in dialect.enums[enum].items()
        for key in (entry.name, entry.name.removeprefix(f"{enum}_"))
    }
    if value not in numbers:
        hint = did_you_mean(value, numbers) or f"{enum} has no such name"
        raise FieldError(name, f"{value!r} is not one of {enum}; {hint}")
    return int(numbers[value])
