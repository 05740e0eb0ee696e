"""Simulated time, which the software on board of simulated vehicles uses, too."""

import asyncio
import math
import time

US_PER_S = 1_000_000


class SimulatedClock:
    """A clock of `m2pem.api` that runs `speed` times as fast as real time.

    It starts at the time of day, so that stamps of several programs are comparable.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._started_us = time.time_ns() // 1000
        self._started_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Simulated seconds since the clock was made."""
        return (time.monotonic() - self._started_s) * self.speed

    def now_us(self) -> int:
        """Microseconds since the Unix epoch; never goes back."""
        return self._started_us + round(self.elapsed_s * US_PER_S)

    async def sleep(self, seconds: float) -> None:
        """Wait for so many simulated seconds."""
        await self.sleep_until(self.now_us() + math.ceil(seconds * US_PER_S))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        await asyncio.sleep(0)
        while (remaining_us := time_us - self.now_us()) > 0:  # noqa: ASYNC110  # loops wake early
            await asyncio.sleep(remaining_us / US_PER_S / self.speed)


class RateTimer:
    """Tells when periodic work is due, in simulated time."""

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._next_s = 0.0

    def is_due(self, now_s: float) -> bool:
        """Return whether the work is due. Missed periods are skipped."""
        if now_s < self._next_s - 1e-9:
            return False
        self._next_s = max(self._next_s + self._period_s, now_s)
        return True
