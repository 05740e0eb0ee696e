"""Responses of services, sent until DDS takes them."""

import asyncio
import logging
import warnings
from collections.abc import Sequence
from typing import Any

from rclpy.executors import Executor

logger = logging.getLogger(__name__)

NOT_SENT = "failed to send response"
"""How the RuntimeWarning begins that rclpy gives for a response that the middleware dropped."""

AGAIN_S: Sequence[float] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Before each further try. What discovery lost comes again within some seconds; each try blocks the
executor for up to 0.1 s."""


class Responses:
    """Sends the responses of one service, again while the client's reader is not discovered.

    DDS discovers what a client sends its requests with and what it receives the responses with one
    by one. If a packet in between is lost, a request comes seconds before its response can be
    delivered. rmw_fastrtps waits 0.1 s for that, then drops the response, and rclpy only warns.
    """

    def __init__(self, service: Any, executor: Executor, loop: asyncio.AbstractEventLoop) -> None:
        self._send = service.send_response
        self._name = service.srv_name
        self._executor = executor
        self._loop = loop

    def send(self, response: Any, header: Any, tries: int = 0) -> None:
        """Send it now, and if the client is not discovered, later. In the executor's thread."""
        if self._is_sent(response, header):
            return
        if tries == len(AGAIN_S):
            logger.warning(
                "service %s: DDS has not discovered the client of a request within %g s, so that "
                "it gets no response; what it asked for was handled",
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
