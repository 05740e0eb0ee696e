"""Says a thing again and again, until it was heard."""

import asyncio
from collections.abc import Callable

from m2pem.api import Clock
from m2pem_plugin_ros.drivers.node.link import REPEAT_S

SHORTEST_S = 0.02
"""Of real time: a clock may be so fast that repeating would flood the vehicle."""


class Insisting:
    """Tasks that repeat, each with a name. A new one of the same name takes its place."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def start(self, name: str, say: Callable[[], bool]) -> None:
        """Call `say` now, and again and again as long as it returns True."""
        self.stop(name)
        if say():
            task = asyncio.get_running_loop().create_task(self._repeat(say))
            self._tasks[name] = task
            task.add_done_callback(lambda done: self._drop(name, done))

    def goes_on(self, name: str) -> bool:
        """Whether it is repeated still."""
        return name in self._tasks

    def stop(self, name: str) -> None:
        """Say it no more."""
        if (task := self._tasks.pop(name, None)) is not None:
            task.cancel()

    def stop_all(self) -> None:
        """Say nothing more."""
        for name in list(self._tasks):
            self.stop(name)

    async def pause(self) -> None:
        """Wait until it is time to repeat."""
        async with asyncio.TaskGroup() as both:
            both.create_task(self._clock.sleep(REPEAT_S))
            both.create_task(asyncio.sleep(SHORTEST_S))

    async def _repeat(self, say: Callable[[], bool]) -> None:
        while True:
            await self.pause()
            if not say():
                return

    def _drop(self, name: str, task: asyncio.Task[None]) -> None:
        if self._tasks.get(name) is task:
            del self._tasks[name]
        if not task.cancelled() and (error := task.exception()) is not None:
            loop = task.get_loop()
            loop.call_exception_handler({"message": f"repeating {name}", "exception": error})
