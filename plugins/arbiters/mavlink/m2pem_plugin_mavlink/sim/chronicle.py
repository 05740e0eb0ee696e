"""What really happened to a vehicle, for tests: what was begun, and how often."""

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import NamedTuple


class Event(NamedTuple):
    """`kind`: armed, disarmed, mode, takeoff, motion, mission, land, payload, reboot ..."""

    at_s: float
    kind: str
    detail: str


@dataclass(slots=True)
class Chronicle:
    """The last 1,000 events, and how many there were of each kind."""

    events: deque[Event] = field(default_factory=lambda: deque(maxlen=1000))
    counts: Counter[str] = field(default_factory=Counter)

    def note(self, at_s: float, kind: str, detail: str = "") -> None:
        """It has happened."""
        self.events.append(Event(at_s, kind, detail))
        self.counts[kind] += 1
