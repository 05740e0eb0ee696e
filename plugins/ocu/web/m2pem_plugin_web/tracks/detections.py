"""Detections of a run: each has a number, and the mission time at which it came.

They are entries of the run's track, and are never thinned. A run has `MOST_DETECTIONS`; more are
counted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import msgspec

from m2pem.api import Detection, GeoPosition

MOST_DETECTIONS = 2000

LONGEST_TEXT = 200
"""Most characters of a type and a source, which devices send."""


class DetectionEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """A detection of a run. `t_s`: mission time; `time_us`: since the Unix epoch, as the device
    says. A later entry of the same number replaces the one before."""

    number: int
    t_s: float
    type: str
    source: str
    position: GeoPosition
    time_us: int


@dataclass(slots=True)
class Found:
    """Detections that wait for their numbers, `MOST_DETECTIONS` at most; `more` are counted."""

    detections: list[Detection] = field(default_factory=list)
    more: int = 0

    def add(self, detection: Detection) -> None:
        """Add a detection, or count it."""
        if len(self.detections) < MOST_DETECTIONS:
            self.detections.append(detection)
        else:
            self.more += 1


class Numbering:
    """Numbers the detections of a run from 1 on. `more`: those beyond `MOST_DETECTIONS`."""

    def __init__(self, entries: Iterable[DetectionEntry] = (), more: int = 0) -> None:
        self.last = max((each.number for each in entries), default=0)
        self.more = more

    def enter(self, t_s: float, found: Found) -> tuple[Sequence[DetectionEntry], int]:
        """Return the entries of detections, and of how many there is none."""
        room = MOST_DETECTIONS - self.last
        taken = [
            DetectionEntry(
                self.last + number,
                t_s,
                each.type[:LONGEST_TEXT],
                each.source[:LONGEST_TEXT],
                each.position,
                each.time_us,
            )
            for number, each in enumerate(found.detections[:room], 1)
        ]
        more = found.more + len(found.detections) - len(taken)
        self.last += len(taken)
        self.more += more
        return taken, more
