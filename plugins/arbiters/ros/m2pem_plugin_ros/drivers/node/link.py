"""What a driver of an m2pem node asks of the way in which it is commanded."""

import asyncio
from collections.abc import Callable
from typing import Protocol
from uuid import UUID

from m2pem.api import Clock
from m2pem_plugin_ros.drivers.driver import Order, Outcome

REPEAT_S = 0.5
"""After so long without an answer a command is sent again, on the clock that was lent."""

ANSWER_WITHIN_S = 10.0
"""A node that is heard, and answers no START for so long, will not do it."""

LOOK_WITHIN_S = 3.0
"""A node that is there answers a question at once."""

REMEMBERED = 100
"""Goals that have ended of which it is known how."""

STILL_S = 2.5
"""A node says at least once a second what it does. If what was said to be unknown was said to go on
within this, two nodes are there, and the one that does it was not restarted."""

RESTARTED = "the vehicle's node was restarted and knows nothing of it"


class Link(Protocol):
    """START, CANCEL, and what becomes of them; by topics or as an action."""

    @property
    def order(self) -> Order | None:
        """What the vehicle is to do now."""
        ...

    def begin(self, order: Order) -> None:
        """As `Driver.begin`."""
        ...

    def end(self, goal: UUID) -> None:
        """As `Driver.end`."""
        ...

    async def look(self, order: Order) -> Outcome:
        """As `Driver.look`."""
        ...

    def vehicle_does(self, behavior: str) -> None:
        """vehicle_status has said which behavior is going on; "": none."""
        ...

    def forget(self) -> None:
        """As `Driver.forget`."""
        ...

    async def close(self) -> None:
        """Send nothing more."""
        ...


Send = Callable[[object], None]
"""Publishes on `command`."""


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
