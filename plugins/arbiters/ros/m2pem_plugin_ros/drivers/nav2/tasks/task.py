"""What Nav2 is told for one order."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar
from uuid import UUID

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped

from m2pem.api import BehaviorState, ResolvedValue
from m2pem_plugin_ros.drivers.driver import Order, Outcome, Seat
from m2pem_plugin_ros.drivers.nav2.client import Nav2
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.drivers.nav2.goal_client import ACTIVE, Ended, GoalClient, number_of, numbered
from m2pem_plugin_ros.drivers.nav2.parameters import LocalParameters
from m2pem_plugin_ros.frames import quaternion_of_yaw
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import RosTimeoutError

FOUND_WITHIN_S = 1.0
"""Real seconds in which Nav2 says what it knows of a goal. It does not of one that goes on."""


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be done, and with what. `begun` is called when the vehicle does it."""

    seat: Seat
    nav2: Nav2
    order: Order
    begun: Callable[[], None]


class Errand(ABC):
    """One order. The driver asks for a `refusal`, then has it `run`, again after each hold. What
    it has done by then it remembers. After a restart, `look` comes first.

    `needs_nav2`: it cannot be done without.
    """

    needs_nav2: ClassVar[bool] = True

    def __init__(self, job: Job) -> None:
        self.job = job
        self.nav2 = job.nav2
        self.clock = job.seat.context.clock
        self.parameters = LocalParameters(job.order.request.parameters, job.seat.context)

    def refusal(self) -> str:
        """Why it cannot be done; "" if it can."""
        return ""

    @abstractmethod
    async def run(self) -> None:
        """Do it, or what is left of it; returns when it is done.

        Raises:
            NavigationError: it cannot be done, or not any more.
            RosError: Nav2 does not answer.
        """

    def held(self) -> None:  # noqa: B027  # most run as if nothing had been
        """It is being interrupted; `run` comes once more."""

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        """Go on with these."""
        self.parameters.update(parameters)

    @abstractmethod
    async def look(self) -> Outcome:
        """How the vehicle stands to it after a restart; if RUNNING, `run` goes on with it."""


class GoalErrand(Errand):
    """An order that goals of one action carry out, one after the other."""

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._goals = 0
        self._found: UUID | None = None
        self._current: UUID | None = None

    @property
    @abstractmethod
    def client(self) -> GoalClient:
        """The action."""

    def refusal(self) -> str:
        """The action must be there."""
        if self.client.there:
            return ""
        return f"Nav2 has no action {self.client.name}"

    async def drive(self, goal: Any) -> Any:
        """Have the next goal carried out; returns its result when it succeeded. After a restart,
        the first one is that which was found on the vehicle.

        Raises:
            NavigationError, RosError: it did not succeed.
        """
        self.client.feedback = self._hear
        if self._found is not None:
            self._current, self._found = self._found, None
            self.job.begun()
            return await self.nav2.finish(self.client, self._current)
        self.nav2.limit_speed(self.parameters.speed_m_s)
        self._current = numbered(self.job.order.goal, self._goals)
        self._goals += 1
        return await self.nav2.drive(self.client, self._current, goal, self.job.begun)

    def held(self) -> None:
        """What was found on the vehicle is cancelled, too."""
        self._found = None

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        """Of most, the speed alone can change on the way."""
        super().adjust(parameters)
        if "speed" in parameters:
            self.nav2.limit_speed(self.parameters.speed_m_s)

    def fed_back(self, feedback: Any) -> None:
        """What Nav2 says of the last goal while it carries it out."""

    def after_success(self, result: Any) -> Outcome:
        """What it means that the goal was reached while nobody looked."""
        del result
        return Outcome(BehaviorState.SUCCEEDED)

    async def look(self) -> Outcome:
        """By the goal of this order that Nav2 had last."""
        first = numbered(self.job.order.goal, 0)
        try:
            ended = {0: await self.client.result(first, FOUND_WITHIN_S)}
        except RosTimeoutError:  # it goes on, or nobody is there
            ended = {}
        goals = {
            number: status
            for goal, status in self.client.statuses.items()
            if (number := number_of(self.job.order.goal, goal)) is not None
        }
        going_on = [number for number, status in goals.items() if status in ACTIVE]
        if going_on:
            self._goals = max(goals) + 1
            self._found = numbered(self.job.order.goal, max(going_on))
            return Outcome(BehaviorState.RUNNING)
        known = goals.keys() | {n for n, e in ended.items() if e.status}
        if not known:
            why = self.nav2.trouble or "Nav2 knows nothing of it"
            return Outcome(BehaviorState.UNKNOWN, reason=why)
        self._goals = max(known) + 1
        last = max(known)
        if last not in ended:
            last_id = numbered(self.job.order.goal, last)
            ended[last] = await self.client.result(last_id, FOUND_WITHIN_S)
        return await self._outcome(ended[last])

    async def _outcome(self, ended: Ended) -> Outcome:
        if ended.status == GoalStatus.STATUS_SUCCEEDED:
            return self.after_success(ended.result)
        if ended.status == GoalStatus.STATUS_ABORTED:
            error = await self.nav2.why_aborted(self.client, ended.result)
            return Outcome(error.state, error.code, error.reason)
        # It was held, or somebody has interfered: that cannot be told apart.
        return Outcome(BehaviorState.UNKNOWN, reason="its goal was cancelled at Nav2")

    def _hear(self, goal: UUID, feedback: Any) -> None:
        if goal == self._current:
            self.fed_back(feedback)


def expect_there(away_m: float, tolerance_m: float | None) -> None:
    """Nav2 has a tolerance of its own, and takes none.

    Raises:
        NavigationError: the vehicle is farther away than was asked for.
    """
    if tolerance_m is not None and away_m > tolerance_m:
        raise NavigationError(
            f"it stands {away_m:.1f} m from its target, and tolerance is {tolerance_m:g} m: Nav2 "
            "takes that for there"
        )


MAP = "map"


def stamped(pose: Pose) -> Any:
    """A geometry_msgs/PoseStamped. Its stamp is 0, "whenever": clocks need not agree."""
    message = PoseStamped()
    message.header.frame_id = MAP
    message.pose.position.x = pose.east_m
    message.pose.position.y = pose.north_m
    turned = quaternion_of_yaw(pose.yaw_rad)
    message.pose.orientation.z = turned.z
    message.pose.orientation.w = turned.w
    return message
