"""Work on one vehicle, of which only the latest goes on."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any


class LatestTask:
    """Runs work in the order in which it is given: new work cancels the work before it, and begins
    when that has ended. `failed` gets the error of work that fails."""

    def __init__(self, failed: Callable[[BaseException], None] | None = None) -> None:
        self._failed = failed
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def is_running(self) -> bool:
        return bool(self._tasks)

    def replace(self, work: Callable[[], Awaitable[None]]) -> None:
        """Cancel all work, and do this after it."""
        before = set(self._tasks)
        self.cancel()
        self.add(self._after(before, work))

    def add(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Do this beside other work; what replaces that replaces this, too."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return task

    def cancel(self) -> None:
        """Cancel all work, and do not wait for its end."""
        for task in self._tasks:
            task.cancel()

    async def close(self) -> None:
        """Cancel all work, and wait for its end."""
        await cancel_and_wait(*self._tasks)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if self._failed is not None and not task.cancelled() and (error := task.exception()):
            self._failed(error)

    async def _after(
        self, before: set[asyncio.Task[None]], work: Callable[[], Awaitable[None]]
    ) -> None:
        if before:
            await asyncio.wait(before)
        await work()


async def cancel_and_wait(*tasks: asyncio.Future[Any] | None) -> None:
    """Cancel tasks, and wait until they have ended, with whatever result. None counts as ended."""
    begun = [task for task in tasks if task is not None]
    for task in begun:
        task.cancel()
    await asyncio.gather(*begun, return_exceptions=True)
