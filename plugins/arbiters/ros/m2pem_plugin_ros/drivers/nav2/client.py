"""A client of Nav2 on one vehicle: its lifecycle state, its activity, and goals for it."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from typing import Any
from uuid import UUID

from action_msgs.msg import GoalStatus
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.goal_services import ACTIVE
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError, aborted, taken_over
from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient, number_of
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError, qos

STATE_S = 1.0
"""Timeout of the state query to bt_navigator, in real seconds."""

UNANSWERED = 2
"""After this many unanswered queries, Nav2 counts as not there."""

OTHER_CLIENT_S = 0.5
"""After our goal was aborted, the goal of another client is awaited for this time, in real
seconds."""

LOOK_S = 0.05

MAY_SEND_EVERY_S = 0.05


class Nav2:
    """A client of the Nav2 in `namespace`. `on_activity` is called with each message of Nav2, after
    `has_answered`. No goal is sent while `may_send` is false.

    Raises:
        RosError: nav2_msgs is not installed.
    """

    def __init__(
        self,
        ros: RosRuntime,
        namespace: str,
        on_activity: Callable[[], None],
        logger: logging.Logger,
        may_send: Callable[[], bool] = lambda: True,
    ) -> None:
        self.messages = require_interfaces("nav2_msgs")
        self._ros = ros
        self._on_activity_reported = on_activity
        self._logger = logger
        self._may_send = may_send
        self._name = namespace.rstrip("/")
        self._last_activity_s = self._now_s()
        self._own_goals: set[UUID] = set()
        self._limit_m_s: float | None = None
        self.state = ""
        self._refreshes = 0
        actions = self.messages.action
        self.to_pose = self._client(actions.NavigateToPose, "navigate_to_pose")
        self.through_poses = self._client(actions.NavigateThroughPoses, "navigate_through_poses")
        self.waypoints = self._client(actions.FollowWaypoints, "follow_waypoints")
        self.back_up = self._client(actions.BackUp, "backup")
        self._get_state = ros.client(GetState, f"{self._name}/bt_navigator/get_state")
        self._speed_limit = ros.publisher(
            self.messages.msg.SpeedLimit, f"{self._name}/speed_limit", qos.COMMANDS
        )

    # --- state ---------------------------------------------------------------------------------

    @property
    def is_active(self) -> bool:
        """Whether Nav2 accepts goals."""
        return not self.problem

    @property
    def is_there(self) -> bool:
        """Whether an action of Nav2 is discovered, or may go on."""
        return any(client.there or client.active for client in self._clients())

    @property
    def has_answered(self) -> bool:
        """Whether Nav2 has answered, or had the time to. Answers may be lost during discovery."""
        return bool(self.state) or self._refreshes >= UNANSWERED

    def ask_again(self) -> None:
        """The vehicle is silent: when it is back, Nav2 has time to answer, as at first."""
        self._refreshes = 0
        self._last_activity_s = self._now_s()

    @property
    def problem(self) -> str:
        """Why Nav2 accepts no goals; "" if it does."""
        if not self.state:
            return "Nav2 does not answer"
        return "" if self.state == "active" else f"Nav2 is not active: {self.state}"

    @property
    def silent_s(self) -> float:
        """Real seconds since the last message, while the vehicle is received."""
        return self._now_s() - self._last_activity_s

    @property
    def doing(self) -> str:
        """The name of the action that is executed, or "idle"."""
        for client in self._clients():
            if client.active:
                return client.name.rpartition("/")[2]
        return "idle"

    async def refresh(self) -> None:
        """Query the lifecycle state, and detect a restart. Call it once a second.

        Raises:
            RosError: the connection was closed.
        """
        try:
            answer = await self._ros.call(self._get_state, GetState.Request(), STATE_S)
        except RosTimeoutError:
            self.state = ""
        else:
            state = answer.current_state
            active = state.id == State.PRIMARY_STATE_ACTIVE
            self.state = "active" if active else state.label or f"state {state.id}"
        self._refreshes += 1
        if self.state:
            self._on_activity()
        for client in self._clients():
            client.refresh_server()

    def other_client(self) -> str:
        """Return the action that Nav2 executes for another client; "" if there is none."""
        return self._other_client((self.waypoints, self.through_poses, self.to_pose))

    def expect_no_other_client(self) -> None:
        """Check that Nav2 executes no goal of another client.

        Raises:
            NavigationError: it does.
        """
        if other_client := self.other_client():
            raise taken_over(f"another client has given Nav2 a goal: {other_client}")

    def was_cancelled(self, order: UUID) -> bool:
        """Whether goals of an order were cancelled, and none of them goes on."""
        found = {
            status
            for client in self._clients()
            for goal, status in client.statuses.items()
            if number_of(order, goal) is not None
        }
        return GoalStatus.STATUS_CANCELED in found and found.isdisjoint(ACTIVE)

    def own_goals(self) -> set[UUID]:
        """Return the goals of this client that go on."""
        return {goal for client in self._clients() for goal in client.active & self._own_goals}

    # --- goals -----------------------------------------------------------------------------------

    async def drive(
        self, client: GoalClient, goal_id: UUID, goal: Any, begun: Callable[[], None]
    ) -> Any:
        """Send a goal in place of all others, and return its result when it succeeded.

        Raises:
            NavigationError: the goal failed.
            RosError: Nav2 does not answer.
        """
        while not self._may_send():  # noqa: ASYNC110  # the journal answers soon
            await asyncio.sleep(MAY_SEND_EVERY_S)
        await self._stop_others(client)
        self._own_goals = self._own_goals & client.active | {goal_id}
        try:
            accepted = await client.send(goal_id, goal)
        except RosTimeoutError as error:
            raise NavigationError(f"Nav2 does not answer: {error}") from error
        if not accepted:
            why = self.problem or "no reason given"
            rejected = BehaviorState.REJECTED
            raise NavigationError(f"Nav2 rejected the goal: {why}", "REJECTED", rejected)
        begun()
        return await self.finish(client, goal_id)

    async def finish(self, client: GoalClient, goal_id: UUID) -> Any:
        """Wait for the end of a goal that Nav2 has, and return its result when it succeeded.

        Raises:
            NavigationError: the goal failed.
        """
        self._own_goals.add(goal_id)
        ended = await client.result(goal_id)
        self._on_activity()
        if ended.status == GoalStatus.STATUS_SUCCEEDED:
            return ended.result
        if ended.status == GoalStatus.STATUS_CANCELED:
            raise taken_over("another client has cancelled its goal at Nav2")
        if ended.status == GoalStatus.STATUS_ABORTED:
            raise await self.why_aborted(client, ended.result)
        raise NavigationError("Nav2 no longer has the goal: it was restarted")

    async def why_aborted(self, client: GoalClient, result: Any) -> NavigationError:
        """Return why a goal of this client was aborted, by its result and by the goals of
        others."""
        if int(getattr(result, "error_code", 0)) == 0:
            # Nav2 reports nothing when a goal is preempted, or when Nav2 is deactivated.
            if other_client := await self._wait_for_other_client(client):
                return taken_over(f"another client has given Nav2 another goal: {other_client}")
            await self.refresh()
            if not self.is_active:
                return NavigationError(f"Nav2 aborted the goal: {self.problem}")
        return aborted(result)

    async def stop(self) -> None:
        """Cancel all goals, of any client, and wait until they have ended.

        Raises:
            RosError: it does not answer, or does not stop.
        """
        await self._all([client for client in self._clients() if client.there or client.active])

    async def stop_own_goals(self, which: Callable[[UUID], bool] = lambda _: True) -> None:
        """Cancel goals of this client, and leave the others.

        Raises:
            RosError: it does not answer, or does not stop.
        """
        for client in self._clients():
            for goal in filter(which, client.active & self._own_goals):
                await client.cancel(goal)

    def limit_speed(self, speed_m_s: float | None) -> None:
        """Set the highest speed; None removes the limit that was set before."""
        if speed_m_s is None and self._limit_m_s is None:
            return  # keep limits of other clients
        self._limit_m_s = speed_m_s
        if not self._speed_limit.get_subscription_count():
            self._logger.warning(
                "%s: no subscriber: Nav2 drives at its own speed", self._speed_limit.topic_name
            )
        self._speed_limit.publish(
            self.messages.msg.SpeedLimit(percentage=False, speed_limit=speed_m_s or 0.0)
        )

    # --- inside ---------------------------------------------------------------------------------

    def _client(self, action: Any, name: str) -> GoalClient:
        return GoalClient(self._ros, action, f"{self._name}/{name}", self._on_activity)

    def _clients(self) -> tuple[GoalClient, ...]:
        return self.waypoints, self.through_poses, self.to_pose, self.back_up

    async def _stop_others(self, client: GoalClient) -> None:
        """Cancel the goals of other actions. bt_navigator preempts only goals of the same
        action."""
        preempts = client in (self.to_pose, self.through_poses) and not self.waypoints.active
        others = [c for c in self._clients() if c.busy and not (preempts and c is client)]
        if preempts and client.active:
            others = [c for c in others if c is not self.back_up]  # it may be a goal of a recovery
        try:
            await self._all(others)
        except RosTimeoutError as error:
            raise NavigationError(f"Nav2 does not cancel its other goals: {error}") from error

    async def _all(self, clients: list[GoalClient]) -> None:
        """Cancel the waypoint follower first: the goals that it gives to the navigator end with
        it."""
        failed: list[BaseException] = []
        for some in (
            [client for client in clients if client is self.waypoints],
            [client for client in clients if client is not self.waypoints],
        ):
            ends = await asyncio.gather(*(c.cancel() for c in some), return_exceptions=True)
            failed += [end for end in ends if end is not None]
        if failed:
            raise failed[0]

    async def _wait_for_other_client(self, client: GoalClient) -> str:
        clients = (self.waypoints, self.through_poses, self.to_pose, client)
        deadline_s = self._now_s() + OTHER_CLIENT_S
        while not (other_client := self._other_client(clients)) and self._now_s() < deadline_s:  # noqa: ASYNC110
            await asyncio.sleep(LOOK_S)
        return other_client

    def _other_client(self, clients: Iterable[GoalClient]) -> str:
        """Return the action of another client. Goals that Nav2 gives to itself do not count: those
        of the waypoint follower to the navigator, and those of the navigator to the behavior
        server."""
        follows = self._own_goals & self.waypoints.active
        for client in clients:
            if not (follows and client is self.to_pose) and client.active - self._own_goals:
                return client.name
        return ""

    def _on_activity(self) -> None:
        self._last_activity_s = self._now_s()
        if self.has_answered:
            self._on_activity_reported()

    @staticmethod
    def _now_s() -> float:
        return asyncio.get_running_loop().time()
