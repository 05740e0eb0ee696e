"""The action server `execute_behavior` of an m2pem node: a goal is a behavior."""

import asyncio
from collections import defaultdict
from typing import Any, Protocol

from m2pem_interfaces.action import ExecuteBehavior
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from m2pem.api import BehaviorState
from m2pem_plugin_ros.interfaces.behavior_command import Verb
from m2pem_plugin_ros.interfaces.behavior_status import ENDS, Status, write_status
from m2pem_plugin_ros.runtime import RosRuntime

CANCELING_WITHIN_S = 1.0
POLL_S = 0.005
ASKED_WITHIN_S = 0.5
"""A client that receives the end of a goal requests its result within this time."""


class CommandHandler(Protocol):
    """Executes the commands of goals."""

    def start(self, message: Any) -> None:
        """Handle a START as on the topic `command`. Its statuses are published, or published
        again."""
        ...

    def cancel(self, id_: str) -> None:
        """Handle a CANCEL as on the topic `command`."""
        ...


class BehaviorActionServer:
    """Serves the action. A goal lasts as long as the behavior with its id, which any client may
    have started."""

    def __init__(self, ros: RosRuntime, node: Node, handler: CommandHandler) -> None:
        self._handler = handler
        self._loop = asyncio.get_running_loop()
        self._waiting: defaultdict[str, set[asyncio.Queue[Status]]] = defaultdict(set)
        self._cancelled: set[bytes] = set()
        self._ended_s: float | None = None
        self._server = ActionServer(
            node,
            ExecuteBehavior,
            "execute_behavior",
            ros.coroutine(self._execute),
            callback_group=ReentrantCallbackGroup(),
            cancel_callback=self._cancel,
        )

    def publish_status(self, status: Status) -> None:
        """Pass a status to the goals of its behavior."""
        for queue in self._waiting.get(status.id, ()):
            queue.put_nowait(status)

    async def wait_until_ended(self, within_s: float) -> None:
        """Wait until all goals have ended and their results can have been requested, or for
        `within_s` in real time."""
        deadline = self._loop.time() + within_s
        while self._waiting and self._loop.time() < deadline:  # noqa: ASYNC110  # at the end only
            await asyncio.sleep(POLL_S)
        if self._ended_s is not None:
            await asyncio.sleep(self._ended_s + ASKED_WITHIN_S - self._loop.time())

    def _cancel(self, handle: Any) -> CancelResponse:
        # Runs in the thread of ROS, before the goal is reported as canceling.
        self._cancelled.add(_key(handle))
        self._loop.call_soon_threadsafe(self._handler.cancel, handle.request.command.id)
        return CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> Any:
        command = handle.request.command
        if command.verb != Verb.START or not command.id:
            reason = "the command of a goal must be a START with an id"
            status = Status(command.id, 1, BehaviorState.REJECTED, "REJECTED", reason)
            handle.abort()
            return _result(status)
        queue: asyncio.Queue[Status] = asyncio.Queue()
        self._waiting[command.id].add(queue)
        try:
            self._handler.start(command)
            if _key(handle) in self._cancelled:  # the goal was cancelled before it began
                self._handler.cancel(command.id)
            return _result(await self._follow(handle, queue))
        finally:
            self._ended_s = self._loop.time()
            self._waiting[command.id].discard(queue)
            if not self._waiting[command.id]:
                del self._waiting[command.id]
            self._cancelled.discard(_key(handle))

    async def _follow(self, handle: Any, queue: asyncio.Queue[Status]) -> Status:
        while (status := await queue.get()).state not in ENDS:
            handle.publish_feedback(ExecuteBehavior.Feedback(status=write_status(status)))
        if status.state is BehaviorState.SUCCEEDED:
            handle.succeed()
        elif status.state is BehaviorState.CANCELLED and await self._is_canceling(handle):
            handle.canceled()
        else:
            handle.abort()
        return status

    async def _is_canceling(self, handle: Any) -> bool:
        if _key(handle) not in self._cancelled:
            return False
        deadline = self._loop.time() + CANCELING_WITHIN_S
        # There is no event for the change of state that rclpy makes right after `_cancel`.
        while not handle.is_cancel_requested and self._loop.time() < deadline:  # noqa: ASYNC110
            await asyncio.sleep(POLL_S)
        return bool(handle.is_cancel_requested)


def _key(handle: Any) -> bytes:
    return bytes(handle.goal_id.uuid)


def _result(status: Status) -> Any:
    return ExecuteBehavior.Result(status=write_status(status))
