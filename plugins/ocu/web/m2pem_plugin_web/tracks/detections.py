"""Detections of a run: each has a number, and the mission time at which it came.

They are entries of the run's track, and are never thinned. A run has `MOST_DETECTIONS`; more are
counted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import msgspec

from m2pem.api import Detection, GeoPosition
from m2pem_plugin_web.tracks.snapshots import Snapshot

MOST_DETECTIONS = 2000

LONGEST_TEXT = 200
"""Most characters of a type and a source, which devices send."""


class DetectionEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """A detection of a run. `t_s`: mission time; `time_us`: since the Unix epoch, as the device
    says. A later entry of the same number replaces the one before.

    `camera`: the camera that was asked for a picture, "" if there is none. `picture`: the number of
    the detection with which the picture is kept, which may be shared; `picture_after_s`: the
    seconds until it had come. `no_picture`: why there is none. While it is asked for, neither.
    """

    number: int
    t_s: float
    type: str
    source: str
    position: GeoPosition
    time_us: int
    camera: str = ""
    picture: int | None = None
    picture_after_s: float = 0.0
    no_picture: str = ""


@dataclass(slots=True)
class Found:
    """Detections that wait for their numbers, `MOST_DETECTIONS` at most; `more` are counted."""

    detections: list[Detection] = field(default_factory=list)
    snapshots: list[Snapshot | None] = field(default_factory=list)
    """Of each detection, the picture that is asked for."""
    more: int = 0

    def add(self, detection: Detection, snapshot: Snapshot | None = None) -> None:
        """Add a detection, or count it."""
        if len(self.detections) < MOST_DETECTIONS:
            self.detections.append(detection)
            self.snapshots.append(snapshot)
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
        pairs = list(zip(found.detections, found.snapshots, strict=True))
        taken = [
            DetectionEntry(
                self.last + number,
                t_s,
                each.type[:LONGEST_TEXT],
                each.source[:LONGEST_TEXT],
                each.position,
                each.time_us,
                camera=snapshot.camera if snapshot is not None else "",
            )
            for number, (each, snapshot) in enumerate(pairs[:room], 1)
        ]
        more = found.more + len(found.detections) - len(taken)
        self.last += len(taken)
        self.more += more
        return taken, more
