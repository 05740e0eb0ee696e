"""How often a base is told something, on a clock that may be faster than the world."""

import asyncio

from m2pem.api import Clock

LEAST_S = 0.02
"""Real seconds between two commands, however fast the clock is."""

PATIENCE_S = 0.5
"""Real seconds in which a message may be late, for no other reason than that computers are slow."""


class Pace:
    """Belongs to the running event loop."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._began_s = self.now_s
        self._real_began_s = self._loop.time()

    @property
    def now_s(self) -> float:
        """Seconds of the clock."""
        return self._clock.now_us() / 1e6

    async def wait(self, seconds: float) -> None:
        """For so many seconds of the clock, and LEAST_S real ones at least."""
        since = self._loop.time()
        await self._clock.sleep(seconds)
        rest = LEAST_S - (self._loop.time() - since)
        if rest > 0:
            await asyncio.sleep(rest)

    def forgive(self, age_s: float, stale_s: float) -> float:
        """An age of the clock, but no more than `stale_s` of what has just come in real time."""
        real_s = self._loop.time() - self._real_began_s
        speed = (self.now_s - self._began_s) / real_s if real_s > LEAST_S else 1.0
        return min(age_s, stale_s) if age_s <= PATIENCE_S * speed else age_s
