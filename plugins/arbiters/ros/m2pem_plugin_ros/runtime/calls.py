"""Calls of services and actions, bounded in number and time, and the responses of our own
services."""

import asyncio
import logging
import warnings
from collections.abc import Callable, Sequence
from typing import Any
from weakref import WeakKeyDictionary

from rclpy import Future
from rclpy.executors import Executor

from m2pem_plugin_ros.installation import RosError

IN_FLIGHT = 8
"""Unanswered calls of one client. A service keeps ten requests of all its clients by default, and
loses the others silently."""

DISCOVERY_S = 0.02
"""Period of the check whether a server is there: rclpy has no event for it."""


class RosTimeoutError(RosError, TimeoutError):
    """No answer came in time. The call may have had an effect."""


class Calls:
    """All calls of a runtime that wait for an answer. It belongs to the loop on which it was
    made."""

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
        """Wait for a server and a free slot, send, and wait for the answer.

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
        """Return the result of a future of rclpy. The future is cancelled when the caller is.

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
        future.add_done_callback(lambda _: self._settle_on_loop(answer, future))
        try:
            return await answer
        finally:
            self._open.discard(answer)
            future.cancel()  # rclpy drops calls whose answer is no longer awaited

    def close(self) -> None:
        """End all waiting calls with RosError."""
        self._closed = True
        for answer in self._open:
            if not answer.done():
                answer.set_exception(RosError("the connection to ROS was closed"))

    def _check(self, what: str) -> None:
        if self._closed:
            raise RosError(f"{what}: the connection to ROS was closed")

    def _settle_on_loop(self, answer: asyncio.Future[Any], future: Future) -> None:
        try:
            self._loop.call_soon_threadsafe(_settle, answer, future)
        except RuntimeError:  # the loop is closed, and no task waits
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


logger = logging.getLogger(__name__)

NOT_SENT = "failed to send response"
"""Start of the RuntimeWarning of rclpy for a response that the middleware dropped."""

AGAIN_S: Sequence[float] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Delays before each retry. Discovery recovers within some seconds; each try blocks the executor
for up to 0.1 s."""


class Responses:
    """Sends the responses of one service, and again while the client's reader is not discovered.

    DDS discovers the writer of a client's requests and the reader of its responses separately. If a
    packet is lost, a request arrives seconds before its response can be delivered. rmw_fastrtps
    waits 0.1 s, then drops the response, and rclpy only warns.
    """

    def __init__(self, service: Any, executor: Executor, loop: asyncio.AbstractEventLoop) -> None:
        self._send = service.send_response
        self._name = service.srv_name
        self._executor = executor
        self._loop = loop

    def send(self, response: Any, header: Any, tries: int = 0) -> None:
        """Send a response now, or later if the client is not discovered. Call it in the executor's
        thread."""
        if self._is_sent(response, header):
            return
        if tries == len(AGAIN_S):
            logger.warning(
                "service %s: DDS has not discovered the client of a request within %g s, so that "
                "it gets no response; its request was handled",
                self._name,
                sum(AGAIN_S),
            )
            return

        def again() -> None:
            self._executor.create_task(self.send, response, header, tries + 1)

        self._loop.call_soon_threadsafe(self._loop.call_later, AGAIN_S[tries], again)

    def _is_sent(self, response: Any, header: Any) -> bool:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            self._send(response, header)
        dropped = [each for each in caught if str(each.message).startswith(NOT_SENT)]
        for other in caught:
            if other not in dropped:  # of another thread
                warnings.warn_explicit(other.message, other.category, other.filename, other.lineno)
        return not dropped
