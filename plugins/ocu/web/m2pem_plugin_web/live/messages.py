"""Messages over the WebSocket. They are encoded once for all browsers."""

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeVar

import msgspec

from m2pem.api import OpenPrompt, RunId, RunView, StampedRecord, describe
from m2pem.api.records import PromptOpened
from m2pem.api.run_view import ElementState, Place

_encode = msgspec.json.Encoder().encode

State = TypeVar("State", msgspec.Raw, ElementState)


class Message(NamedTuple):
    """The JSON of a message, but for its number on a connection, which comes between the two."""

    head: bytes
    rest: bytes


def message(kind: str, **fields: Any) -> Message:
    """Return a message of a type with its fields."""
    rest = b"," + _encode(fields)[1:] if fields else b"}"
    return Message(b'{"type":"' + kind.encode() + b'","seq":', rest)


def record_of(stamped: StampedRecord, view: RunView, **more: Any) -> bytes:
    """Return a record as JSON, in the form of docs/records.md, with what the page shows of it.

    `sentence`, `kind` and `urgent`: see `m2pem.api.describe`. `more`: further fields.
    """
    description = describe(stamped, view)
    head = _encode({"run": stamped.run, "seq": stamped.seq, "t": stamped.t_s})
    shown = {
        "sentence": description.text,
        "kind": description.kind,
        "urgent": description.importance.is_urgent,
        **more,
    }
    return b",".join((head[:-1], _encode(stamped.record)[1:-1], _encode(shown)[1:]))


def prompt_of(prompt: OpenPrompt, place: Place | None) -> dict[str, Any]:
    """Return a prompt as JSON. `place`: its element, if known."""
    return {
        "run": prompt.run,
        "prompt": prompt.prompt,
        "process": place[0] if place else "",
        "element": prompt.element,
        "text": prompt.text,
        "decisions": [
            {"value": each.value, "label": each.label or each.value} for each in prompt.decisions
        ],
        "role": prompt.role,
    }


def prompt_record_of(run: RunId, record: PromptOpened) -> dict[str, Any]:
    """Return the prompt of a record as JSON."""
    return {
        "run": run,
        "prompt": record.prompt,
        "process": record.process,
        "element": record.element,
        "text": record.text,
        "decisions": record.decisions,
        "role": record.role,
    }


def nested(states: Iterable[tuple[Place, State]]) -> dict[str, dict[str, State]]:
    """Return states of elements, nested by process and element."""
    found: dict[str, dict[str, State]] = {}
    for (process, element), state in states:
        found.setdefault(process, {})[element] = state
    return found
