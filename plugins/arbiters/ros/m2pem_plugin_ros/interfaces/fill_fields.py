"""Messages of any type from maps of fields, as fleet files have them."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from m2pem.api import UNKNOWN, did_you_mean
from m2pem.errors import M2pemError
from m2pem_plugin_ros.interfaces.texts import sendable
from m2pem_plugin_ros.interfaces.types import MESSAGE, find_type

LONGEST = 10_000
"""Characters of a text, and items of a list."""

HIGHEST_FLOAT32 = 3.4028234663852886e38

_INTEGERS = {
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
    "octet": (0, 255),
    "char": (0, 255),
}
_FLOATS = ("float", "double", "long double")
_TEXT = re.compile(r"w?string(?:<(?:=)?(\d+)>?)?")
_SEQUENCE = re.compile(r"sequence<(.+?)(?:, (\d+))?>")
_ARRAY = re.compile(r"(.+)\[(\d+)\]")


class FieldError(M2pemError):
    """A field that a type does not have, or a value that it cannot have. `path` is its name."""

    def __init__(self, path: str, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = path
        self.problem = problem


def fill(kind: Any, fields: Mapping[str, Any], path: str = "") -> Any:
    """Return a message of a class with these fields; others have their defaults. A field that is
    `UNKNOWN` keeps its default, but the type must have it.

    Raises:
        FieldError: the type has no such field, or it cannot have that value.
        RosError: the package of a type within it is not installed.
    """
    message = kind()
    types = kind.get_fields_and_field_types()
    for name, value in fields.items():
        inner = f"{path}.{name}" if path else name
        if name not in types:
            hint = did_you_mean(name, types) or f"it has {', '.join(types) or 'none'}"
            raise FieldError(inner, f"{_name(kind)} has no such field; {hint}")
        made = _value(types[name], value, inner)
        if made is not UNKNOWN:
            setattr(message, name, made)
    return message


def _name(kind: Any) -> str:
    return f"{kind.__module__.partition('.')[0]}/{kind.__name__}"


def _value(type_: str, value: Any, path: str) -> Any:
    if value is UNKNOWN:
        return value
    if type_ == "boolean":
        if isinstance(value, bool):
            return value
    elif type_ in _INTEGERS:
        lowest, highest = _INTEGERS[type_]
        if _is_number(value) and float(value).is_integer():
            if not lowest <= value <= highest:
                raise FieldError(path, f"{value!r} is not from {lowest} to {highest}, as {type_}")
            return bytes([int(value)]) if type_ == "octet" else int(value)
    elif type_ in _FLOATS:
        if _is_number(value):
            if type_ == "float" and abs(value) > HIGHEST_FLOAT32:
                raise FieldError(path, f"{value!r} is too large for float32")
            return float(value)
    elif found := _TEXT.fullmatch(type_):
        if isinstance(value, str):
            longest = min(int(found[1] or LONGEST), LONGEST)
            if len(value) > longest:
                raise FieldError(path, f"it has {len(value)} characters; {longest} are the most")
            return sendable(value)
    elif found := _SEQUENCE.fullmatch(type_):
        return _items(found[1], value, path, 0, int(found[2] or LONGEST))
    elif found := _ARRAY.fullmatch(type_):
        return _items(found[1], value, path, int(found[2]), int(found[2]))
    elif isinstance(value, Mapping):
        return fill(find_type(type_, MESSAGE), value, path)
    raise FieldError(path, f"{_shown(value)} is not of type {type_}{_hint(type_, value)}")


def _items(type_: str, value: Any, path: str, fewest: int, most: int) -> Any:
    if not isinstance(value, Sequence) or isinstance(value, str | bytes):
        raise FieldError(path, f"{_shown(value)} is not a list of {type_}")
    if not fewest <= len(value) <= most:
        wanted = f"{most} are needed" if fewest == most else f"{most} are the most"
        raise FieldError(path, f"it has {len(value)} items; {wanted}")
    items = [_value(type_, each, f"{path}[{number}]") for number, each in enumerate(value)]
    return UNKNOWN if any(each is UNKNOWN for each in items) else items


def _is_number(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value)


def _shown(value: Any) -> str:
    text = repr(value)
    return "null" if value is None else text if len(text) <= 60 else f"{text[:57]}..."


def _hint(type_: str, value: Any) -> str:
    if _TEXT.fullmatch(type_) and _is_number(value):
        return '; write it in a text, such as "level ${level}"'
    return ""
