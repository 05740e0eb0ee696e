"""Conversion of messages to and from the JSON of MAVSDK.

A field that is no number is null there, whether NaN or infinite.
"""

import json
import math
from typing import Any

from m2pem_plugin_mavlink.protocol.messages import Message, MessageType


def read(type_: MessageType, fields_json: str) -> Message:
    """Return the message with these fields; missing ones are 0.

    Raises:
        ValueError: this is no JSON of a message.
    """
    fields = json.loads(fields_json)
    if not isinstance(fields, dict):
        raise ValueError(f"{type_.name}: no fields")  # noqa: TRY004  # as JSON that is none
    names: tuple[str, ...] = type_.make._fields
    texts = {names[index] for index in type_.texts}
    given = {name: _read(fields[name], name in texts) for name in names if name in fields}
    return type_.make(**given)


def _read(value: Any, is_text: bool) -> Any:
    if is_text:
        return str(value).encode("utf-8", "surrogateescape")
    if isinstance(value, list):
        return tuple(math.nan if item is None else item for item in value)
    return math.nan if value is None else value


def written(message: Message) -> str:
    """Return the fields of a message as JSON."""
    names: tuple[str, ...] = message.TYPE.make._fields
    return json.dumps({name: _written(value) for name, value in zip(names, message, strict=True)})


def _written(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, tuple):
        return [_written(item) for item in value]
    return value if not isinstance(value, float) or math.isfinite(value) else None
