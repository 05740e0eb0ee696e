"""A simulated Nav2 as its clients see it: bt_navigator, the waypoint follower, the behavior
server."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from itertools import pairwise
from typing import Any
from uuid import uuid4

from action_msgs.msg import GoalStatus
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rclpy.action import ActionClient

from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.drivers.nav2.parameters import apart_m
from m2pem_plugin_ros.frames import Origin, yaw_of_quaternion
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.sensors.localization import Localization
from m2pem_plugin_ros.simulator.faults import Nav2Faults
from m2pem_plugin_ros.simulator.nav2.goals import AbortedError, BaseOrders, GoalServer, MakeDriver

FEEDBACK_S = 0.1
PASSED_M = 1.5
ANSWER_S = 3.0

TO_POSE_CODES = {"": 100, "ROUTE_BLOCKED": 208, "TIMEOUT": 107}
THROUGH_POSES_CODES = {"": 100, "ROUTE_BLOCKED": 308, "TIMEOUT": 107}
BACK_UP_CODES = {"": 710, "ROUTE_BLOCKED": 714, "TIMEOUT": 711}

STATES = {
    "unconfigured": State.PRIMARY_STATE_UNCONFIGURED,
    "inactive": State.PRIMARY_STATE_INACTIVE,
    "active": State.PRIMARY_STATE_ACTIVE,
    "finalized": State.PRIMARY_STATE_FINALIZED,
}


class Nav2Server:
    """A simulated Nav2 in the namespace of a vehicle. `make_driver(events)` makes the driver of the
    base. `localization` is that of the base; `origin` that of the frame `map`.

    As in Nav2, a goal preempts another goal of the same action, and a goal of the other navigation
    action is aborted meanwhile. `faults` may be changed at any time.
    """

    def __init__(
        self,
        ros: RosRuntime,
        namespace: str,
        make_driver: MakeDriver,
        localization: Localization,
        origin: Origin,
    ) -> None:
        self.faults = Nav2Faults()
        self.state = "active"
        self._ros = ros
        self._namespace = namespace.rstrip("/")
        self._make_driver = make_driver
        self._localization = localization
        self._origin = origin
        self._orders: BaseOrders | None = None
        self._servers: list[GoalServer] = []
        self._inner: Any = None

    async def open(self) -> None:
        """Start the servers.

        Raises:
            RosError: nav2_msgs is not installed.
        """
        messages = require_interfaces("nav2_msgs")
        actions = messages.action
        vehicle = self._namespace.rpartition("/")[2] or "vehicle"
        self._orders = BaseOrders(self._make_driver, vehicle, self._origin)
        await self._orders.driver.open()
        self._serve(actions.NavigateToPose, "navigate_to_pose", self._to_pose)
        self._serve(actions.NavigateThroughPoses, "navigate_through_poses", self._through_poses)
        self._serve(actions.FollowWaypoints, "follow_waypoints", self._follow_waypoints)
        self._serve(actions.BackUp, "backup", self._back_up)
        self._inner = ActionClient(
            self._ros.node, actions.NavigateToPose, f"{self._namespace}/navigate_to_pose"
        )
        self._ros.serve(GetState, f"{self._namespace}/bt_navigator/get_state", self._get_state)
        self._ros.subscribe(
            messages.msg.SpeedLimit,
            f"{self._namespace}/speed_limit",
            self._limit_speed,
            qos.COMMANDS,
        )

    def enter(self, state: str) -> None:
        """Change the lifecycle state: "active", "inactive", "unconfigured" or "finalized". Only an
        active Nav2 has goals."""
        self.state = state
        if state != "active":
            for server in self._servers:
                server.drop()

    async def close(self) -> None:
        """Stop the vehicle, and close."""
        self.enter("finalized")
        if self._orders is not None:
            self._orders.driver.hold()
            await self._orders.driver.close()

    # --- actions --------------------------------------------------------------------------------

    async def _to_pose(self, handle: Any) -> Any:
        self._have_to_itself("navigate_to_pose")
        pose = _pose(handle.request.pose)
        await self._while(
            self._base.go_to(pose, TO_POSE_CODES),
            lambda: self._tell(handle, "navigate_to_pose", [pose]),
        )
        return self._action("navigate_to_pose").Result()

    async def _through_poses(self, handle: Any) -> Any:
        self._have_to_itself("navigate_through_poses")
        poses = [_pose(pose) for pose in handle.request.poses]
        if not poses:
            raise AbortedError(309, "there are no poses")
        left = list(poses)

        def tell() -> None:
            here = self._localization.pose
            while len(left) > 1 and here is not None and apart_m(here, left[0]) <= PASSED_M:
                del left[0]
            self._tell(handle, "navigate_through_poses", left)

        await self._while(self._base.go_along(poses, THROUGH_POSES_CODES), tell)
        return self._action("navigate_through_poses").Result()

    async def _follow_waypoints(self, handle: Any) -> Any:
        action = self._action("follow_waypoints")
        missed = []
        request = handle.request
        if not request.poses:
            raise AbortedError(600, "there are no poses")
        first = request.goal_index
        for _ in range(request.number_of_loops + 1):
            for index in range(first, len(request.poses)):
                handle.publish_feedback(action.Feedback(current_waypoint=index))
                pose = request.poses[index]
                if index in self.faults.miss or not await self._go_to_waypoint(pose):
                    missed.append(self._missed(index, pose))
            first = 0
        return action.Result(missed_waypoints=missed)

    async def _go_to_waypoint(self, pose: Any) -> bool:
        """Send a goal to the navigator, as Nav2's waypoint follower does."""
        goal = self._action("navigate_to_pose").Goal(pose=pose)
        handle = await self._ros.send_goal(self._inner, goal, ANSWER_S, goal_id=uuid4())
        if not handle.accepted:
            return False
        try:
            answer = await self._ros.wait(handle.get_result_async())
        except asyncio.CancelledError:
            handle.cancel_goal_async()
            raise
        return bool(answer.status == GoalStatus.STATUS_SUCCEEDED)

    async def _back_up(self, handle: Any) -> Any:
        target, speed_m_s = handle.request.target, handle.request.speed
        action = self._action("backup")
        if target.y or target.z:
            raise AbortedError(713, "it backs up straight")
        start = self._localization.pose

        def tell() -> None:
            here = self._localization.pose
            driven_m = apart_m(start, here) if start is not None and here is not None else 0.0
            handle.publish_feedback(action.Feedback(distance_traveled=driven_m))

        await self._while(self._base.back_up(abs(target.x), abs(speed_m_s), BACK_UP_CODES), tell)
        return action.Result()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _base(self) -> BaseOrders:
        assert self._orders is not None, "it is open"
        return self._orders

    def _serve(self, action: Any, name: str, carry_out: Callable[[Any], Awaitable[Any]]) -> None:
        full = f"{self._namespace}/{name}"
        self._servers.append(
            GoalServer(
                self._ros, action, full, carry_out, lambda: self.state == "active", self.faults
            )
        )

    def _action(self, name: str) -> Any:
        full = f"{self._namespace}/{name}"
        return next(server.action for server in self._servers if server.name == full)

    def _have_to_itself(self, name: str) -> None:
        """Abort a goal while the other navigation action is busy, as bt_navigator does."""
        navigators = ("navigate_to_pose", "navigate_through_poses")
        for server in self._servers:
            leaf = server.name.rpartition("/")[2]
            if leaf in navigators and leaf != name and server.busy:
                raise AbortedError

    async def _while(self, work: Awaitable[None], tell: Callable[[], None]) -> None:
        doing = asyncio.ensure_future(work)
        try:
            while not doing.done():
                tell()
                await asyncio.wait([doing], timeout=FEEDBACK_S)
            doing.result()
        finally:
            await cancel_and_wait(doing)

    def _tell(self, handle: Any, name: str, left: Sequence[Pose]) -> None:
        feedback = self._action(name).Feedback()
        here = self._localization.pose
        if here is not None:
            place = feedback.current_pose.pose.position
            feedback.current_pose.header.frame_id = "map"
            place.x, place.y = here.east_m, here.north_m
            feedback.distance_remaining = apart_m(here, left[0]) + sum(
                apart_m(a, b) for a, b in pairwise(left)
            )
        if hasattr(feedback, "number_of_poses_remaining"):
            feedback.number_of_poses_remaining = len(left)
        handle.publish_feedback(feedback)

    def _missed(self, index: int, pose: Any) -> Any:
        messages = require_interfaces("nav2_msgs").msg
        return messages.MissedWaypoint(index=index, goal=pose, error_code=208)

    async def _get_state(self, _: Any, response: Any) -> Any:
        response.current_state.id = STATES[self.state]
        response.current_state.label = self.state
        return response

    def _limit_speed(self, message: Any) -> None:
        if not message.percentage and message.speed_limit >= 0:
            self._base.limit_speed(message.speed_limit)


def _pose(message: Any) -> Pose:
    place = message.pose.position
    try:
        yaw_rad = yaw_of_quaternion(message.pose.orientation)
    except ValueError as error:
        raise AbortedError(202, str(error)) from error
    return Pose(place.x, place.y, yaw_rad)
