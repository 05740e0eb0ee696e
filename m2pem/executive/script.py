"""A scripted context world, as an answers file tells it (docs/rehearsal.md).

The executive asks it before it runs a service or starts a behavior; `m2pem.rehearsal.answers`
reads one from a file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from m2pem.engine.records import Record
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class ScriptedService:
    """Instead of running the service: wait, then write, or fail with an error code."""

    after_s: float = 0.0
    write: Mapping[str, Value] | None = None
    error: str = ""


@dataclass(frozen=True, slots=True)
class ScriptedBehavior:
    """How the simulated arbiter ends a behavior: succeeded, failed, stalled or lost."""

    after_s: float
    end: str
    error: str = ""


class Script(Protocol):
    """What is scripted for each visit to an element; None: nothing (any more).

    Each run counts its own. A visit is known by the id of the service or behavior: asked again for
    the same one (after a restart), the script says the same again.
    """

    def seen(self, run: str, records: Sequence[Record]) -> None:
        """These were committed: visits count in their order, also those of before a restart."""
        ...

    def service(self, run: str, element: str, name: str, service: str) -> ScriptedService | None:
        """What a service task does on this visit."""
        ...

    def behavior(self, run: str, element: str, behavior: str) -> ScriptedBehavior | None:
        """How the behavior of an element ends on this visit."""
        ...
