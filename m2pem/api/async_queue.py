"""A queue for one reader that ends."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class AsyncQueue(Generic[T]):
    """Items as they come, until `close`, after which what waits is still read.

    `size`: more than this don't wait; the oldest that `droppable` says may go is dropped then.
    """

    def __init__(
        self, size: int | None = None, droppable: Callable[[T], bool] = lambda _: True
    ) -> None:
        self._waiting: deque[T] = deque()
        self._size = size
        self._droppable = droppable
        self._news = asyncio.Event()
        self._closed = False

    def put(self, item: T) -> None:
        """Hand an item to the reader; after `close` it is thrown away."""
        if self._closed:
            return
        if self._size is not None and len(self._waiting) >= self._size:
            for index, old in enumerate(self._waiting):
                if self._droppable(old):
                    del self._waiting[index]
                    break
        self._waiting.append(item)
        self._news.set()

    def close(self) -> None:
        """Ignore items from now on; `read` ends after the waiting ones."""
        self._closed = True
        self._news.set()

    async def read(self) -> AsyncIterator[T]:
        """Yield all items, for one reader."""
        while True:
            while self._waiting:
                yield self._waiting.popleft()
            if self._closed:
                return
            self._news.clear()
            await self._news.wait()
