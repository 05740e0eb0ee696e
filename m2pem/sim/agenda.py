"""What will happen when: timed calls in a fixed order, with no task while nothing is due."""

import asyncio
import heapq
import itertools
import logging
from collections.abc import Callable

from m2pem.api.clock import Clock


class Entry:
    """One call to come; `cancel` makes it not come."""

    __slots__ = ("at_us", "call", "number")

    def __init__(self, at_us: int, number: int, call: Callable[[int], None]) -> None:
        self.at_us = at_us
        self.number = number
        self.call: Callable[[int], None] | None = call

    def cancel(self) -> None:
        """Forget it; harmless when it is over."""
        self.call = None

    def __lt__(self, other: "Entry") -> bool:
        return (self.at_us, self.number) < (other.at_us, other.number)


class Agenda:
    """Calls get the time that they were scheduled for, however late they come. So what happened
    while nobody looked can be caught up with, and nothing drifts."""

    def __init__(self, clock: Clock, logger: logging.Logger) -> None:
        self._clock = clock
        self._logger = logger
        self._entries: list[Entry] = []
        self._numbers = itertools.count()
        self._sleeper: asyncio.Task[None] | None = None
        self._sleeping_until = 0
        self._awake = False

    def at(self, time_us: int, call: Callable[[int], None]) -> Entry:
        """Schedule `call(time_us)`. Calls for the same time come in the order of scheduling."""
        entry = Entry(time_us, next(self._numbers), call)
        heapq.heappush(self._entries, entry)
        self._arm()
        return entry

    def run_due(self, now_us: int) -> None:
        """Make every call that is due, in order, also those that these schedule."""
        while self._entries and self._entries[0].at_us <= now_us:
            entry = heapq.heappop(self._entries)
            call, entry.call = entry.call, None
            if call is None:
                continue
            try:
                call(entry.at_us)
            except Exception:
                self._logger.exception("an event of the simulation failed")

    def wake(self) -> None:
        """Begin to make calls by itself; before that only `run_due` makes them."""
        self._awake = True
        self._arm()

    async def close(self) -> None:
        """Make no more calls."""
        self._awake = False
        self._entries.clear()
        sleeper, self._sleeper = self._sleeper, None
        if sleeper is not None:
            sleeper.cancel()
            await asyncio.gather(sleeper, return_exceptions=True)

    def _arm(self) -> None:
        while self._entries and self._entries[0].call is None:
            heapq.heappop(self._entries)
        if not self._awake:
            return
        if not self._entries:
            if self._sleeper is not None:
                self._sleeper.cancel()
                self._sleeper = None
            return
        due = self._entries[0].at_us
        if self._sleeper is not None:
            if self._sleeping_until == due:
                return
            self._sleeper.cancel()
        self._sleeping_until = due
        self._sleeper = asyncio.get_running_loop().create_task(self._sleep(due))

    async def _sleep(self, until_us: int) -> None:
        await self._clock.sleep_until(until_us)
        self._sleeper = None
        self.run_due(self._clock.now_us())
        self._arm()
