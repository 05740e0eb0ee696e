"""The task `single_vehicle_routing`."""

from typing import Any

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import missed
from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient
from m2pem_plugin_ros.drivers.nav2.parameters import SAME_PLACE_M, along, apart_m
from m2pem_plugin_ros.drivers.nav2.tasks.task import Nav2GoalTask, TaskContext, stamped
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import RouteAction

PASSED_M = 0.7
"""bt_navigator removes passed poses at this distance, but checks seldom; so it is checked here,
too."""


class Route(Nav2GoalTask):
    """A NavigateThroughPoses goal, or FollowWaypoints if the fleet says so. Feedback reports the
    remaining poses, so that the vehicle does not drive back after a hold.

    With `loop`, each lap is a goal from the first waypoint to the first waypoint. Only the first
    lap begins with the way to the first waypoint.
    """

    def __init__(self, context: TaskContext) -> None:
        self._follows = context.setup.settings.route_action is RouteAction.WAYPOINTS
        super().__init__(context)
        self._loops = self.parameters.loop
        self._lap = self.parameters.route_poses()
        if self._loops:
            self._lap = along([*self._lap, self._lap[0]])
        self._next = 0

    @property
    def client(self) -> GoalClient:
        return self.nav2.waypoints if self._follows else self.nav2.through_poses

    def refusal(self) -> str:
        """Return why the route cannot be repeated; "" if it can."""
        if self._loops and all(apart_m(p, self._lap[0]) <= SAME_PLACE_M for p in self._lap):
            return "parameter 'loop': a route of one place cannot be repeated"
        return super().refusal()

    async def run(self) -> None:
        """Send a goal for each lap, or for the route."""
        while True:
            result = await self.drive(self._goal())
            if waypoints := getattr(result, "missed_waypoints", ()):
                raise missed(waypoints)
            if not self._loops:
                return
            self._next = 1

    def on_feedback(self, feedback: Any) -> None:
        """Advance along the lap, by the feedback of the action."""
        if self._follows:
            self._pass(int(feedback.current_waypoint))
            return
        remaining = int(feedback.number_of_poses_remaining)
        if remaining > 0:  # the distance is 0 before the first plan
            self._pass(len(self._lap) - remaining)
        at = feedback.current_pose.pose.position
        if apart_m(Pose(at.x, at.y, 0.0), self._lap[self._next]) <= PASSED_M:
            self._pass(self._next + 1)

    def after_success(self, result: Any) -> Outcome:
        """Return RUNNING for a lap that ended while this process did not run: the vehicle
        stands."""
        if waypoints := getattr(result, "missed_waypoints", ()):
            return missed(waypoints).outcome
        if self._loops:
            return Outcome(BehaviorState.UNKNOWN, reason="it is at rest at the end of a lap")
        return Outcome(BehaviorState.SUCCEEDED)

    def _pass(self, index: int) -> None:
        """Advance to a waypoint, never back. The last one is left to Nav2."""
        self._next = max(self._next, min(index, len(self._lap) - 1))

    def _goal(self) -> Any:
        if self._follows:
            # All poses, so that the numbers of the feedback remain those of the lap.
            poses = [stamped(pose) for pose in self._lap]
            return self.client.action.Goal(poses=poses, goal_index=self._next)
        poses = [stamped(pose) for pose in self._lap[self._next :]]
        return self.client.action.Goal(poses=poses)
