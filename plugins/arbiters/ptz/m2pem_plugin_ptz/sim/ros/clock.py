"""Simulated time."""

import asyncio
import math
import time

US_PER_S = 1_000_000


class SimulatedClock:
    """A clock of `m2pem.api` that runs `speed` times as fast as the one on the wall."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed
        self._started_us = time.time_ns() // 1000
        self._started_s = time.monotonic()

    def now_us(self) -> int:
        """Microseconds since the Unix epoch; never goes back."""
        elapsed_s = (time.monotonic() - self._started_s) * self._speed
        return self._started_us + round(elapsed_s * US_PER_S)

    async def sleep(self, seconds: float) -> None:
        """Wait for so many simulated seconds."""
        await self.sleep_until(self.now_us() + math.ceil(seconds * US_PER_S))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        while (remaining_us := time_us - self.now_us()) > 0:  # noqa: ASYNC110  # loops wake early
            await asyncio.sleep(remaining_us / US_PER_S / self._speed)
