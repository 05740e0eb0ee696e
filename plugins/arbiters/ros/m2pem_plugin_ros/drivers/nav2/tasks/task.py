"""The interface of tasks: how Nav2 executes one order."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar
from uuid import UUID

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped

from m2pem.api import BehaviorState, ResolvedValue
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.goal_services import ACTIVE
from m2pem_plugin_ros.drivers.nav2.client import Nav2
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.drivers.nav2.goal_client import (
    GoalClient,
    GoalResult,
    number_of,
    numbered,
)
from m2pem_plugin_ros.drivers.nav2.parameters import LocalParameters
from m2pem_plugin_ros.frames import quaternion_of_yaw
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import RosTimeoutError

CANCELLED_THERE = Outcome(
    BehaviorState.UNKNOWN, reason="its goal was cancelled at Nav2", known=True
)
"""A hold or another client has cancelled it: the status is the same."""

FOUND_WITHIN_S = 1.0
"""Timeout of the result query, in real seconds. Nav2 does not answer for a goal that goes on."""


@dataclass(frozen=True, slots=True)
class TaskContext:
    """The arguments of a task. `begun` is to be called when the vehicle executes the order."""

    setup: DriverSetup
    nav2: Nav2
    order: Order
    begun: Callable[[], None]


class Nav2Task(ABC):
    """One order. The driver calls `refusal`, then `run`, and `run` again after each hold. The task
    keeps its progress. After a restart, `query` is called first.

    `needs_nav2`: the task needs an active Nav2.
    """

    needs_nav2: ClassVar[bool] = True

    def __init__(self, context: TaskContext) -> None:
        self.context = context
        self.nav2 = context.nav2
        self.clock = context.setup.context.clock
        self.parameters = LocalParameters(context.order.request.parameters, context.setup.context)

    def refusal(self) -> str:
        """Return why the order cannot be done; "" if it can."""
        return ""

    @abstractmethod
    async def run(self) -> None:
        """Do the order, or the rest of it, and return when it is done.

        Raises:
            NavigationError: the order cannot be done, or cannot be continued.
            RosError: Nav2 does not answer.
        """

    def held(self) -> None:  # noqa: B027  # most run as if nothing had been
        """The vehicle is held. `run` is called again after it."""

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        """Change parameters."""
        self.parameters.update(parameters)

    @abstractmethod
    async def query(self) -> Outcome:
        """Return the state of the order after a restart. If it is RUNNING, `run` continues it."""


class Nav2GoalTask(Nav2Task):
    """An order that Nav2 executes by goals of one action, one after the other."""

    def __init__(self, context: TaskContext) -> None:
        super().__init__(context)
        self._goals = 0
        self._found: UUID | None = None
        self._current: UUID | None = None

    @property
    @abstractmethod
    def client(self) -> GoalClient: ...

    def refusal(self) -> str:
        if self.client.there:
            return ""
        return f"Nav2 has no action {self.client.name}"

    async def drive(self, goal: Any) -> Any:
        """Send the next goal, and return its result when it succeeded. After a restart, the first
        goal is the one that was found on the vehicle.

        Raises:
            NavigationError, RosError: the goal failed.
        """
        self.client.feedback = self._on_message
        if self._found is not None:
            self._current, self._found = self._found, None
            self.context.begun()
            return await self.nav2.finish(self.client, self._current)
        self.nav2.limit_speed(self.parameters.speed_m_s)
        # A goal of before a restart keeps its number, also if it was cancelled there.
        known = (number_of(self.context.order.goal, goal) for goal in self.client.statuses)
        self._goals = max([self._goals, *(each + 1 for each in known if each is not None)])
        self._current = numbered(self.context.order.goal, self._goals)
        self._goals += 1
        return await self.nav2.drive(self.client, self._current, goal, self.context.begun)

    def held(self) -> None:
        """Drop the goal that was found on the vehicle, as it is cancelled."""
        self._found = None

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        """Change parameters. The speed changes at once."""
        super().adjust(parameters)
        if "speed" in parameters:
            self.nav2.limit_speed(self.parameters.speed_m_s)

    def on_feedback(self, feedback: Any) -> None:
        """Process feedback of the current goal."""

    def after_success(self, result: Any) -> Outcome:
        """Return the outcome of a goal that succeeded while this process did not run."""
        del result
        return Outcome(BehaviorState.SUCCEEDED)

    async def query(self) -> Outcome:
        """Find the last goal of this order on the vehicle."""
        first = numbered(self.context.order.goal, 0)
        try:
            ended = {0: await self.client.result(first, FOUND_WITHIN_S)}
        except RosTimeoutError:  # the goal continues, or no server answers
            ended = {}
        goals = {
            number: status
            for goal, status in self.client.statuses.items()
            if (number := number_of(self.context.order.goal, goal)) is not None
        }
        going_on = [number for number, status in goals.items() if status in ACTIVE]
        if going_on:
            self._goals = max(goals) + 1
            self._found = numbered(self.context.order.goal, max(going_on))
            return Outcome(BehaviorState.RUNNING)
        known = goals.keys() | {n for n, e in ended.items() if e.status}
        if not known:
            why = self.nav2.problem or "Nav2 does not have the goal"
            return Outcome(BehaviorState.UNKNOWN, reason=why)
        self._goals = max(known) + 1
        last = max(known)
        if last not in ended:
            last_id = numbered(self.context.order.goal, last)
            ended[last] = await self.client.result(last_id, FOUND_WITHIN_S)
        return await self._outcome(ended[last])

    async def _outcome(self, ended: GoalResult) -> Outcome:
        if ended.status == GoalStatus.STATUS_SUCCEEDED:
            return self.after_success(ended.result)
        if ended.status == GoalStatus.STATUS_ABORTED:
            return (await self.nav2.why_aborted(self.client, ended.result)).outcome
        return CANCELLED_THERE

    def _on_message(self, goal: UUID, feedback: Any) -> None:
        if goal == self._current:
            self.on_feedback(feedback)


def expect_there(away_m: float, tolerance_m: float | None) -> None:
    """Check the distance to the target, as Nav2 takes no tolerance.

    Raises:
        NavigationError: the vehicle is farther away than the tolerance.
    """
    if tolerance_m is not None and away_m > tolerance_m:
        raise NavigationError(
            f"it has stopped {away_m:.1f} m from its target, and the tolerance is "
            f"{tolerance_m:g} m: Nav2 counts that as arrived"
        )


MAP = "map"


def stamped(pose: Pose) -> Any:
    """Make a geometry_msgs/PoseStamped in the frame `map`. Its stamp is 0, so that clocks need not
    agree."""
    message = PoseStamped()
    message.header.frame_id = MAP
    message.pose.position.x = pose.east_m
    message.pose.position.y = pose.north_m
    turned = quaternion_of_yaw(pose.yaw_rad)
    message.pose.orientation.z = turned.z
    message.pose.orientation.w = turned.w
    return message
