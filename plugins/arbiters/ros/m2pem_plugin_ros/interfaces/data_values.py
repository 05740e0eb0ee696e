"""Missions in requests, and data: named values, each of them JSON."""

import sys
from collections.abc import Sequence
from typing import Any

import msgspec

from m2pem.api import MAX_DATA_VALUES, MAX_NAME_CHARACTERS, Value
from m2pem.errors import OperatorError
from m2pem_plugin_ros.interfaces.texts import bounded

MOST_CHARACTERS = 1_000_000
"""Of all values of a request together."""

DEEPEST = 32
"""Lists and objects within one another."""

LARGEST_INTEGER = 2**63 - 1

MOST_BYTES = 10_000_000
"""Of a mission that comes in a request; a bigger one comes as a URL."""

URL_CHARACTERS = 2000


def mission_of(request: Any) -> str | bytes:
    """Return the mission of a request, which has a `url` or the file itself as `bpmn`.

    Raises:
        OperatorError: neither or both are given, or it is too large.
    """
    size = len(request.bpmn)
    if bool(size) == bool(request.url.strip()):
        raise OperatorError(
            "give a mission either as url or as bpmn, and not as "
            + ("both" if size else "neither: both are empty")
        )
    if size > MOST_BYTES:
        raise OperatorError(
            f"bpmn has {size:,} bytes; {MOST_BYTES:,} are the most that are taken over ROS: put "
            "the file where the executive can read it, and give its url"
        )
    return bytes(request.bpmn) if size else bounded(request.url.strip(), "url", URL_CHARACTERS)


def decode_data(pairs: Sequence[Any], what: str = "data") -> dict[str, Value]:
    """The values of m2pem_interfaces/msg/KeyValue messages, by their keys. `what`: for errors.

    Raises:
        OperatorError: one is not JSON, or not what a journal could keep; the text names its key.
    """
    if len(pairs) > MAX_DATA_VALUES:
        raise OperatorError(
            f"{what} has {len(pairs):,} values; {MAX_DATA_VALUES:,} are the most that it may have"
        )
    size = sum(len(pair.value) for pair in pairs)
    if size > MOST_CHARACTERS:
        raise OperatorError(f"{what} has {size:,} characters; it may have {MOST_CHARACTERS:,}")
    data: dict[str, Value] = {}
    for pair in pairs:
        if not pair.key.strip():
            raise OperatorError(f"{what} has a value without a key, such as mission.speed")
        if len(pair.key) > MAX_NAME_CHARACTERS:
            raise OperatorError(f"{what} has a key of more than {MAX_NAME_CHARACTERS} characters")
        if pair.key in data:
            raise OperatorError(f"{what}[{pair.key!r}] is there twice: give each key once")
        data[pair.key] = _decode(f"{what}[{pair.key!r}]", pair.value)
    return data


def _decode(place: str, text: str) -> Value:
    try:
        value: Value = msgspec.json.decode(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise OperatorError(
            f'{place} is not JSON ({error}); a text needs its quotes: "red"'
        ) from error
    _check(place, value, 1)
    return value


def is_denormal(number: float) -> bool:
    """Whether a number is what rclpy 7.1 (Jazzy) sends for an int that a client in Python has set
    in a field for a float, whatever the int. rclpy itself refuses that only if
    ROS_PYTHON_CHECK_FIELDS=1 was set before its import."""
    return 0.0 < abs(number) < sys.float_info.min


def check_float(place: str, number: float) -> None:
    """Check a number of a request.

    Raises:
        OperatorError: it is denormal.
    """
    if is_denormal(number):
        raise OperatorError(
            f"{place} is {number:g}, as rclpy sends an int that is set where a float must be: "
            "write 20.0 for 20; ROS_PYTHON_CHECK_FIELDS=1 lets rclpy refuse it at once"
        )


def _check(place: str, value: Value, depth: int) -> None:
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise OperatorError(f"{place} has an integer of more than 64 bits: write {value}.0")
    if isinstance(value, float):
        check_float(place, value)
    if isinstance(value, list | dict):
        if depth > DEEPEST:
            raise OperatorError(f"{place} is nested more than {DEEPEST} deep")
        for each in value.values() if isinstance(value, dict) else value:
            _check(place, each, depth + 1)
