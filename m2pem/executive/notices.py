"""Tells subscribers what was committed, in order; nobody ever waits for a subscriber."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable

from m2pem.api.control import Notice, RunId
from m2pem.errors import OperatorError


class Subscription:
    """Notices for one reader. A reader that falls `size` behind is cut off with an error."""

    def __init__(self, run: RunId | None, size: int, forget: Callable[["Subscription"], None]):
        self.run = run
        self._size = size
        self._forget = forget
        self._waiting: deque[Notice] = deque()
        self._wake = asyncio.Event()
        self._overrun = False
        self._ended = False

    def put(self, notice: Notice) -> None:
        """Hand a notice over, unless it is of another run."""
        if self._overrun or (self.run is not None and notice.run != self.run):
            return
        if len(self._waiting) >= self._size:
            self._overrun = True
        else:
            self._waiting.append(notice)
        self._wake.set()

    def end(self) -> None:
        """No more will come."""
        self._ended = True
        self._wake.set()

    def close(self) -> None:
        """The reader wants no more."""
        self._forget(self)

    def __aiter__(self) -> AsyncIterator[Notice]:
        return self

    async def __anext__(self) -> Notice:
        while not self._waiting:
            if self._overrun:
                raise OperatorError(
                    f"the subscriber fell {self._size} notices behind; subscribe again and read"
                    " what was missed with records()"
                )
            if self._ended:
                raise StopAsyncIteration
            self._wake.clear()
            await self._wake.wait()
        return self._waiting.popleft()


class Notices:
    """All subscriptions of an executive."""

    def __init__(self) -> None:
        self._subscriptions: dict[Subscription, None] = {}

    @property
    def anybody(self) -> bool:
        """Whether there is anyone to tell."""
        return bool(self._subscriptions)

    def subscribe(self, run: RunId | None, size: int) -> Subscription:
        """Everything from now on."""
        subscription = Subscription(run, size, self._drop)
        self._subscriptions[subscription] = None
        return subscription

    def publish(self, notice: Notice) -> None:
        """Tell all."""
        for subscription in list(self._subscriptions):
            subscription.put(notice)

    def end(self) -> None:
        """Let every reader come to its end."""
        for subscription in list(self._subscriptions):
            subscription.end()
        self._subscriptions.clear()

    def _drop(self, subscription: Subscription) -> None:
        self._subscriptions.pop(subscription, None)
