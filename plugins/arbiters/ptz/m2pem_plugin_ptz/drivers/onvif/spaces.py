"""How a camera counts: its numbers for angles, angular speeds and zoom factors, and back."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from m2pem_plugin_ptz.head import Reach

EDGE_RAD = 1e-6
"""So far outside a range is still its edge."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Scale:
    """`units = offset + gain * value`, within `units`."""

    gain: float
    offset: float
    units: Interval

    def to_units(self, value: float) -> float:
        """What the camera is told."""
        return min(max(self.offset + self.gain * value, self.units[0]), self.units[1])

    def to_value(self, units: float) -> float:
        """What it means."""
        return (units - self.offset) / self.gain

    @property
    def values(self) -> Interval:
        """All that it can say."""
        ends = sorted(map(self.to_value, self.units))
        return ends[0], ends[1]


@dataclass(frozen=True, slots=True)
class PanTiltSpace:
    """Positions in rad, or velocities in rad/s."""

    uri: str
    pan: Scale
    tilt: Scale


@dataclass(frozen=True, slots=True)
class OneSpace:
    """Zoom factors, or a speed of both axes in rad/s."""

    uri: str
    scale: Scale


@dataclass(frozen=True, slots=True)
class Spaces:
    """How to speak with a camera. `positions` and `zooms`: all in which it may answer, the first is
    the one to be used; `velocity`, `speed` None: it takes none. `default_position`: the URI of the
    space in which it answers without naming one."""

    reach: Reach
    positions: tuple[PanTiltSpace, ...] = ()
    velocity: PanTiltSpace | None = None
    speed: OneSpace | None = None
    zooms: tuple[OneSpace, ...] = ()
    default_position: str = ""

    def look(self, x: float, y: float, uri: str) -> tuple[float, float] | None:
        """Where it looks, in rad, within `reach`; None: the space is not known."""
        space = _named(self.positions, uri or self.default_position)
        if space is None:
            return None
        return into(space.pan.to_value(x), self.reach.pan_rad), space.tilt.to_value(y)

    def zoom(self, x: float, uri: str) -> float | None:
        """The zoom factor; None: the space is not known."""
        space = _named(self.zooms, uri)
        return None if space is None else max(1.0, space.scale.to_value(x))

    def position(self, pan_rad: float, tilt_rad: float) -> dict[str, object]:
        """A position as the camera is told it; there must be `positions`."""
        space = self.positions[0]
        pan = into(pan_rad, space.pan.values)
        return {
            "x": space.pan.to_units(pan),
            "y": space.tilt.to_units(tilt_rad),
            "space": space.uri,
        }


def last_part(uri: str) -> str:
    """Of a space's URI, in small letters: not all cameras write the others alike."""
    return uri.strip().rsplit("/", 1)[-1].lower()


def into(angle_rad: float, interval: Interval) -> float:
    """The same direction, a whole number of turns away, as near to the interval as can be."""
    low, high = interval
    if low - EDGE_RAD <= angle_rad <= high + EDGE_RAD:
        return angle_rad
    return angle_rad + math.tau * round(((low + high) / 2 - angle_rad) / math.tau)


Space = TypeVar("Space", PanTiltSpace, OneSpace)


def _named(spaces: Sequence[Space], uri: str) -> Space | None:
    if not spaces:
        return None
    if not uri:
        # The generic space is the one that every camera has.
        return next((each for each in spaces if "generic" in each.uri.lower()), spaces[0])
    return next((each for each in spaces if last_part(each.uri) == last_part(uri)), None)
