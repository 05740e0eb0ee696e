"""A client of one Nav2 action: sends, observes and cancels goals, also those of other clients."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.drivers.goal_services import ACTIVE, GoalServices, uuid_of
from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError, qos

ANSWER_S = 3.0
"""Timeout of `send`, in real seconds."""

CANCEL_S = 2.0
"""Timeout of a cancel, and then of the end of the goal, in real seconds."""

FOREVER_S = 1e9
"""A result is awaited as long as the vehicle drives."""


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended: a status of action_msgs/GoalStatus (UNKNOWN: the server does not know the
    goal), and the result of the action."""

    status: int
    result: Any


class GoalClient:
    """`name` is the full name of the action. `on_activity` is called with each message. `feedback`
    is called with the goal and the feedback of any goal."""

    def __init__(
        self, ros: RosRuntime, action: Any, name: str, on_activity: Callable[[], None]
    ) -> None:
        self.name = name
        self.action = action
        self.feedback: Callable[[UUID, Any], None] = lambda _, __: None
        self._ros = ros
        self._on_activity = on_activity
        self._sending: dict[UUID, asyncio.Task[bool]] = {}
        self.statuses: dict[UUID, int] = {}
        """The last status of all goals, of any client."""
        self._open: set[UUID] = set()
        self._writers: frozenset[bytes] = frozenset()
        self._renewed = asyncio.Event()
        self._services = GoalServices(
            ros, action, name, self._on_statuses, self._on_feedback, qos.EVENTS
        )

    # --- what is known --------------------------------------------------------------------------

    @property
    def there(self) -> bool:
        """Whether a server of the action is discovered."""
        return self._services.there

    @property
    def active(self) -> set[UUID]:
        """Goals that go on, or may go on."""
        reported = {goal for goal, status in self.statuses.items() if status in ACTIVE}
        return reported | self._open

    @property
    def busy(self) -> bool:
        """Whether a goal goes on, or is being sent."""
        return bool(self._sending or self.active)

    def refresh_server(self) -> None:
        """Detect another server than before. It does not know the goals of the old one."""
        endpoints = self._ros.node.get_publishers_info_by_topic(self._services.status_topic)
        writers = frozenset(bytes(endpoint.endpoint_gid) for endpoint in endpoints)
        if not writers:
            self.statuses = {}
        if writers - self._writers and self._writers:
            self.statuses = {}
            renewed, self._renewed = self._renewed, asyncio.Event()
            renewed.set()
        self._writers |= writers

    # --- orders ---------------------------------------------------------------------------------

    async def send(self, goal_id: UUID, goal: Any) -> bool:
        """Send a goal, and return whether it was accepted. The server preempts its current goal.

        If the caller is cancelled, the goal is sent all the same, and `cancel` cancels it.

        Raises:
            RosError: no answer came.
        """
        task = asyncio.get_running_loop().create_task(self._services.send(goal_id, goal, ANSWER_S))
        self._sending[goal_id] = task
        self._open.add(goal_id)
        task.add_done_callback(lambda done: self._sent(goal_id, done))
        return await asyncio.shield(task)

    async def result(self, goal_id: UUID, timeout_s: float | None = None) -> GoalResult:
        """Return how a goal ended, when it has. A restarted server is asked again.

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
        return GoalResult(int(answer.status), answer.result)

    async def cancel(self, goal_id: UUID | None = None) -> None:
        """Cancel a goal, or all goals of any client, and wait until they have ended.

        Raises:
            RosError: no answer came, or a goal does not end.
        """
        under_way = [task for id_, task in self._sending.items() if goal_id in (None, id_)]
        if under_way:
            await asyncio.wait(under_way)
        goals = self.active if goal_id is None else {goal_id} & self.active
        if goal_id is not None and not goals:
            return
        answer = await self._services.cancel(goal_id, CANCEL_S)
        stopping = {uuid_of(info.goal_id) for info in answer.goals_canceling}
        await asyncio.gather(*(self.result(goal, CANCEL_S) for goal in goals | stopping))

    # --- inside ---------------------------------------------------------------------------------

    def _sent(self, goal_id: UUID, task: asyncio.Task[bool]) -> None:
        self._sending.pop(goal_id, None)
        if task.cancelled() or task.exception() is not None:
            return  # whether it has an effect is not known
        self._on_activity()
        if not task.result():
            self._open.discard(goal_id)

    async def _ask_for_result(self, goal_id: UUID) -> Any:
        loop = asyncio.get_running_loop()
        while True:
            ask = loop.create_task(self._services.result(goal_id, FOREVER_S))
            renewed = loop.create_task(self._renewed.wait())
            try:
                await asyncio.wait([ask, renewed], return_when=asyncio.FIRST_COMPLETED)
                if ask.done():
                    return ask.result()
            finally:
                await cancel_and_wait(ask, renewed)

    def _on_statuses(self, statuses: dict[UUID, int]) -> None:
        self._on_activity()
        self.statuses = statuses
        self._open -= {goal for goal, status in statuses.items() if status not in ACTIVE}

    def _on_feedback(self, goal: UUID, feedback: Any) -> None:
        self._on_activity()
        self.feedback(goal, feedback)


_NUMBERS = (1 << 32) - 1


def numbered(order: UUID, number: int) -> UUID:
    """Return the id of a goal of an order. Goal 0 has the id of the order. Goal n differs only in
    the last four bytes, so that `number_of` recognizes it after a restart."""
    return UUID(int=order.int ^ (number & _NUMBERS))


def number_of(order: UUID, goal: UUID) -> int | None:
    """Return the number of a goal of the order; None if it is not one of them."""
    difference = order.int ^ goal.int
    return difference if difference <= _NUMBERS else None
