"""The tasks `goto` and `follow`."""

import asyncio
import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from m2pem.api import BEHIND_RAD, OFFSET_M, BehaviorState, ResolvedValue
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient
from m2pem_plugin_ros.drivers.nav2.parameters import apart_m, towards_rad
from m2pem_plugin_ros.drivers.nav2.tasks.task import (
    Nav2GoalTask,
    TaskContext,
    expect_there,
    stamped,
)
from m2pem_plugin_ros.pose import Pose

MOVED_M = 1.0
"""When the target has moved by this distance, a new goal is sent, for which Nav2 plans again."""

AGAIN_S = 1.0
ANOTHER_EXPECTED = "parameter 'target': another vehicle is expected"


class Pursuit(Nav2GoalTask):
    """A NavigateToPose goal that is sent again as its target moves."""

    def __init__(self, context: TaskContext) -> None:
        super().__init__(context)
        self._sent: Pose | None = None
        self._changed = False

    @property
    def client(self) -> GoalClient:
        """The action preempts its own goals without a stop of the vehicle."""
        return self.nav2.to_pose

    @abstractmethod
    def aim(self) -> Pose:
        """Return the target pose.

        Raises:
            NavigationError: the position of the target is no longer known.
        """

    @abstractmethod
    def arrived(self) -> bool:
        """Return whether the task is done after Nav2 has reached the goal.

        Raises:
            NavigationError: the target was not reached.
        """

    def refusal(self) -> str:
        """Return why the target is not known; "" if it is."""
        if self.parameters.target_vehicle == self.context.setup.connection.resource:
            return ANOTHER_EXPECTED
        try:
            self.aim()
        except NavigationError as error:
            return f"parameter 'target': {error}"
        return super().refusal()

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        super().adjust(parameters)
        self._changed = self._changed or bool(parameters.keys() - {"speed"})

    async def run(self) -> None:
        """Send the goal, and send it again as the target moves."""
        self._sent = None if self._found is None else self.aim()
        way = self._set_out()
        try:
            while True:
                await self._pause(way)
                if way.done():
                    way.result()
                    if not self._moved() and self.arrived():
                        return
                    self.nav2.expect_no_other_client()
                if self._moved():
                    self.nav2.expect_no_other_client()
                    # Send the new goal only now: it must not arrive after the end of the old one.
                    before, way = way, self._set_out()
                    before.cancel()
        finally:
            if not way.cancel() and not way.cancelled():
                way.exception()  # the end was processed, or another event came first

    def _set_out(self) -> "asyncio.Task[Any]":
        if self._found is None:
            self._sent = self.aim()
        self._changed = False
        goal = self.client.action.Goal(pose=stamped(self._sent or self.aim()))
        return asyncio.get_running_loop().create_task(self.drive(goal))

    async def _pause(self, way: "asyncio.Task[Any]") -> None:
        """Wait until the goal has ended, or until the target is checked again."""
        nap = asyncio.get_running_loop().create_task(self.clock.sleep(AGAIN_S))
        try:
            await asyncio.wait([nap] if way.done() else [way, nap], return_when="FIRST_COMPLETED")
        finally:
            nap.cancel()

    def _moved(self) -> bool:
        if self._changed or self._sent is None:
            return True
        return apart_m(self.aim(), self._sent) > MOVED_M

    def _from_here(self, to: Pose) -> float:
        """Return the yaw from the vehicle to a pose."""
        here = self.context.setup.localization.pose
        return 0.0 if here is None else towards_rad(here, to)


class Goto(Pursuit):
    """Go to a position, or to the current position of another vehicle."""

    def aim(self) -> Pose:
        """Return the target, with the requested heading or else the direction of travel."""
        place, yaw = self.parameters.target_pose(), self.parameters.yaw_rad
        return replace(place, yaw_rad=self._from_here(place) if yaw is None else yaw)

    def arrived(self) -> bool:
        """Return whether the vehicle is within a requested tolerance."""
        expect_there(self._away_m(), self.parameters.tolerance_m)
        return True

    def after_success(self, result: Any) -> Outcome:
        """Return SUCCEEDED, unless the target vehicle has moved on."""
        del result
        if self.parameters.target_vehicle is not None and self._away_m() > MOVED_M:
            return Outcome(BehaviorState.UNKNOWN, reason="its target has moved on")
        return Outcome(BehaviorState.SUCCEEDED)

    def _away_m(self) -> float:
        here = self.context.setup.localization.pose
        return math.inf if here is None else apart_m(here, self.parameters.target_pose())


class Follow(Pursuit):
    """Keep a position at another vehicle: `offset` metres from it, at `bearing` from its
    heading."""

    def refusal(self) -> str:
        """Return why the target is not another vehicle with a recent position."""
        return ANOTHER_EXPECTED if self.parameters.target_vehicle is None else super().refusal()

    def aim(self) -> Pose:
        """Return the position relative to the target, with the target's heading."""
        at = self.parameters.target_pose()
        offset_m, bearing_rad = self.parameters.offset_m, self.parameters.bearing_rad
        offset_m = OFFSET_M if offset_m is None else offset_m
        bearing_rad = BEHIND_RAD if bearing_rad is None else bearing_rad
        yaw_rad = at.yaw_rad - bearing_rad
        east_m = at.east_m + offset_m * math.cos(yaw_rad)
        north_m = at.north_m + offset_m * math.sin(yaw_rad)
        return replace(at, east_m=east_m, north_m=north_m)

    def arrived(self) -> bool:
        """Return False: the task goes on until it is cancelled."""
        return False

    def after_success(self, result: Any) -> Outcome:
        """Return RUNNING: the vehicle stands at its position, and continues to follow."""
        del result
        return Outcome(BehaviorState.RUNNING)
