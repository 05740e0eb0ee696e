"""Passes the log of m2pem on to the log of a ROS node: /rosout, the console and files of ROS."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

MOST_PER_S = 50
"""Messages that are passed on in a second; the others are counted, and the number is logged."""

M2PEM = "m2pem"


class NodeLog(logging.Handler):
    """Logs with the logger of a node, at the same severity. Of a flood, the rest is counted."""

    def __init__(self, ros_log: Any, now_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._ros_log = ros_log
        self._now_s = now_s
        self._since_s = now_s()
        self._passed = self._left_out = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a record on."""
        try:
            if self._may_pass():
                self._say(record.levelno, self.format(record))
        except Exception:  # as handlers of logging do: no message must end the program
            self.handleError(record)

    def _may_pass(self) -> bool:
        now_s = self._now_s()
        if now_s - self._since_s >= 1.0:
            left_out, self._left_out = self._left_out, 0
            self._since_s, self._passed = now_s, 0
            if left_out:
                self._say(logging.WARNING, f"{left_out} messages were left out")
        self._passed += 1
        self._left_out += self._passed > MOST_PER_S
        return self._passed <= MOST_PER_S

    def _say(self, level: int, text: str) -> None:
        # rclpy allows one severity for each line of source.
        log = self._ros_log
        if level >= logging.CRITICAL:
            log.fatal(text)
        elif level >= logging.ERROR:
            log.error(text)
        elif level >= logging.WARNING:
            log.warning(text)
        elif level >= logging.INFO:
            log.info(text)
        else:
            log.debug(text)


@contextmanager
def logging_with(ros_log: Any, *, alone: bool = False) -> Iterator[None]:
    """Pass the log of m2pem on to a node's logger, in the block.

    `alone`: nothing else gets it, and the level of the node counts for it, as for a node that is
    the whole program.
    """
    logger, handler = logging.getLogger(M2PEM), NodeLog(ros_log)
    handlers, level, propagates = logger.handlers[:], logger.level, logger.propagate
    if alone:
        logger.handlers[:] = []
        logger.propagate = False
        logger.setLevel(int(ros_log.get_effective_level()))
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        if alone:
            logger.handlers[:] = handlers
            logger.propagate = propagates
            logger.setLevel(level)
