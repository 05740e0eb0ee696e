"""Publishes the latest of what comes, at a bounded rate."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


def _drop(_: object) -> None:
    return


class RateLimiter(Generic[T]):
    """Hands each item to `publish` at once, or, if the last one was less than a period ago, the
    latest item when the period is over.

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
        if self._timer is not None:
            self._waiting = item
        elif (now_s := self._loop.time()) >= self._due_s:
            self._send(item, now_s)
        else:
            self._waiting = item
            self._timer = self._loop.call_at(self._due_s, self._send_waiting)

    def close(self) -> None:
        """Publish nothing more."""
        self._publish = _drop
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._waiting = None

    def _send_waiting(self) -> None:
        item, self._waiting, self._timer = self._waiting, None, None
        if item is not None:
            self._send(item, self._loop.time())

    def _send(self, item: T, now_s: float) -> None:
        # From when it was due, so that telemetry of that very rate keeps it.
        self._due_s = max(self._due_s + self._period_s, now_s + self._period_s / 2)
        self._publish(item)
