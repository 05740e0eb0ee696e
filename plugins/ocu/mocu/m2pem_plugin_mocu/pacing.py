"""Says the latest state: when it has changed, at a bounded rate, and now and then anyway."""

import asyncio
import logging
from collections.abc import Awaitable, Callable

LEAST_S = 0.1
"""Between two times: ten a second are the most."""

MOST_S = 1.0
"""Without a change: who listens knows that it is still true, and how far mission time is."""

log = logging.getLogger("m2pem.ocu.mocu")


class Paced:
    """Calls `say` after changes. What changes while it speaks is said the next time."""

    def __init__(self, say: Callable[[], Awaitable[None]]) -> None:
        self._say = say
        self._changed = asyncio.Event()

    def change(self) -> None:
        """Something is different."""
        self._changed.set()

    async def run(self) -> None:
        """Go on until cancelled."""
        while True:
            self._changed.clear()
            try:
                await self._say()
            except Exception:  # what cannot be said now may be sayable after the next change
                log.exception("operators cannot be told")
            await asyncio.sleep(LEAST_S)
            try:
                async with asyncio.timeout(MOST_S - LEAST_S):
                    await self._changed.wait()
            except TimeoutError:
                continue
