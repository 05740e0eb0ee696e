"""The direction of a camera, its limits, and slow turns.

Pan is clockwise from pan 0, which is the vehicle's heading unless `Mounting` gives another.
Tilt is up from the vehicle's deck, or from the horizon for a stabilized camera. The camera turns
with its vehicle. Zoom 1 is the widest view.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PanTiltZoom:
    """In radians. `zoom` is a factor, 1 or more. `moving`: it turns or zooms, and what it reports
    may be where it will be."""

    pan_rad: float
    tilt_rad: float
    zoom: float = 1.0
    moving: bool = False


@dataclass(frozen=True, slots=True)
class Reach:
    """The limits of a camera: (lowest, highest). `endless`: it pans all round, and the ends of
    `pan_rad` are one. `rate_rad_s`: highest rate of pan and tilt. `view_rad`: horizontal and
    vertical field of view at zoom 1."""

    pan_rad: tuple[float, float] = (-math.pi, math.pi)
    tilt_rad: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    zoom_max: float = 1.0
    rate_rad_s: float = 1.0
    view_rad: tuple[float, float] = (math.radians(60.0), math.radians(34.0))
    endless: bool = False


@dataclass(frozen=True, slots=True)
class CapturedImage:
    """A picture of the camera. `content` None: the camera keeps it as `reference`.

    `taken_us`: microseconds since the Unix epoch. `suffix`: of its file, such as ".jpg".
    """

    taken_us: int
    content: bytes | None = None
    suffix: str = ".jpg"
    reference: str = ""


@dataclass(frozen=True, slots=True)
class Ramp:
    """A turn at a limited rate, for cameras without one. Both axes arrive together.

    Directions are (pan, tilt) in radians, times in seconds of one clock. `endless`: it pans the
    shorter way round.
    """

    start_rad: tuple[float, float]
    end_rad: tuple[float, float]
    begun_s: float
    rate_rad_s: float
    endless: bool = False

    @property
    def _turn_rad(self) -> tuple[float, float]:
        pan = self.end_rad[0] - self.start_rad[0]
        if self.endless:
            pan = math.remainder(pan, math.tau)
        return pan, self.end_rad[1] - self.start_rad[1]

    @property
    def seconds(self) -> float:
        """The duration of the turn."""
        return max(map(abs, self._turn_rad)) / self.rate_rad_s

    def at(self, now_s: float) -> tuple[float, float]:
        """Return the direction at a time; the end after it."""
        if self.is_over(now_s) or not self.seconds:
            return self.end_rad
        share = max(0.0, now_s - self.begun_s) / self.seconds
        pan, tilt = self._turn_rad
        return self.start_rad[0] + share * pan, self.start_rad[1] + share * tilt

    def is_over(self, now_s: float) -> bool:
        """Whether the turn has ended."""
        return now_s - self.begun_s >= self.seconds
