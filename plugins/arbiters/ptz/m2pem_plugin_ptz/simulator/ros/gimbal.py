"""The motion of a simulated pan-tilt unit, without I/O."""

import math
from dataclasses import dataclass, replace

from m2pem_plugin_ptz.gimbal import PanTiltZoom, Reach

ZOOM_PER_S = 5.0
STEEPEST = 1e9


@dataclass(slots=True)
class Gimbal:
    """`ptz`: the direction, within `reach`."""

    reach: Reach
    ptz: PanTiltZoom = PanTiltZoom(0.0, 0.0)  # noqa: RUF009  # frozen
    _to: PanTiltZoom = PanTiltZoom(0.0, 0.0)  # noqa: RUF009  # frozen
    _rates: tuple[float, float] = (STEEPEST, STEEPEST)

    def move(self, to: PanTiltZoom, seconds: float = 0.0) -> None:
        """Turn to a direction in `seconds`, or as fast as possible."""
        low, high = self.reach.pan_rad
        pan = to.pan_rad if self.reach.endless else min(max(to.pan_rad, low), high)
        low, high = self.reach.tilt_rad
        tilt = min(max(to.tilt_rad, low), high)
        self._to = PanTiltZoom(pan, tilt, min(max(to.zoom, 1.0), self.reach.zoom_max))
        if seconds > 0:
            ways = abs(pan - self.ptz.pan_rad), abs(tilt - self.ptz.tilt_rad)
            self._rates = ways[0] / seconds, ways[1] / seconds
        else:
            self._rates = STEEPEST, STEEPEST

    def step(self, dt_s: float) -> None:
        """Advance by a time."""
        ptz, to, fastest = self.ptz, self._to, self.reach.rate_rad_s
        pan_rate, tilt_rate = (min(rate, fastest) for rate in self._rates)
        self.ptz = replace(
            ptz,
            pan_rad=_towards(ptz.pan_rad, to.pan_rad, pan_rate * dt_s),
            tilt_rad=_towards(ptz.tilt_rad, to.tilt_rad, tilt_rate * dt_s),
            zoom=_towards(ptz.zoom, to.zoom, ZOOM_PER_S * dt_s),
        )


def _towards(value: float, to: float, most: float) -> float:
    return to if abs(to - value) <= most else value + math.copysign(most, to - value)
