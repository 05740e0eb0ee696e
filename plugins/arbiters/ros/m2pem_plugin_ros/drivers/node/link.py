"""The interface of the two links to an m2pem node, by topics or by the action, and their
retries."""

import asyncio
from collections.abc import Callable
from typing import Protocol
from uuid import UUID

from m2pem.api import BehaviorState, Clock
from m2pem_plugin_ros.drivers.driver import Order, Outcome

REPEAT_S = 0.5
"""A command without an answer is sent again after this time of the clock."""

ANSWER_WITHIN_S = 10.0
"""A node that is received, but answers no START within this time, will not do it."""

QUERY_WITHIN_S = 3.0
"""Timeout of a QUERY."""

REMEMBERED = 100
"""Number of ended goals whose outcome is kept."""

STILL_S = 2.5
"""A node reports its behavior once a second. If it was reported within this time, an UNKNOWN came
from a second node, and the first was not restarted."""

REPLACED = Outcome(BehaviorState.CANCELLED, reason="another behavior has replaced it")

RESTARTED = "the vehicle's node was restarted and does not have the behavior"


class NodeLink(Protocol):
    """Sends START, CANCEL and QUERY to a node, and reports the results."""

    @property
    def order(self) -> Order | None:
        """The current order."""
        ...

    def begin(self, order: Order) -> None: ...

    def end(self, goal: UUID) -> None: ...

    async def query(self, order: Order) -> Outcome: ...

    def vehicle_does(self, behavior: str) -> None:
        """Process the behavior that vehicle_status reports; "" if there is none."""
        ...

    def abandon(self) -> None: ...

    async def close(self) -> None:
        """Send nothing more."""
        ...


Send = Callable[[object], None]
"""Publishes a message on `command`."""


SHORTEST_S = 0.02
"""Shortest period in real time, so that a fast clock does not flood the vehicle."""


class Retries:
    """Repeats messages until they are acknowledged. Each has a name; a new one replaces that of the
    same name. Nothing is repeated while `may_send` is false."""

    def __init__(self, clock: Clock, may_send: Callable[[], bool] = lambda: True) -> None:
        self._clock = clock
        self._may_send = may_send
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def start(self, name: str, send: Callable[[], bool]) -> None:
        """Call `send` now, and repeat it while it returns True."""
        self.stop(name)
        if send():
            task = asyncio.get_running_loop().create_task(self._repeat(send))
            self._tasks[name] = task
            task.add_done_callback(lambda done: self._drop(name, done))

    def goes_on(self, name: str) -> bool:
        """Whether a message is still repeated."""
        return name in self._tasks

    def stop(self, name: str) -> None:
        """Stop repeating a message."""
        if (task := self._tasks.pop(name, None)) is not None:
            task.cancel()

    def stop_all(self) -> None:
        """Stop repeating all messages."""
        for name in list(self._tasks):
            self.stop(name)

    async def pause(self) -> None:
        """Wait until the next repetition."""
        while True:
            async with asyncio.TaskGroup() as both:
                both.create_task(self._clock.sleep(REPEAT_S))
                both.create_task(asyncio.sleep(SHORTEST_S))
            if self._may_send():
                return

    async def _repeat(self, send: Callable[[], bool]) -> None:
        while True:
            await self.pause()
            if not send():
                return

    def _drop(self, name: str, task: asyncio.Task[None]) -> None:
        if self._tasks.get(name) is task:
            del self._tasks[name]
        if not task.cancelled() and (error := task.exception()) is not None:
            loop = task.get_loop()
            loop.call_exception_handler({"message": f"repeating {name}", "exception": error})
