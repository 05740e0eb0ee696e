"""One action of Nav2: goals are sent, watched and cancelled, whoever has sent them.

It speaks to the services and topics of the action itself. rclpy's client knows only goals that it
has sent, while after a restart, or a takeover, it is the others that matter.
"""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from unique_identifier_msgs import msg as unique_identifier

from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError, qos

ANSWER_S = 3.0
"""Real seconds in which Nav2 answers, or is not there."""

CANCEL_S = 2.0
"""Real seconds in which Nav2 says that it cancels, and then in which a goal has ended."""

FOREVER_S = 1e9
"""A result is waited for as long as the vehicle drives."""

ACTIVE = frozenset(
    {GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING}
)


@dataclass(frozen=True, slots=True)
class Ended:
    """How a goal ended: a status of action_msgs/GoalStatus (UNKNOWN: the server knows no such
    goal), and the action's result."""

    status: int
    result: Any


class GoalClient:
    """`name`: of the action, with the namespace. `heard` is called whenever it says something;
    `feedback(goal, feedback)` with the feedback of any goal."""

    def __init__(self, ros: RosRuntime, action: Any, name: str, heard: Callable[[], None]) -> None:
        self.name = name
        self.action = action
        self.feedback: Callable[[UUID, Any], None] = lambda _, __: None
        self._ros = ros
        self._heard = heard
        self._sending: dict[UUID, asyncio.Task[bool]] = {}
        self._statuses: dict[UUID, int] = {}
        self._open: set[UUID] = set()
        self._writers: frozenset[bytes] = frozenset()
        self._renewed = asyncio.Event()
        impl = action.Impl
        self._send_client = ros.client(impl.SendGoalService, f"{name}/_action/send_goal")
        self._result_client = ros.client(impl.GetResultService, f"{name}/_action/get_result")
        self._cancel_client = ros.client(CancelGoal, f"{name}/_action/cancel_goal")
        ros.subscribe(
            impl.FeedbackMessage, f"{name}/_action/feedback", self._on_feedback, qos.EVENTS
        )
        ros.subscribe(impl.GoalStatusMessage, self._status_topic, self._on_status, qos.STATUS)

    # --- what is known --------------------------------------------------------------------------

    @property
    def there(self) -> bool:
        """Whether a server of the action is seen."""
        return bool(self._send_client.service_is_ready())

    @property
    def statuses(self) -> dict[UUID, int]:
        """All goals that the server told of last, whoever sent them."""
        return self._statuses

    @property
    def active(self) -> set[UUID]:
        """Goals that go on, or may go on, as far as is known."""
        told = {goal for goal, status in self._statuses.items() if status in ACTIVE}
        return told | self._open

    @property
    def busy(self) -> bool:
        """Whether a goal goes on, or is just being sent."""
        return bool(self._sending or self.active)

    def look_for_server(self) -> None:
        """Notice another server than before: it knows nothing of goals that the old one had."""
        endpoints = self._ros.node.get_publishers_info_by_topic(self._status_topic)
        writers = frozenset(bytes(endpoint.endpoint_gid) for endpoint in endpoints)
        if not writers:
            self._statuses = {}
        if writers - self._writers and self._writers:
            self._statuses = {}
            renewed, self._renewed = self._renewed, asyncio.Event()
            renewed.set()
        self._writers |= writers

    # --- what is asked --------------------------------------------------------------------------

    async def send(self, goal_id: UUID, goal: Any) -> bool:
        """Send a goal, in place of what the action does; returns whether it was accepted.

        Who is cancelled while waiting here has sent it all the same: `cancel` reckons with it.

        Raises:
            RosError: no answer came.
        """
        task = asyncio.get_running_loop().create_task(self._send(goal_id, goal))
        self._sending[goal_id] = task
        self._open.add(goal_id)
        task.add_done_callback(lambda done: self._sent(goal_id, done))
        return await asyncio.shield(task)

    async def result(self, goal_id: UUID, timeout_s: float | None = None) -> Ended:
        """How a goal ended, when it has. A server that was started anew is asked again.

        Raises:
            RosTimeoutError: it did not end in time.
            RosError: the connection was closed.
        """
        try:
            async with asyncio.timeout(timeout_s):
                answer = await self._ask_for_result(goal_id)
        except TimeoutError as error:
            what = f"{self.name}: goal {goal_id} has not ended within {timeout_s} s"
            raise RosTimeoutError(what) from error
        self._open.discard(goal_id)
        return Ended(int(answer.status), answer.result)

    async def cancel(self, goal_id: UUID | None = None) -> None:
        """Cancel a goal, or all goals, also foreign ones, and wait until they have ended.

        Raises:
            RosError: no answer came, or a goal does not end.
        """
        under_way = [task for id_, task in self._sending.items() if goal_id in (None, id_)]
        if under_way:
            await asyncio.wait(under_way)
        goals = self.active if goal_id is None else {goal_id} & self.active
        if goal_id is not None and not goals:
            return
        request = CancelGoal.Request()
        if goal_id is not None:
            request.goal_info.goal_id = _uuid(goal_id)
        answer = await self._ros.call(self._cancel_client, request, CANCEL_S)
        stopping = {UUID(bytes=bytes(info.goal_id.uuid)) for info in answer.goals_canceling}
        await asyncio.gather(*(self.result(goal, CANCEL_S) for goal in goals | stopping))

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _status_topic(self) -> str:
        return f"{self.name}/_action/status"

    async def _send(self, goal_id: UUID, goal: Any) -> bool:
        request = self.action.Impl.SendGoalService.Request(goal_id=_uuid(goal_id), goal=goal)
        answer = await self._ros.call(self._send_client, request, ANSWER_S)
        return bool(answer.accepted)

    def _sent(self, goal_id: UUID, task: asyncio.Task[bool]) -> None:
        self._sending.pop(goal_id, None)
        if task.cancelled() or task.exception() is not None:
            return  # whether it has an effect is not known
        self._heard()
        if not task.result():
            self._open.discard(goal_id)

    async def _ask_for_result(self, goal_id: UUID) -> Any:
        request = self.action.Impl.GetResultService.Request(goal_id=_uuid(goal_id))
        loop = asyncio.get_running_loop()
        while True:
            ask = loop.create_task(self._ros.call(self._result_client, request, FOREVER_S))
            renewed = loop.create_task(self._renewed.wait())
            try:
                await asyncio.wait([ask, renewed], return_when=asyncio.FIRST_COMPLETED)
                if ask.done():
                    return ask.result()
            finally:
                ask.cancel()
                renewed.cancel()
                await asyncio.gather(ask, renewed, return_exceptions=True)

    def _on_status(self, message: Any) -> None:
        self._heard()
        self._statuses = {
            UUID(bytes=bytes(status.goal_info.goal_id.uuid)): int(status.status)
            for status in message.status_list
        }
        self._open -= {goal for goal, status in self._statuses.items() if status not in ACTIVE}

    def _on_feedback(self, message: Any) -> None:
        self._heard()
        self.feedback(UUID(bytes=bytes(message.goal_id.uuid)), message.feedback)


def _uuid(goal_id: UUID) -> Any:
    return unique_identifier.UUID(uuid=list(goal_id.bytes))


_NUMBERS = (1 << 32) - 1


def numbered(order: UUID, number: int) -> UUID:
    """The goal of that number, from 0 to 2**32 - 1."""
    return UUID(int=order.int ^ (number & _NUMBERS))


def number_of(order: UUID, goal: UUID) -> int | None:
    """Which goal of the order it is; None: it is none of them."""
    difference = order.int ^ goal.int
    return difference if difference <= _NUMBERS else None
