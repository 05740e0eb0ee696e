"""The services and topics that an action is made of, for goals that another process has sent.

rclpy's own client knows only of goals that it has sent itself. After a restart, goals are found
again by their UUID, so that all goals are dealt with in that way.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from action_msgs import msg as action
from action_msgs import srv as action_services
from m2pem_interfaces.action import ExecuteBehavior
from unique_identifier_msgs import msg as unique_identifier

from m2pem_plugin_ros.runtime import RosRuntime, qos

Status = action.GoalStatus

ACTIVE = frozenset({Status.STATUS_ACCEPTED, Status.STATUS_EXECUTING, Status.STATUS_CANCELING})


@dataclass(frozen=True, slots=True)
class Listeners:
    """Called on the event loop: `status` with a goal and its number of GoalStatus, `feedback`
    with a goal and the feedback."""

    status: Callable[[UUID, int], None]
    feedback: Callable[[UUID, Any], None]


class GoalClient:
    """A client of the action `execute_behavior` in which goals are their UUIDs."""

    def __init__(self, ros: RosRuntime, name: str, listeners: Listeners) -> None:
        self._ros = ros
        self._listeners = listeners
        parts = ExecuteBehavior.Impl
        self._send = ros.client(parts.SendGoalService, f"{name}/_action/send_goal")
        self._result = ros.client(parts.GetResultService, f"{name}/_action/get_result")
        self._cancel = ros.client(action_services.CancelGoal, f"{name}/_action/cancel_goal")
        ros.subscribe(
            action.GoalStatusArray,
            f"{name}/_action/status",
            self._hear_statuses,
            qos.STATUS,
        )
        ros.subscribe(
            parts.FeedbackMessage, f"{name}/_action/feedback", self._hear_feedback, qos.COMMANDS
        )

    async def send(self, goal: UUID, command: Any, timeout_s: float) -> bool:
        """Whether the goal was accepted. One that is known already is not, too.

        Raises:
            RosTimeoutError: no answer in time; it may have arrived all the same.
        """
        request = ExecuteBehavior.Impl.SendGoalService.Request(
            goal_id=_message(goal), goal=ExecuteBehavior.Goal(command=command)
        )
        return bool((await self._ros.call(self._send, request, timeout_s)).accepted)

    async def result(self, goal: UUID, timeout_s: float) -> tuple[int, Any]:
        """The number of its GoalStatus, and the status of the behavior. It is answered when the
        goal has ended, or at once with STATUS_UNKNOWN.

        Raises:
            RosTimeoutError: no answer in time: it goes on, or nobody is there.
        """
        request = ExecuteBehavior.Impl.GetResultService.Request(goal_id=_message(goal))
        response = await self._ros.call(self._result, request, timeout_s)
        return response.status, response.result.status

    async def cancel(self, goal: UUID, timeout_s: float) -> int:
        """The return code of CancelGoal.

        Raises:
            RosTimeoutError: no answer in time.
        """
        request = action_services.CancelGoal.Request()
        request.goal_info.goal_id = _message(goal)
        response = await self._ros.call(self._cancel, request, timeout_s)
        return int(response.return_code)

    def _hear_statuses(self, message: Any) -> None:
        for status in message.status_list:
            self._listeners.status(_uuid(status.goal_info.goal_id), status.status)

    def _hear_feedback(self, message: Any) -> None:
        self._listeners.feedback(_uuid(message.goal_id), message.feedback.status)


def _message(goal: UUID) -> Any:
    return unique_identifier.UUID(uuid=list(goal.bytes))


def _uuid(message: Any) -> UUID:
    return UUID(bytes=bytes(message.uuid))
