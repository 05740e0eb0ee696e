"""The services and topics of an action, for goals of any client.

The client of rclpy knows only the goals that it has sent, but goals of other processes matter after
a restart or a takeover.
"""

from collections.abc import Callable
from typing import Any
from uuid import UUID

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from unique_identifier_msgs import msg as unique_identifier

from m2pem_plugin_ros.runtime import RosRuntime, qos

ACTIVE = frozenset(
    {GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING}
)


class GoalServices:
    """`name` is the full name of the action. `on_statuses` is called with the GoalStatus of each
    goal, `on_feedback` with a goal and its feedback. A call without an answer in time raises
    RosTimeoutError; it may still have an effect."""

    def __init__(
        self,
        ros: RosRuntime,
        action: Any,
        name: str,
        on_statuses: Callable[[dict[UUID, int]], None],
        on_feedback: Callable[[UUID, Any], None],
        feedback_quality: Any,
    ) -> None:
        self.status_topic = f"{name}/_action/status"
        self._ros = ros
        self._on_statuses = on_statuses
        self._on_feedback = on_feedback
        self._impl = impl = action.Impl
        self._send = ros.client(impl.SendGoalService, f"{name}/_action/send_goal")
        self._result = ros.client(impl.GetResultService, f"{name}/_action/get_result")
        self._cancel = ros.client(CancelGoal, f"{name}/_action/cancel_goal")
        feedback = f"{name}/_action/feedback"
        ros.subscribe(impl.FeedbackMessage, feedback, self._receive_feedback, feedback_quality)
        ros.subscribe(impl.GoalStatusMessage, self.status_topic, self._receive_statuses, qos.STATUS)

    @property
    def there(self) -> bool:
        """Whether a server of the action is discovered."""
        return bool(self._send.service_is_ready())

    @property
    def missing(self) -> str:
        """The services that are not discovered; "" if all are."""
        services = (self._send, self._result, self._cancel)
        names = [str(each.srv_name) for each in services if not each.service_is_ready()]
        return f"the service {' and '.join(names)}" if names else ""

    async def send(self, goal: UUID, content: Any, timeout_s: float) -> bool:
        """Send a goal, and return whether it was accepted. A goal that the server has already is
        not accepted."""
        request = self._impl.SendGoalService.Request(goal_id=_message(goal), goal=content)
        return bool((await self._ros.call(self._send, request, timeout_s)).accepted)

    async def result(self, goal: UUID, timeout_s: float) -> Any:
        """Return the GoalStatus of a goal, and its result. The server answers when the goal has
        ended, or at once with STATUS_UNKNOWN."""
        request = self._impl.GetResultService.Request(goal_id=_message(goal))
        return await self._ros.call(self._result, request, timeout_s)

    async def cancel(self, goal: UUID | None, timeout_s: float) -> Any:
        """Cancel a goal, or all goals of any client; return the answer of CancelGoal."""
        request = CancelGoal.Request()
        if goal is not None:
            request.goal_info.goal_id = _message(goal)
        return await self._ros.call(self._cancel, request, timeout_s)

    def _receive_statuses(self, message: Any) -> None:
        goals = message.status_list
        self._on_statuses({uuid_of(goal.goal_info.goal_id): int(goal.status) for goal in goals})

    def _receive_feedback(self, message: Any) -> None:
        self._on_feedback(uuid_of(message.goal_id), message.feedback)


def uuid_of(message: Any) -> UUID:
    return UUID(bytes=bytes(message.uuid))


def _message(goal: UUID) -> Any:
    return unique_identifier.UUID(uuid=list(goal.bytes))
