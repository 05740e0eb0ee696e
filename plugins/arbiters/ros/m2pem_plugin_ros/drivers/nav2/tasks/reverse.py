"""The task `reverse`."""

import math
from typing import Any

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point

from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient
from m2pem_plugin_ros.drivers.nav2.tasks.task import Nav2GoalTask, TaskContext

SPEED_M_S = 0.5
NOTHING_M = 0.01
ALLOWED = 3.0
ALLOWED_MORE_S = 10.0
"""Nav2 gives up after three times the expected time, and these seconds more."""


class Reverse(Nav2GoalTask):
    """A BackUp goal over the rest of the distance."""

    def __init__(self, context: TaskContext) -> None:
        super().__init__(context)
        distance_m = self.parameters.distance_m
        self._left_m = self._goal_m = distance_m

    @property
    def client(self) -> GoalClient:
        return self.nav2.back_up

    async def run(self) -> None:
        if self._left_m <= NOTHING_M:
            self.context.begun()
            return
        self._goal_m = self._left_m
        await self.drive(self._goal())

    def on_feedback(self, feedback: Any) -> None:
        """Store the distance driven."""
        driven_m = float(feedback.distance_traveled)
        if math.isfinite(driven_m):
            self._left_m = min(self._left_m, max(0.0, self._goal_m - driven_m))

    def _goal(self) -> Any:
        fastest_m_s = self.context.setup.settings.bounds.reverse_m_s
        speed_m_s = min(self.parameters.speed_m_s or SPEED_M_S, fastest_m_s)
        allowed_s = ALLOWED * self._left_m / speed_m_s + ALLOWED_MORE_S
        return self.client.action.Goal(
            target=Point(x=self._left_m),
            speed=speed_m_s,
            time_allowance=Duration(sec=math.ceil(allowed_s)),
        )
