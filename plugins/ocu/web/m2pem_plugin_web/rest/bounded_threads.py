"""Work for threads beside the event loop, of which few go on at a time: other requests wait."""

import asyncio
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class BoundedThreads:
    """At most `at_once` pieces of work at a time, each in a thread of its own."""

    def __init__(self, at_once: int = 1) -> None:
        self._turn = asyncio.Semaphore(at_once)

    async def run(self, work: Callable[P, T], *args: P.args, **options: P.kwargs) -> T:
        """Return what `work` returns, once it had its turn."""
        async with self._turn:
            return await asyncio.to_thread(work, *args, **options)
