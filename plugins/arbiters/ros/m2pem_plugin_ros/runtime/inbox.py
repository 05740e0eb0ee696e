"""Messages on their way from the thread of ROS to the event loop."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

BATCH = 100
"""So many are handled before the loop may do something else."""

logger = logging.getLogger(__name__)


class Inbox(Generic[T]):
    """Hands each item to a callback on the loop; if it cannot keep up, the oldest are dropped.

    The loop is woken once for all that waits, not for each. A callback that raises is logged, and
    gets the next item all the same.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, callback: Callable[[T], None], size: int
    ) -> None:
        self._loop = loop
        self._callback = callback
        self._items: deque[T] = deque(maxlen=size)
        self._drains = False

    def put(self, item: T) -> None:
        """Called in any thread."""
        self._items.append(item)
        if not self._drains:
            self._drains = True
            try:
                self._loop.call_soon_threadsafe(self._drain)
            except RuntimeError:  # the loop is closed, and nobody reads any more
                self._items.clear()

    def _drain(self) -> None:
        # First, so that an item that comes while the last one is handled wakes the loop again.
        self._drains = False
        for _ in range(BATCH):
            try:
                item = self._items.popleft()
            except IndexError:
                return
            try:
                self._callback(item)
            except Exception:
                logger.exception("a message of ROS could not be handled")
        if not self._drains:
            self._drains = True
            self._loop.call_soon(self._drain)
