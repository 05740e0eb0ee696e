"""A pan-tilt head without I/O: how it moves. Pure."""

import math
from dataclasses import dataclass, replace

from m2pem_plugin_ptz.gimbal import Look, Reach

ZOOM_PER_S = 5.0
STEEPEST = 1e9


@dataclass(slots=True)
class Head:
    """`look`: where it looks, within `reach`. `stuck`: its motors do not turn."""

    reach: Reach
    look: Look = Look(0.0, 0.0)  # noqa: RUF009  # frozen
    stuck: bool = False
    _to: Look = Look(0.0, 0.0)  # noqa: RUF009  # frozen
    _rates: tuple[float, float] = (STEEPEST, STEEPEST)

    def move(self, to: Look, seconds: float = 0.0) -> None:
        """Go there, and arrive after so long, or as soon as it can."""
        low, high = self.reach.pan_rad
        pan = to.pan_rad if self.reach.endless else min(max(to.pan_rad, low), high)
        low, high = self.reach.tilt_rad
        tilt = min(max(to.tilt_rad, low), high)
        self._to = Look(pan, tilt, min(max(to.zoom, 1.0), self.reach.zoom_max))
        if seconds > 0:
            ways = abs(pan - self.look.pan_rad), abs(tilt - self.look.tilt_rad)
            self._rates = ways[0] / seconds, ways[1] / seconds
        else:
            self._rates = STEEPEST, STEEPEST

    def step(self, dt_s: float) -> None:
        """Let time pass."""
        if self.stuck:
            return
        look, to, fastest = self.look, self._to, self.reach.rate_rad_s
        pan_rate, tilt_rate = (min(rate, fastest) for rate in self._rates)
        self.look = replace(
            look,
            pan_rad=_towards(look.pan_rad, to.pan_rad, pan_rate * dt_s),
            tilt_rad=_towards(look.tilt_rad, to.tilt_rad, tilt_rate * dt_s),
            zoom=_towards(look.zoom, to.zoom, ZOOM_PER_S * dt_s),
        )


def _towards(value: float, to: float, most: float) -> float:
    return to if abs(to - value) <= most else value + math.copysign(most, to - value)
