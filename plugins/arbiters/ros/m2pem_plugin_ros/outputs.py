"""What a behavior gives to the mission's data store, as m2pem_interfaces/msg/KeyValue carries it.

What is read came over a network: what is wrong of it is left out, and told. Needs no ROS.
"""

import json
import math
from collections.abc import Iterable, Mapping

from m2pem.api import Value
from m2pem_plugin_ros.wire import WireError

MOST = 100
LONGEST = 100_000
"""Characters of one value: it goes into the journal."""

DEEPEST = 20
LEAST_WHOLE, MOST_WHOLE = -(2**63), 2**63 - 1
"""The data store has whole numbers of 64 bits."""


def encode_outputs(outputs: Mapping[str, Value]) -> list[tuple[str, str]]:
    """Names, and their values as JSON.

    Raises:
        WireError: a value is none that JSON can carry, such as NaN.
    """
    pairs = []
    for name, value in outputs.items():
        try:
            pairs.append((name, json.dumps(value, allow_nan=False, separators=(",", ":"))))
        except (ValueError, TypeError, RecursionError) as error:
            raise WireError(f"output '{name}' cannot be sent: {error}") from None
    return pairs


def decode_outputs(pairs: Iterable[tuple[str, str]]) -> tuple[dict[str, Value], list[str]]:
    """The values by name, and what is wrong with those that were left out."""
    values: dict[str, Value] = {}
    wrong: list[str] = []
    for name, text in pairs:
        if len(values) + len(wrong) >= MOST:
            wrong.append(f"there are more than {MOST} outputs")
            break
        try:
            if not name or name in values:
                raise WireError("it is there twice" if name else "it has no name")
            values[name] = _decoded(text)
        except WireError as error:
            wrong.append(f"output '{name[:100]}' was left out: {error}")
    return values, wrong


def _decoded(text: str) -> Value:
    if len(text) > LONGEST:
        raise WireError(f"it has {len(text)} characters, and {LONGEST} are the most")
    try:
        value: Value = json.loads(text)
    except (ValueError, RecursionError):
        raise WireError(f"{text[:60]} is not JSON") from None
    _check(value, DEEPEST)
    return value


def _check(value: Value, deep: int) -> None:
    """Raise WireError for what no data store holds; JSON of Python may be NaN, or without end."""
    if isinstance(value, float) and not math.isfinite(value):
        raise WireError("a number in it is not finite")
    if isinstance(value, int) and not LEAST_WHOLE <= value <= MOST_WHOLE:
        raise WireError("a whole number in it needs more than 64 bits")
    if isinstance(value, list | dict):
        if not deep:
            raise WireError(f"it is more than {DEEPEST} levels deep")
        for each in value.values() if isinstance(value, dict) else value:
            _check(each, deep - 1)
