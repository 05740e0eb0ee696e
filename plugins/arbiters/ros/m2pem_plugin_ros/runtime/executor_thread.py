"""An executor of rclpy in a thread of its own."""

import logging
import threading
from collections.abc import Callable

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor

JOIN_S = 5.0

logger = logging.getLogger(__name__)


class ExecutorThread:
    """It runs the callbacks of its nodes until its context is shut down. `is_closing`: errors of
    callbacks are no longer logged."""

    def __init__(self, context: Context, name: str, is_closing: Callable[[], bool]) -> None:
        self._context = context
        self._is_closing = is_closing
        self.executor = SingleThreadedExecutor(context=context)
        self._thread = threading.Thread(target=self._spin, name=f"ros-{name}", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def join(self) -> None:
        """Wait until the thread has ended, JOIN_S at most. The context is shut down before."""
        self._thread.join(JOIN_S)

    def _spin(self) -> None:
        while self._context.ok():
            try:
                self.executor.spin_once()
            except (ExternalShutdownException, ShutdownException):
                return
            except InvalidHandle:  # the entity was destroyed on the loop meanwhile
                continue
            except Exception:  # one invalid message must not end the executor
                if not self._is_closing():
                    logger.exception("a callback of ROS failed")
