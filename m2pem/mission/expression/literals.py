"""How numbers and texts are written, in expressions and in messages about them."""

import json
import math
import re

from m2pem.mission.values import Value

MIN_INTEGER = -(2**63)
MAX_INTEGER = 2**63 - 1

NUMBER = re.compile(r"(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_ESCAPES = {"n": "\n", "t": "\t", "\\": "\\", "'": "'", '"': '"'}
_SHOWN_CHARACTERS = 40
_WHOLE_LIMIT = 2.0**53


def read_number(text: str) -> int | float:
    """The number written as `text` (which `NUMBER` matches whole, after at most one sign).

    Raises:
        ValueError: an integer beyond 64 bits, or a number beyond an IEEE double.
    """
    digits = text.lstrip("+-")
    if digits.isdecimal():
        # int() is quadratic and refuses long digit strings with an error of its own.
        significant = digits.lstrip("0") or "0"
        if len(significant) > 19:
            raise ValueError("the integer does not fit into 64 bits")
        integer = -int(significant) if text.startswith("-") else int(significant)
        if not MIN_INTEGER <= integer <= MAX_INTEGER:
            raise ValueError("the integer does not fit into 64 bits")
        return integer
    value = float(text)
    if math.isinf(value):
        raise ValueError("the number is too large for a double")
    return value


def unescape(body: str) -> str:
    """The text between two quotes, escapes resolved.

    Raises:
        ValueError: an escape that does not exist.
    """
    if "\\" not in body:
        return body

    def resolve(match: re.Match[str]) -> str:
        try:
            return _ESCAPES[match[1]]
        except KeyError:
            raise ValueError(f"'\\{match[1]}' is no escape; write '\\\\' for a backslash") from None

    return re.sub(r"\\(.)", resolve, body, flags=re.DOTALL)


def show_scalar(value: bool | int | float | str) -> str:
    """The value as people read it in a text: `true`, `3`, `2.5`; a whole double has no point."""
    if value is True:
        return "true"
    if value is False:
        return "false"
    if isinstance(value, float):
        whole = value.is_integer() and abs(value) < _WHOLE_LIMIT
        return str(int(value)) if whole else repr(value)
    return str(value)


def shown(value: Value) -> str:
    """Return a value as it would be written in an expression, for reasons that people read.

    Doubles have six significant digits.
    """
    return shorten(json.dumps(_rounded(value), ensure_ascii=False))


def _rounded(value: Value) -> Value:
    if isinstance(value, float) and math.isfinite(value):
        return float(f"{value:.6g}")
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    return value


def describe(value: Value) -> str:
    """The value with its type, shortened, for a message."""
    match value:
        case None:
            return "null"
        case bool():
            return show_scalar(value)
        case int() if not MIN_INTEGER <= value <= MAX_INTEGER:
            return "an integer beyond 64 bits"
        case int() | float():
            return f"the number {value!r}"
        case str():
            return f"the text {shorten(value)!r}"
        case list():
            return f"a list of {len(value)}"
        case dict():
            return f"a map of {len(value)}"
    return f"a {type(value).__name__}"


def shorten(text: str) -> str:
    """The beginning of a long text."""
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 3] + "..."
