"""What is said over a WebSocket: one function a message, each without its number."""

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import msgspec

from m2pem.api import OpenPrompt, PromptClosed, RunSummary, StampedRecord
from m2pem_plugin_web.live.picture import Place

_encode = msgspec.json.Encoder().encode


def record_of(stamped: StampedRecord) -> bytes:
    """A record as JSON, in the form of docs/records.md."""
    head = _encode({"run": stamped.run, "seq": stamped.seq, "t": stamped.t_s})
    return head[:-1] + b"," + _encode(stamped.record)[1:]


def prompt_of(prompt: OpenPrompt, place: Place | None) -> dict[str, Any]:
    """A prompt as JSON. `place`: where it was asked, if that is known."""
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


def asked(prompt: OpenPrompt, place: Place | None) -> dict[str, Any]:
    """A prompt opened."""
    return {"type": "prompt", "prompt": prompt_of(prompt, place)}


def closed(closed: PromptClosed) -> dict[str, Any]:
    """A prompt was answered or withdrawn."""
    return {"type": "prompt_closed", **asdict(closed)}


def run(summary: RunSummary) -> dict[str, Any]:
    """A run began, ended, or stands otherwise."""
    return {"type": "run", "run": asdict(summary)}


def fault(text: str) -> dict[str, Any]:
    """Something went wrong."""
    return {"type": "fault", "text": text}


def alive() -> dict[str, Any]:
    """The server goes on; what was asked for takes longer."""
    return {"type": "alive"}


def log(records: Iterable[StampedRecord]) -> dict[str, Any]:
    """The newest records of the watched run."""
    return {"type": "log", "records": [msgspec.Raw(record_of(each)) for each in records]}


def nested(states: Iterable[tuple[Place, msgspec.Raw]]) -> dict[str, dict[str, msgspec.Raw]]:
    """States of elements by process and element."""
    found: dict[str, dict[str, msgspec.Raw]] = {}
    for (process, element), state in states:
        found.setdefault(process, {})[element] = state
    return found
