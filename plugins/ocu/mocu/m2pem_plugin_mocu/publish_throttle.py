"""Publishing of the latest state: after changes, at a bounded rate, and repeatedly without one."""

import asyncio
import logging
from collections.abc import Awaitable, Callable

MIN_PERIOD_S = 0.1
"""Between two messages of a topic: at most ten in a second."""

MAX_PERIOD_S = 1.0
"""Without a change: clients see that the state is still true, and how far mission time is."""

log = logging.getLogger("m2pem.ocu.mocu")


class PublishThrottle:
    """Calls `publish` after changes. A change during the call leads to another call."""

    def __init__(self, publish: Callable[[], Awaitable[None]]) -> None:
        self._publish = publish
        self._changed = asyncio.Event()

    def mark_changed(self) -> None:
        """Have the state published soon."""
        self._changed.set()

    async def run(self) -> None:
        """Publish until cancelled."""
        while True:
            self._changed.clear()
            try:
                await self._publish()
            except Exception:  # a state that cannot be published may be followed by one that can
                log.exception("the state cannot be published to operators")
            await asyncio.sleep(MIN_PERIOD_S)
            try:
                async with asyncio.timeout(MAX_PERIOD_S - MIN_PERIOD_S):
                    await self._changed.wait()
            except TimeoutError:
                continue
