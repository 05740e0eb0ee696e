"""What will happen when: timed calls in a fixed order, with no task while nothing is due."""

import asyncio
import heapq
import itertools
import logging
from collections.abc import Callable

from m2pem.api.clock import Clock


class TimedCall:
    """One call to come; `cancel` makes it not come."""

    __slots__ = ("_over", "at_us", "call", "number")

    def __init__(
        self, at_us: int, number: int, call: Callable[[int], None], over: Callable[[], None]
    ) -> None:
        self.at_us = at_us
        self.number = number
        self.call: Callable[[int], None] | None = call
        self._over = over

    def cancel(self) -> None:
        """Forget it; harmless when it is over."""
        self.take()

    def take(self) -> Callable[[int], None] | None:
        """The call, once."""
        call, self.call = self.call, None
        if call is not None:
            self._over()
        return call

    def __lt__(self, other: "TimedCall") -> bool:
        return (self.at_us, self.number) < (other.at_us, other.number)


class EventQueue:
    """Calls get the time that they were scheduled for, however late they come. So what happened
    while the queue was not read can be caught up with, and nothing drifts.

    `expected` counts the calls to come that may change something by themselves. In the
    background is what goes on for ever: a pursuit, a battery that drains. `due_us`: until when
    calls were due as they were made last.
    """

    def __init__(self, clock: Clock, logger: logging.Logger) -> None:
        self._clock = clock
        self._logger = logger
        self._entries: list[TimedCall] = []
        self._numbers = itertools.count()
        self._sleeper: asyncio.Task[None] | None = None
        self._sleeping_until = 0
        self._awake = False
        self._calling = False
        self.expected = 0
        self.due_us = 0

    def at(
        self, time_us: int, call: Callable[[int], None], *, background: bool = False
    ) -> TimedCall:
        """Schedule `call(time_us)`. Calls for the same time come in the order of scheduling."""
        over = self._background_over if background else self._expected_over
        self.expected += not background
        entry = TimedCall(time_us, next(self._numbers), call, over)
        heapq.heappush(self._entries, entry)
        self._arm()
        return entry

    def run_due(self, now_us: int) -> None:
        """Make every call that is due, in order, also those that these schedule."""
        self.due_us = now_us
        while self._entries and self._entries[0].at_us <= now_us:
            entry = heapq.heappop(self._entries)
            call = entry.take()
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

    def _expected_over(self) -> None:
        self.expected -= 1

    def _background_over(self) -> None:
        pass

    def _forget_cancelled(self) -> None:
        while self._entries and self._entries[0].call is None:
            heapq.heappop(self._entries)

    def _arm(self) -> None:
        """Let the sleeper sleep until the first call that is due. While it makes calls itself, it
        looks again afterwards."""
        self._forget_cancelled()
        if not self._awake or self._calling:
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
        self._sleeper = asyncio.get_running_loop().create_task(self._sleep())

    async def _sleep(self) -> None:
        while self._entries:
            await self._clock.sleep_until(self._sleeping_until)
            self._calling = True
            try:
                self.run_due(self._clock.now_us())
            finally:
                self._calling = False
            self._forget_cancelled()
            if self._entries:
                self._sleeping_until = self._entries[0].at_us
        self._sleeper = None
