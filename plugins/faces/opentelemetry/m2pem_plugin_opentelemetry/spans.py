"""Spans: parts of a run with a beginning and an end, whose ids follow from the run's records.

An executive that takes a run up after a crash makes the same ids from the same records, so that
what it exports continues the tree, and what is exported twice is recognized.
"""

from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from typing import TypeAlias

Attribute: TypeAlias = str | int | float | bool | tuple[str, ...]

MAX_EVENTS = 100
"""Events that a span keeps: the first ones, as those say why it began to go wrong."""


def trace_id_of(run: str, process: str, started_us: int) -> int:
    """The id of a run's trace, 128 bits. `started_us`: numbers of runs begin anew in each
    journal."""
    digest = sha256(f"{run}/{process}/{started_us}".encode()).digest()
    return int.from_bytes(digest[:16], "big") or 1


def span_id_of(trace_id: int, seq: int) -> int:
    """The id of the span that the record `seq` begins, 64 bits. A record begins one at most."""
    digest = sha256(f"{trace_id:032x}/{seq}".encode()).digest()
    return int.from_bytes(digest[:8], "big") or 1


MAX_TEXT = 1000
"""Characters of an attribute, at most."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened within a span. Times are microseconds since the Unix epoch."""

    name: str
    at_us: int
    attributes: dict[str, Attribute]


@dataclass(frozen=True, slots=True)
class Link:
    """A span that another one follows from."""

    trace_id: int
    span_id: int
    attributes: dict[str, Attribute]


@dataclass(slots=True)
class Span:
    """A part of a run. `parent_id` None: it is the root. `seq`: the record that began it.

    `error`: what went wrong, "": nothing has. `ended_us` is 0 until it ends.
    """

    name: str
    trace_id: int
    seq: int
    began_us: int
    parent_id: int | None
    attributes: dict[str, Attribute]
    span_id: int = 0
    ended_us: int = 0
    error: str = ""
    events: list[Event] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)
    events_dropped: int = 0

    def __post_init__(self) -> None:
        self.span_id = self.span_id or span_id_of(self.trace_id, self.seq)

    def add(self, name: str, at_us: int, **attributes: Attribute) -> None:
        """Note that something happened; attributes that are "" or () are left out."""
        if len(self.events) >= MAX_EVENTS:
            self.events_dropped += 1
            return
        self.events.append(Event(name, at_us, named(attributes)))

    def end(self, at_us: int, error: str = "", **attributes: Attribute) -> None:
        """It ends; not before it began, as clocks may be set back."""
        self.ended_us = max(at_us, self.began_us)
        self.error = error
        self.attributes.update(named(attributes))


def named(attributes: dict[str, Attribute]) -> dict[str, Attribute]:
    """Attributes as OpenTelemetry names them: `run_id` is "m2pem.run.id". Long texts are cut."""
    return {
        _named(name): value[:MAX_TEXT] if isinstance(value, str) else value
        for name, value in attributes.items()
        if value not in ("", ())
    }


@cache
def _named(name: str) -> str:
    return f"m2pem.{name.replace('_', '.')}"
