"""Messages over the WebSocket: one function for each, without its number."""

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, TypeVar

import msgspec

from m2pem.api import OpenPrompt, PromptClosed, RunId, RunSummary, RunView, StampedRecord, describe
from m2pem.api.records import PromptOpened
from m2pem.api.run_view import ElementState, Place

_encode = msgspec.json.Encoder().encode

State = TypeVar("State", msgspec.Raw, ElementState)


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


def prompt_opened(prompt: OpenPrompt, place: Place | None) -> dict[str, Any]:
    """Return the message that a prompt has opened."""
    return {"type": "prompt", "prompt": prompt_of(prompt, place)}


def prompt_closed(closed: PromptClosed) -> dict[str, Any]:
    """Return the message that a prompt was answered or withdrawn."""
    return {"type": "prompt_closed", **asdict(closed)}


def run(summary: RunSummary) -> dict[str, Any]:
    """Return the message of a run's new status."""
    return {"type": "run", "run": asdict(summary)}


def fault(text: str) -> dict[str, Any]:
    """Return the message of a fault."""
    return {"type": "fault", "text": text}


def notice(text: str) -> dict[str, Any]:
    """Return the message of something that is no fault."""
    return {"type": "notice", "text": text}


def schedule_changed() -> dict[str, Any]:
    """Return the message that the schedule is to be read again: `GET /api/schedule`."""
    return {"type": "schedule"}


def alerts_changed() -> dict[str, Any]:
    """Return the message that the alerts are to be read again: `GET /api/alerts`."""
    return {"type": "alerts"}


def shared_space_changed() -> dict[str, Any]:
    """Return the message that shared space is to be read again: `GET /api/resources`."""
    return {"type": "shared_space"}


def operators_changed() -> dict[str, Any]:
    """Return the message that operators are to be read again: `GET /api/operators`."""
    return {"type": "operators"}


def alive() -> dict[str, Any]:
    """Return the message that an answer takes longer."""
    return {"type": "alive"}


def log(records: Iterable[StampedRecord], view: RunView) -> dict[str, Any]:
    """Return the message with the newest records of the watched run."""
    return {"type": "log", "records": [msgspec.Raw(record_of(each, view)) for each in records]}


def nested(states: Iterable[tuple[Place, State]]) -> dict[str, dict[str, State]]:
    """Return states of elements, nested by process and element."""
    found: dict[str, dict[str, State]] = {}
    for (process, element), state in states:
        found.setdefault(process, {})[element] = state
    return found
