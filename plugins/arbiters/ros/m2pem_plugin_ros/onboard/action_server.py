"""The action `execute_behavior` of an m2pem node: goals that are behaviors."""

import asyncio
from collections import defaultdict
from typing import Any, Protocol

from m2pem_interfaces import msg as interfaces
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
"""Who hears that a goal has ended asks for its result then, which takes so long at the most."""


class Desk(Protocol):
    """Who does what is asked for."""

    def start(self, message: Any) -> None:
        """As START on `command`; its statuses are said, or said again."""
        ...

    def cancel(self, id_: str) -> None:
        """As CANCEL on `command`."""
        ...


class Goals:
    """Serves the action. A goal lives as long as the behavior of its id, whoever started that."""

    def __init__(self, ros: RosRuntime, node: Node, desk: Desk) -> None:
        self._desk = desk
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

    def said(self, status: Status) -> None:
        """Hand a status to the goals that are its behavior."""
        for queue in self._waiting.get(status.id, ()):
            queue.put_nowait(status)

    async def settled(self, within_s: float) -> None:
        """Wait until all goals have ended, or for so many real seconds; and until their results can
        have been asked for."""
        deadline = self._loop.time() + within_s
        while self._waiting and self._loop.time() < deadline:  # noqa: ASYNC110  # at the end only
            await asyncio.sleep(POLL_S)
        if self._ended_s is not None:
            await asyncio.sleep(self._ended_s + ASKED_WITHIN_S - self._loop.time())

    def _cancel(self, handle: Any) -> CancelResponse:
        # In the thread of ROS, before the goal is shown as being canceled.
        self._cancelled.add(_key(handle))
        self._loop.call_soon_threadsafe(self._desk.cancel, handle.request.command.id)
        return CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> Any:
        command = handle.request.command
        if command.verb != Verb.START or not command.id:
            reason = "a goal's command is a START with an id"
            status = Status(command.id, 1, BehaviorState.REJECTED, "REJECTED", reason)
            handle.abort()
            return _result(status)
        queue: asyncio.Queue[Status] = asyncio.Queue()
        self._waiting[command.id].add(queue)
        try:
            self._desk.start(command)
            if _key(handle) in self._cancelled:  # it was, before it had begun
                self._desk.cancel(command.id)
            return _result(await self._follow(handle, queue))
        finally:
            self._ended_s = self._loop.time()
            self._waiting[command.id].discard(queue)
            if not self._waiting[command.id]:
                del self._waiting[command.id]
            self._cancelled.discard(_key(handle))

    async def _follow(self, handle: Any, queue: asyncio.Queue[Status]) -> Status:
        while (status := await queue.get()).state not in ENDS:
            feedback = _written(status)
            handle.publish_feedback(ExecuteBehavior.Feedback(status=feedback))
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
        # There is no event for what the thread of ROS does right after `_cancel`.
        while not handle.is_cancel_requested and self._loop.time() < deadline:  # noqa: ASYNC110
            await asyncio.sleep(POLL_S)
        return bool(handle.is_cancel_requested)


def _key(handle: Any) -> bytes:
    return bytes(handle.goal_id.uuid)


def _written(status: Status) -> Any:
    return write_status(interfaces.BehaviorStatus(), status, interfaces.KeyValue)


def _result(status: Status) -> Any:
    return ExecuteBehavior.Result(status=_written(status))
