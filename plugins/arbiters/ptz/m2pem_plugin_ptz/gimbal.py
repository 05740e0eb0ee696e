"""Where a camera looks, and where it can.

Pan is clockwise from where pan 0 points: the vehicle's bow, unless `Mounting` says otherwise. Tilt
is up from the vehicle's deck, or from the horizon, for a camera that keeps that level. A vehicle
that turns or rolls takes both along. Zoom 1 is the widest view.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Look:
    """In radians; `zoom` is a factor, 1 or more."""

    pan_rad: float
    tilt_rad: float
    zoom: float = 1.0


@dataclass(frozen=True, slots=True)
class Reach:
    """Where a camera can look: (lowest, highest). With `endless` it pans all round, and the ends of
    `pan_rad` are one. `rate_rad_s`: the quickest that it pans and tilts. `view_rad`: the width and
    the height of what it sees at zoom 1."""

    pan_rad: tuple[float, float] = (-math.pi, math.pi)
    tilt_rad: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    zoom_max: float = 1.0
    rate_rad_s: float = 1.0
    view_rad: tuple[float, float] = (math.radians(60.0), math.radians(34.0))
    endless: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as the camera gave it. `content` None: the camera keeps it, under `reference`.

    `taken_us`: microseconds since the Unix epoch. `suffix`: of its file, such as ".jpg".
    """

    taken_us: int
    content: bytes | None = None
    suffix: str = ".jpg"
    reference: str = ""


@dataclass(frozen=True, slots=True)
class Ramp:
    """From one direction to another, both axes at once, so that they arrive together.

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
        """How long it takes."""
        return max(map(abs, self._turn_rad)) / self.rate_rad_s

    def at(self, now_s: float) -> tuple[float, float]:
        """Where it is by now; never beyond the end."""
        if self.is_over(now_s) or not self.seconds:
            return self.end_rad
        share = max(0.0, now_s - self.begun_s) / self.seconds
        pan, tilt = self._turn_rad
        return self.start_rad[0] + share * pan, self.start_rad[1] + share * tilt

    def is_over(self, now_s: float) -> bool:
        """Whether it has arrived."""
        return now_s - self.begun_s >= self.seconds
