"""One action with one goal at a time, as Nav2 serves them: a new goal takes the place of the old
one, which is aborted without a word."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup

from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sim.nav2.faults import Faults

LOOK_S = 0.02

logger = logging.getLogger(__name__)


class AbortedError(Exception):
    """The goal cannot be reached. `error_code` is one of the action."""

    def __init__(self, error_code: int = 0, error_msg: str = "") -> None:
        super().__init__(error_msg)
        self.error_code = error_code
        self.error_msg = error_msg


class GoalServer:
    """`carry_out(handle)` returns the result of a goal that was reached, or raises `AbortedError`;
    it is cancelled when the goal is. `is_active` says whether goals are accepted."""

    def __init__(
        self,
        ros: RosRuntime,
        action: Any,
        name: str,
        carry_out: Callable[[Any], Awaitable[Any]],
        is_active: Callable[[], bool],
        faults: Faults,
    ) -> None:
        self.name = name
        self.action = action
        self._carry_out = carry_out
        self._is_active = is_active
        self._faults = faults
        self._current: Any = None
        ActionServer(
            ros.node,
            action,
            name,
            ros.coroutine(self._execute),
            goal_callback=self._answer,
            cancel_callback=self._answer_cancel,
            callback_group=ReentrantCallbackGroup(),
        )

    @property
    def busy(self) -> bool:
        """Whether a goal goes on."""
        return self._current is not None

    def drop(self) -> None:
        """Abort what goes on, as when Nav2 is deactivated."""
        self._current = None

    def _answer(self, _: Any) -> GoalResponse:
        accepts = self._is_active() and not self._faults.reject
        return GoalResponse.ACCEPT if accepts else GoalResponse.REJECT

    def _answer_cancel(self, _: Any) -> CancelResponse:
        return CancelResponse.REJECT if self._faults.hang else CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> Any:
        self._current = handle
        work = asyncio.ensure_future(self._do(handle))
        try:
            while not work.done() and not handle.is_cancel_requested and self._current is handle:
                await asyncio.wait([work], timeout=LOOK_S)
            return self._result(handle, work)
        finally:
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)
            if self._current is handle:
                self._current = None

    async def _do(self, handle: Any) -> Any:
        if self._faults.hang:
            await asyncio.Event().wait()
        if self._faults.error_code:
            work = asyncio.ensure_future(self._carry_out(handle))
            try:
                await asyncio.wait([work], timeout=self._faults.abort_after_s)
            finally:
                work.cancel()
                await asyncio.gather(work, return_exceptions=True)
            raise AbortedError(self._faults.error_code, self._faults.error_msg)
        return await self._carry_out(handle)

    def _result(self, handle: Any, work: "asyncio.Future[Any]") -> Any:
        empty = self.action.Result()
        error = work.exception() if work.done() else None
        if work.done() and error is None:
            handle.succeed()
            return work.result()
        if handle.is_cancel_requested:
            handle.canceled()
            return empty
        handle.abort()
        if self._current is not handle:  # another goal has taken its place
            return empty
        if not isinstance(error, AbortedError):
            logger.error("%s failed", self.name, exc_info=error)
            return empty
        result = self.action.Result(error_code=error.error_code)
        if hasattr(result, "error_msg"):
            result.error_msg = error.error_msg
        return result
