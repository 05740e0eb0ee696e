"""Calls of services and actions: bounded in number and time, awaited on an event loop."""

import asyncio
from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

from rclpy import Future

from m2pem_plugin_ros.installation import RosError

IN_FLIGHT = 8
"""Calls of one client that are not answered. A service keeps ten by default, of all its clients,
and loses the others silently."""

DISCOVERY_S = 0.02
"""How often it is looked whether a server is there: rclpy tells no other way."""


class RosTimeoutError(RosError, TimeoutError):
    """No answer came in time. Whether the call had an effect is not known."""


class Calls:
    """All calls of a runtime that wait for an answer. Belongs to the loop that it was made on."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._slots: WeakKeyDictionary[Any, asyncio.Semaphore] = WeakKeyDictionary()
        self._open: set[asyncio.Future[Any]] = set()
        self._closed = False

    async def ask(
        self,
        client: Any,
        is_ready: Callable[[], bool],
        send: Callable[[], Future],
        timeout_s: float,
        what: str,
    ) -> Any:
        """Wait until a server is there and a slot free, send, and wait for the answer.

        Raises:
            RosTimeoutError: all that took longer than `timeout_s`.
            RosError: the runtime was closed.
        """
        slots = self._slots.setdefault(client, asyncio.Semaphore(IN_FLIGHT))
        doing = "no server was found"
        try:
            async with asyncio.timeout(timeout_s), slots:
                while not self._closed and not is_ready():  # noqa: ASYNC110  # there is no event
                    await asyncio.sleep(DISCOVERY_S)
                doing = "no answer came"
                self._check(what)
                return await self._wait(send(), what)
        except TimeoutError as error:
            raise RosTimeoutError(f"{what}: {doing} within {timeout_s:g} s") from error

    async def wait(self, future: Future, what: str, timeout_s: float | None = None) -> Any:
        """The result of a future of rclpy; it is cancelled when this is.

        Never await such a future on an event loop: it keeps the loop spinning.

        Raises:
            RosTimeoutError: it took longer than `timeout_s`.
            RosError: the runtime was closed.
        """
        try:
            async with asyncio.timeout(timeout_s):
                return await self._wait(future, what)
        except TimeoutError as error:
            raise RosTimeoutError(f"{what}: no answer came within {timeout_s} s") from error

    async def _wait(self, future: Future, what: str) -> Any:
        self._check(what)
        answer: asyncio.Future[Any] = self._loop.create_future()
        self._open.add(answer)
        future.add_done_callback(lambda _: self._tell(answer, future))
        try:
            return await answer
        finally:
            self._open.discard(answer)
            future.cancel()  # whose answer is no longer awaited is forgotten by rclpy, too

    def close(self) -> None:
        """End all that waits, with RosError."""
        self._closed = True
        for answer in self._open:
            if not answer.done():
                answer.set_exception(RosError("the connection to ROS was closed"))

    def _check(self, what: str) -> None:
        if self._closed:
            raise RosError(f"{what}: the connection to ROS was closed")

    def _tell(self, answer: asyncio.Future[Any], future: Future) -> None:
        try:
            self._loop.call_soon_threadsafe(_settle, answer, future)
        except RuntimeError:  # the loop is closed, and nobody waits any more
            return


def _settle(answer: asyncio.Future[Any], future: Future) -> None:
    if answer.done():
        return
    if future.cancelled():
        answer.cancel()
    elif (error := future.exception()) is not None:
        answer.set_exception(error)
    else:
        answer.set_result(future.result())
