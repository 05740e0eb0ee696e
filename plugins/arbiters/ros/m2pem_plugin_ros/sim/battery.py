"""A battery that drains with the way and with time."""

from dataclasses import dataclass

FULL_V, EMPTY_V = 29.4, 21.0
LOW_FRACTION = 0.2


@dataclass(frozen=True, slots=True)
class Capacity:
    """How far a full battery drives, in metres, and how long it lasts for one that stands."""

    range_m: float = 40_000.0
    standing_s: float = 24 * 3600.0


class Battery:
    """`fraction`: what is left, 0 to 1; may be set."""

    def __init__(self, capacity: Capacity, fraction: float = 1.0) -> None:
        self._capacity = capacity
        self.fraction = fraction

    @property
    def voltage_v(self) -> float:
        """Of seven cells in series; linear, which is good enough for a display."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.fraction

    def drain(self, way_m: float, dt_s: float) -> None:
        """Drive `way_m` in `dt_s`."""
        used = way_m / self._capacity.range_m + dt_s / self._capacity.standing_s
        self.fraction = max(0.0, self.fraction - used)
