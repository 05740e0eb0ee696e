"""Waits that are woken by messages and by the clock."""

import asyncio
from collections.abc import Callable

from m2pem.api import Clock


class Waiters:
    """Who waits until something is true. `look` is to be called whenever something may be."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiting: dict[asyncio.Future[bool], Callable[[], bool]] = {}

    def look(self) -> None:
        """Wake those whose condition holds, or raises."""
        for future, true in tuple(self._waiting.items()):
            if future.done():
                continue
            try:
                if true():
                    future.set_result(True)
            except Exception as error:
                future.set_exception(error)

    async def wait(self, true: Callable[[], bool], within_s: float | None = None) -> bool:
        """Wait until `true()`, which may raise; False: it was not within so many seconds."""
        if true():
            return True
        loop = asyncio.get_running_loop()
        future: asyncio.Future[bool] = loop.create_future()
        self._waiting[future] = true
        alarm = None if within_s is None else loop.create_task(self._alarm(within_s, future))
        try:
            return await future or true()
        finally:
            del self._waiting[future]
            if alarm is not None:
                alarm.cancel()

    async def _alarm(self, within_s: float, future: "asyncio.Future[bool]") -> None:
        await self._clock.sleep(within_s)
        if not future.done():
            future.set_result(False)
