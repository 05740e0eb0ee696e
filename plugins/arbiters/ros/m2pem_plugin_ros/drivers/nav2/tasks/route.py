"""Driving along a route, once or for ever."""

from typing import Any

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import missed
from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient
from m2pem_plugin_ros.drivers.nav2.parameters import SAME_PLACE_M, along, apart_m
from m2pem_plugin_ros.drivers.nav2.tasks.task import GoalErrand, Job, stamped
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import RouteAction

PASSED_M = 0.7
"""Nearer than this, bt_navigator takes a pose for passed; it looks seldom, so we look, too."""


class Route(GoalErrand):
    """NavigateThroughPoses, or FollowWaypoints if the fleet says so. What is not driven yet is
    known from feedback, so that after a hold the vehicle does not go back.

    A lap of a route that is repeated leads from its first place to its first place; each lap is a
    goal of its own, and only the first begins with the way to the first place.
    """

    def __init__(self, job: Job) -> None:
        self._follows = job.seat.settings.route_action is RouteAction.WAYPOINTS
        super().__init__(job)
        self._loops = self.parameters.loop
        self._lap = self.parameters.route_poses()
        if self._loops:
            self._lap = along([*self._lap, self._lap[0]])
        self._next = 0

    @property
    def client(self) -> GoalClient:
        """As the fleet says."""
        return self.nav2.waypoints if self._follows else self.nav2.through_poses

    def refusal(self) -> str:
        """What is repeated must be more than one place."""
        if self._loops and all(apart_m(p, self._lap[0]) <= SAME_PLACE_M for p in self._lap):
            return "parameter 'loop': a route of one place cannot be repeated"
        return super().refusal()

    async def run(self) -> None:
        """Lap after lap, or once."""
        while True:
            result = await self.drive(self._goal())
            if waypoints := getattr(result, "missed_waypoints", ()):
                raise missed(waypoints)
            if not self._loops:
                return
            self._next = 1

    def fed_back(self, feedback: Any) -> None:
        """Where the vehicle is on the way."""
        if self._follows:
            self._pass(int(feedback.current_waypoint))
            return
        remaining = int(feedback.number_of_poses_remaining)
        if remaining > 0:  # it is 0 before the first plan
            self._pass(len(self._lap) - remaining)
        at = feedback.current_pose.pose.position
        if apart_m(Pose(at.x, at.y, 0.0), self._lap[self._next]) <= PASSED_M:
            self._pass(self._next + 1)

    def after_success(self, result: Any) -> Outcome:
        """A lap that has ended while nobody looked has left the vehicle standing."""
        if waypoints := getattr(result, "missed_waypoints", ()):
            error = missed(waypoints)
            return Outcome(error.state, error.code, error.reason)
        if self._loops:
            return Outcome(BehaviorState.UNKNOWN, reason="it stands at the end of a lap")
        return Outcome(BehaviorState.SUCCEEDED)

    def _pass(self, index: int) -> None:
        """Never back; and the last place remains, until Nav2 says that it was reached."""
        self._next = max(self._next, min(index, len(self._lap) - 1))

    def _goal(self) -> Any:
        if self._follows:
            # All poses, so that the numbers of the feedback remain those of the lap.
            poses = [stamped(pose) for pose in self._lap]
            return self.client.action.Goal(poses=poses, goal_index=self._next)
        poses = [stamped(pose) for pose in self._lap[self._next :]]
        return self.client.action.Goal(poses=poses)
