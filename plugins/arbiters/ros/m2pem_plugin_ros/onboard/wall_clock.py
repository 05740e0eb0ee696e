"""The clock of a real vehicle."""

import asyncio
import time


class WallClock:
    """Implements `m2pem.api.Clock`: the time of day at its start, and steady time from there."""

    def __init__(self) -> None:
        self._start_us = time.time_ns() // 1000 - time.monotonic_ns() // 1000

    def now_us(self) -> int:
        """Microseconds since the Unix epoch; never goes back."""
        return self._start_us + time.monotonic_ns() // 1000

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds`."""
        await asyncio.sleep(max(seconds, 0.0))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        while (left_us := time_us - self.now_us()) > 0:  # noqa: ASYNC110  # it may wake early
            await asyncio.sleep(left_us / 1e6)
