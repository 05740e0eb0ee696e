"""How simulated vehicles were over mission time, without a timer that would change anything."""

from collections.abc import Callable, Iterable

from m2pem.api.control import TelemetrySample
from m2pem.api.telemetry import PayloadState, VehicleState

US_PER_S = 1_000_000
MOST_SAMPLES = 5_000
"""Kept of a rehearsal; when there are more, every other one goes, and the interval doubles."""


class Sampler:
    """`samples`: one each `every_s` of mission time, later of a multiple of it.

    Motion is known as a function of time until the next event: so it is asked whenever time is
    about to jump, for the times that are jumped over.
    """

    def __init__(
        self,
        every_s: float,
        started_us: int,
        states_at: Callable[[int], Iterable[VehicleState | PayloadState]],
    ) -> None:
        self.samples: list[TelemetrySample] = []
        self._every_us = max(1, round(every_s * US_PER_S))
        self._started_us = started_us
        self._next_us = started_us
        self._states_at = states_at

    def before(self, until_us: int) -> None:
        """Sample up to a time, which is not passed yet."""
        while self._next_us < until_us:
            self.at(self._next_us)
            self._next_us += self._every_us
            if len(self.samples) > MOST_SAMPLES:
                del self.samples[1::2]
                self._every_us *= 2
                last_us = self._started_us + round(self.samples[-1].t_s * US_PER_S)
                self._next_us = last_us + self._every_us

    def at(self, time_us: int) -> None:
        """Sample this moment."""
        states = list(self._states_at(time_us))
        self.samples.append(
            TelemetrySample(
                (time_us - self._started_us) / US_PER_S,
                {each.resource: each for each in states if isinstance(each, VehicleState)},
                {each.resource: each for each in states if isinstance(each, PayloadState)},
            )
        )
