"""Data in requests: named values, each of them JSON."""

from collections.abc import Sequence
from typing import Any

import msgspec

from m2pem.api import MAX_DATA_VALUES, MAX_NAME_CHARACTERS, Value
from m2pem.errors import OperatorError

MOST_CHARACTERS = 1_000_000
"""Of all values of a request together."""

DEEPEST = 32
"""Lists and objects within one another."""

LARGEST_INTEGER = 2**63 - 1


def decode_data(pairs: Sequence[Any]) -> dict[str, Value]:
    """The values of m2pem_interfaces/msg/KeyValue messages, by their keys.

    Raises:
        OperatorError: one is not JSON, or not what a journal could keep; the text names its key.
    """
    if len(pairs) > MAX_DATA_VALUES:
        raise OperatorError(
            f"data has {len(pairs):,} values; {MAX_DATA_VALUES:,} are the most that it may have"
        )
    size = sum(len(pair.value) for pair in pairs)
    if size > MOST_CHARACTERS:
        raise OperatorError(f"data has {size:,} characters; it may have {MOST_CHARACTERS:,}")
    data: dict[str, Value] = {}
    for pair in pairs:
        if not pair.key.strip():
            raise OperatorError("data has a value without a key, such as mission.speed")
        if len(pair.key) > MAX_NAME_CHARACTERS:
            raise OperatorError(f"data has a key of more than {MAX_NAME_CHARACTERS} characters")
        if pair.key in data:
            raise OperatorError(f"data[{pair.key!r}] is there twice: give each key once")
        data[pair.key] = _decode(pair.key, pair.value)
    return data


def _decode(key: str, text: str) -> Value:
    try:
        value: Value = msgspec.json.decode(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise OperatorError(
            f'data[{key!r}] is not JSON ({error}); a text needs its quotes: "red"'
        ) from error
    _check(key, value, 1)
    return value


def _check(key: str, value: Value, depth: int) -> None:
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise OperatorError(f"data[{key!r}] has an integer of more than 64 bits: write {value}.0")
    if isinstance(value, list | dict):
        if depth > DEEPEST:
            raise OperatorError(f"data[{key!r}] is nested more than {DEEPEST} deep")
        for each in value.values() if isinstance(value, dict) else value:
            _check(key, each, depth + 1)
