"""Publishes the latest of what comes, at a bounded rate."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

EARLY = 0.25
"""Part of a period. What comes at most so much before its time is published when it comes: kept
until then, it would be late, as what comes at the rate or faster comes a little before or after."""


class RateLimiter(Generic[T]):
    """Hands items to `publish` when they come, at most one in a period. The last one that came too
    early for that is published a period after its time, if no other has come until then.

    It belongs to the running event loop.
    """

    def __init__(self, rate_hz: float, publish: Callable[[T], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._period_s = 1.0 / rate_hz
        self._publish = publish
        self._due_s = 0.0
        self._waiting: T | None = None
        self._timer: asyncio.TimerHandle | None = None

    def put(self, item: T) -> None:
        """Publish an item now, or later unless a newer one comes."""
        if self._loop.time() >= self._due_s - EARLY * self._period_s:
            self._send(item)
            return
        self._waiting = item
        if self._timer is None:
            self._timer = self._loop.call_at(self._due_s + self._period_s, self._send_waiting)

    def clear(self) -> None:
        """Forget what waits."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._waiting = None

    def _send_waiting(self) -> None:
        if self._waiting is not None:
            self._send(self._waiting)

    def _send(self, item: T) -> None:
        self.clear()
        now_s = self._loop.time()
        # From when it was due, so that telemetry of that very rate keeps it.
        self._due_s = max(self._due_s + self._period_s, now_s + self._period_s / 2)
        self._publish(item)
