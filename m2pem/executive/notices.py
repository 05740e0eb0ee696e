"""Tells subscribers what was committed, in order; nobody ever waits for a subscriber."""

import asyncio
import weakref
from collections import deque
from collections.abc import AsyncIterator, Sequence

from m2pem.api.control import Notice, RunId
from m2pem.errors import OperatorError


class Subscription:
    """Notices for one reader. A reader that falls `size` behind is cut off with an error."""

    def __init__(self, run: RunId | None, size: int) -> None:
        self._run = run
        self._size = size
        self._waiting: deque[Notice] = deque()
        self._wake = asyncio.Event()
        self._overrun = False
        self._ended = False

    def put(self, notices: Sequence[Notice]) -> None:
        """Hand notices over, but those of another run."""
        if self._overrun:
            return
        if self._run is not None:
            notices = [notice for notice in notices if notice.run in ("", self._run)]
        room = self._size - len(self._waiting)
        self._overrun = len(notices) > room
        self._waiting.extend(notices[:room])
        self._wake.set()

    def end(self) -> None:
        """No more will come."""
        self._ended = True
        self._wake.set()

    def __aiter__(self) -> AsyncIterator[Notice]:
        return self

    async def __anext__(self) -> Notice:
        """The next notice; ends with the executive.

        Raises:
            OperatorError: this reader was too slow.
        """
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
    """All subscriptions of an executive, held weakly: a reader that is gone leaves nothing."""

    def __init__(self) -> None:
        self._subscriptions: list[weakref.ref[Subscription]] = []
        self._ended = False

    @property
    def anybody(self) -> bool:
        """Whether there is anyone to tell."""
        return bool(self._subscriptions)

    def subscribe(self, run: RunId | None, size: int) -> Subscription:
        """Everything from now on."""
        subscription = Subscription(run, size)
        if self._ended:
            subscription.end()
        else:
            # A new list: one may be let go while `publish` walks over the old.
            self._subscriptions = [
                *self._subscriptions,
                weakref.ref(subscription, self._forget),
            ]
        return subscription

    def publish(self, *notices: Notice) -> None:
        """Tell all."""
        for reference in self._subscriptions:
            subscription = reference()
            if subscription is not None:
                subscription.put(notices)

    def end(self) -> None:
        """Let every reader come to its end, after what waits for it."""
        self._ended = True
        for reference in self._subscriptions:
            subscription = reference()
            if subscription is not None:
                subscription.end()
        self._subscriptions = []

    def _forget(self, gone: "weakref.ref[Subscription]") -> None:
        self._subscriptions = [kept for kept in self._subscriptions if kept is not gone]
