"""A way to a look that is turned no faster than allowed, for cameras that know no speed."""

import math
from dataclasses import dataclass


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
