"""Calls into MAVSDK that are on their way."""

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class Calls:
    """A call is made in a thread and cannot be stopped: who waits for it may be cancelled, and then
    it goes on. What it works with must not go away before it has come back."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[Any]] = set()

    @property
    def pending(self) -> bool:
        """Whether any is on its way."""
        return bool(self._tasks)

    async def make(self, call: Coroutine[Any, Any, T]) -> T:
        """Make a call; what it raises is raised."""
        task = asyncio.get_running_loop().create_task(call)
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return await asyncio.shield(task)

    def _done(self, task: "asyncio.Task[Any]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # so that nobody says that nobody has asked

    async def finish(self) -> None:
        """Wait until all have come back; each does so soon, as MAVSDK waits for no vehicle long."""
        while self._tasks:
            await asyncio.wait(self._tasks)
