"""What the actions of the face share: bounds, names of clients, cancelling and refusals."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from m2pem.api import MissionControl, RunId
from m2pem.errors import BusyError, FindingsError, M2pemError, OperatorError
from m2pem_plugin_ros.interfaces.texts import sendable
from m2pem_plugin_ros.runtime import RosRuntime, qos

MOST_GOALS = 20
"""Goals of an action at once. More are refused, for which ROS has no text."""

RESULT_S = 60
"""So long the result of a goal is kept for its client."""

CANCELING_WITHIN_S = 1.0
POLL_S = 0.005

BUSY, NOT_WELL, REFUSED = "BUSY", "NOT_WELL", "REFUSED"
"""Codes of goals that did not begin: somebody has the vehicle; a parameter or the mission is wrong;
all other reasons."""

STOPPED = "STOPPED"
"""The code of a goal whose run was stopped, by another than its client."""

LONGEST_REASON = 4000

log = logging.getLogger("m2pem.face.ros")


def refusal(error: M2pemError) -> tuple[str, str]:
    """Return the code and the reason of what was refused."""
    if isinstance(error, BusyError):
        return BUSY, reason_of(error)
    if isinstance(error, FindingsError):
        return NOT_WELL, reason_of(error)
    return REFUSED, reason_of(error)


def reason_of(error: M2pemError) -> str:
    """Return what an error says, as a message can carry it."""
    return sendable(str(error))[:LONGEST_REASON]


class Goal:
    """One goal while it is carried out. `client`: names it in the journal."""

    def __init__(self, handle: Any, client: str) -> None:
        self.handle = handle
        self.client = client
        self.cancelled = asyncio.Event()

    @property
    def request(self) -> Any:
        return self.handle.request

    def publish(self, feedback: Any) -> None:
        """Publish feedback, while the goal is not canceling or over."""
        if self.handle.is_active:
            self.handle.publish_feedback(feedback)

    def check_not_cancelled(self) -> None:
        """To be called just before the goal begins.

        Raises:
            OperatorError: its client has cancelled it.
        """
        if self.cancelled.is_set():
            raise OperatorError("its client has cancelled it before it began")

    async def is_canceling(self) -> bool:
        """Whether its client has cancelled the goal, so that it can end as canceled."""
        if not self.cancelled.is_set():
            return False
        loop = asyncio.get_running_loop()
        deadline = loop.time() + CANCELING_WITHIN_S
        # There is no event for the change of state that rclpy makes right after the callback.
        while not self.handle.is_cancel_requested and loop.time() < deadline:  # noqa: ASYNC110
            await asyncio.sleep(POLL_S)
        return bool(self.handle.is_cancel_requested)

    def end(self, *, succeeded: bool, cancelled: bool) -> None:
        """Set the last state of the goal; `cancelled` only of one that is canceling."""
        if succeeded:
            self.handle.succeed()
        elif cancelled:
            self.handle.canceled()
        else:
            self.handle.abort()


class GoalServer:
    """Serves an action: `carry_out` returns the result of a goal when that is over."""

    def __init__(
        self,
        ros: RosRuntime,
        node: Node,
        action_type: Any,
        name: str,
        carry_out: Callable[[Goal], Awaitable[Any]],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._node = node.get_fully_qualified_name()
        self._carry_out = carry_out
        self._goals: dict[bytes, Goal] = {}
        self._cancelled: deque[bytes] = deque(maxlen=MOST_GOALS)
        """Goals that were cancelled before they began here, or just when they ended."""
        self._open = 0
        self._server = ActionServer(
            node,
            action_type,
            name,
            ros.coroutine(self._execute),
            callback_group=ReentrantCallbackGroup(),
            goal_callback=self._accept,
            cancel_callback=self._cancel,
            goal_service_qos_profile=qos.SERVICES,
            result_service_qos_profile=qos.SERVICES,
            cancel_service_qos_profile=qos.SERVICES,
            result_timeout=RESULT_S,
        )

    def _accept(self, _: Any) -> GoalResponse:
        # Runs in the thread of ROS, as `_cancel` does.
        if self._open >= MOST_GOALS:
            return GoalResponse.REJECT
        self._open += 1
        return GoalResponse.ACCEPT

    def _cancel(self, handle: Any) -> CancelResponse:
        self._loop.call_soon_threadsafe(self._note_cancelled, _key(handle))
        return CancelResponse.ACCEPT

    def _note_cancelled(self, key: bytes) -> None:
        goal = self._goals.get(key)
        if goal is not None:
            goal.cancelled.set()
        else:
            self._cancelled.append(key)

    async def _execute(self, handle: Any) -> Any:
        key = _key(handle)
        goal = self._goals[key] = Goal(handle, f"ros {self._node} goal {key.hex()[:8]}")
        if key in self._cancelled:
            self._cancelled.remove(key)
            goal.cancelled.set()
        try:
            return await self._carry_out(goal)
        finally:
            del self._goals[key]
            self._open -= 1
            _empty(handle.request)


async def stop_when_cancelled(control: MissionControl, goal: Goal, run: RunId, by: str) -> None:
    """Stop the run of a goal when its client cancels it."""
    await goal.cancelled.wait()
    try:
        await control.stop(run, by=by, reason="its client has cancelled the goal")
    except OperatorError as error:  # it has ended, or the journal has not written the stop yet
        log.info("%s: %s", run, error)


async def ended(task: "asyncio.Task[None]") -> None:
    """Cancel a task beside a goal, and wait for its end. If it failed, the goal goes on."""
    task.cancel()
    try:
        await task
    except asyncio.CancelledError:
        pass
    except Exception:
        log.exception("a goal has no more feedback, or cannot be cancelled")


def _empty(request: Any) -> None:
    """Free what a goal asked for: rclpy keeps its request as long as its result."""
    empty = type(request)()
    for name in request.get_fields_and_field_types():
        setattr(request, name, getattr(empty, name))


def _key(handle: Any) -> bytes:
    return bytes(handle.goal_id.uuid)
