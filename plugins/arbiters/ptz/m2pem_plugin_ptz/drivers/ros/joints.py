"""The joints of a pan-tilt head, and what they mean for where its camera looks. Pure.

A joint's position is positive counter-clockwise as it is seen from above, and upwards (REP-103); a
`Look` pans clockwise. That of a zoom joint is the factor.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from m2pem_plugin_ptz.head import Look


class Axis(StrEnum):
    """What a joint moves."""

    PAN = "pan"
    TILT = "tilt"
    ZOOM = "zoom"


@dataclass(frozen=True, slots=True)
class Joints:
    """`names`: of each joint that there is; their order is that of all commands. `backwards`: those
    that are mounted the other way round."""

    names: Mapping[Axis, str]
    backwards: frozenset[Axis] = frozenset()

    @property
    def zooms(self) -> bool:
        """Whether there is a joint for that."""
        return Axis.ZOOM in self.names

    def heard(self, names: Sequence[str], positions: Sequence[float]) -> dict[Axis, float]:
        """The positions of our joints in a message that may have many others."""
        told = dict(zip(names, positions, strict=False))
        return {
            axis: told[name]
            for axis, name in self.names.items()
            if name in told and math.isfinite(told[name])
        }

    def look(self, positions: Mapping[Axis, float], *, endless: bool = False) -> Look | None:
        """Where the camera looks; None: not all is known. `endless`: pan is -pi to pi."""
        if not {Axis.PAN, Axis.TILT} <= positions.keys():
            return None
        pan = -self._signed(Axis.PAN, positions[Axis.PAN])
        tilt = self._signed(Axis.TILT, positions[Axis.TILT])
        zoom = max(1.0, positions.get(Axis.ZOOM, 1.0))
        return Look(math.remainder(pan, math.tau) if endless else pan, tilt, zoom)

    def positions(self, look: Look) -> dict[Axis, float]:
        """Where the joints are to be for that."""
        wanted = {
            Axis.PAN: self._signed(Axis.PAN, -look.pan_rad),
            Axis.TILT: self._signed(Axis.TILT, look.tilt_rad),
            Axis.ZOOM: look.zoom,
        }
        return {axis: wanted[axis] for axis in self.names}

    def _signed(self, axis: Axis, position: float) -> float:
        return -position if axis in self.backwards else position


def nearest_turn(position_rad: float, to_rad: float) -> float:
    """The same direction as `to_rad`, in the turn in which a joint is that turns endlessly."""
    return position_rad + math.remainder(to_rad - position_rad, math.tau)
