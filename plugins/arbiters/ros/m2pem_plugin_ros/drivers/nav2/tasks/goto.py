"""Going to a place, and after a vehicle."""

import asyncio
import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from m2pem.api import BehaviorState, ResolvedValue
from m2pem_plugin_ros.catalogue import BEHIND_RAD, OFFSET_M
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError, taken_over
from m2pem_plugin_ros.drivers.nav2.goal_client import GoalClient
from m2pem_plugin_ros.drivers.nav2.parameters import apart_m, towards_rad
from m2pem_plugin_ros.drivers.nav2.tasks.task import GoalErrand, Job, expect_there, stamped
from m2pem_plugin_ros.pose import Pose

MOVED_M = 1.0
"""A target that has moved by so much is told to Nav2 again, which must plan each time."""

AGAIN_S = 1.0


class Pursuit(GoalErrand):
    """NavigateToPose, sent again as the place to go to moves."""

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._sent: Pose | None = None
        self._changed = False

    @property
    def client(self) -> GoalClient:
        """One goal takes the place of the other, and the vehicle need not stop for it."""
        return self.nav2.to_pose

    @abstractmethod
    def aim(self) -> Pose:
        """Where to go now.

        Raises:
            NavigationError: that is not known any more.
        """

    @abstractmethod
    def arrived(self) -> bool:
        """Whether it is done now that Nav2 says that the goal was reached.

        Raises:
            NavigationError: it was not reached.
        """

    def adjust(self, parameters: Mapping[str, ResolvedValue]) -> None:
        """Go elsewhere, or otherwise."""
        super().adjust(parameters)
        self._changed = self._changed or bool(parameters.keys() - {"speed"})

    async def run(self) -> None:
        """Send it to where it is to go, as often as that moves."""
        self._sent = None if self._found is None else self.aim()
        way = self._set_out()
        try:
            while True:
                await self._pause(way)
                if way.done():
                    way.result()
                    if not self._moved() and self.arrived():
                        return
                    if rival := self.nav2.rival():
                        raise taken_over(f"somebody else has given Nav2 a goal: {rival}")
                if self._moved():
                    if rival := self.nav2.rival():
                        raise taken_over(f"somebody else has given Nav2 another goal: {rival}")
                    # Only now: what takes the place of a goal must not come after its end.
                    before, way = way, self._set_out()
                    before.cancel()
        finally:
            if not way.cancel() and not way.cancelled():
                way.exception()  # it has been seen, or something else has come first

    def _set_out(self) -> "asyncio.Task[Any]":
        if self._found is None:
            self._sent = self.aim()
        self._changed = False
        goal = self.client.action.Goal(pose=stamped(self._sent or self.aim()))
        return asyncio.get_running_loop().create_task(self.drive(goal))

    async def _pause(self, way: "asyncio.Task[Any]") -> None:
        """Until the vehicle is there, and no longer than until the next look at the target."""
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
        """The yaw from where the vehicle is."""
        here = self.job.seat.localization.pose
        return 0.0 if here is None else towards_rad(here, to)


class Goto(Pursuit):
    """To a place, or to where another vehicle is, as long as it takes."""

    def refusal(self) -> str:
        """The target must be known."""
        if self.parameters.target_vehicle == self.job.seat.connection.resource:
            return "parameter 'target': another vehicle is expected"
        try:
            self.aim()
        except NavigationError as error:
            return f"parameter 'target': {error}"
        return super().refusal()

    def aim(self) -> Pose:
        """The target, and its bow as asked for; otherwise it arrives as it comes."""
        place, yaw = self.parameters.target_pose(), self.parameters.yaw_rad
        return replace(place, yaw_rad=self._from_here(place) if yaw is None else yaw)

    def arrived(self) -> bool:
        """Within the tolerance, if one was asked for."""
        expect_there(self._away_m(), self.parameters.tolerance_m)
        return True

    def after_success(self, result: Any) -> Outcome:
        """It is there, unless its target has gone on since."""
        del result
        if self.parameters.target_vehicle is not None and self._away_m() > MOVED_M:
            return Outcome(BehaviorState.UNKNOWN, reason="its target has gone on")
        return Outcome(BehaviorState.SUCCEEDED)

    def _away_m(self) -> float:
        here = self.job.seat.localization.pose
        return math.inf if here is None else apart_m(here, self.parameters.target_pose())


class Follow(Pursuit):
    """Keep a station at another vehicle: `offset` from it, at `bearing` from its bow."""

    def refusal(self) -> str:
        """Another vehicle is needed, and must be heard."""
        vehicle = self.parameters.target_vehicle
        if vehicle is None or vehicle == self.job.seat.connection.resource:
            return "parameter 'target': another vehicle is expected"
        try:
            self.aim()
        except NavigationError as error:
            return f"parameter 'target': {error}"
        return super().refusal()

    def aim(self) -> Pose:
        """The station, in the direction in which its vehicle points."""
        at = self.parameters.target_pose()
        offset_m, bearing_rad = self.parameters.offset_m, self.parameters.bearing_rad
        offset_m = OFFSET_M if offset_m is None else offset_m
        bearing_rad = BEHIND_RAD if bearing_rad is None else bearing_rad
        yaw_rad = at.yaw_rad - bearing_rad
        east_m = at.east_m + offset_m * math.cos(yaw_rad)
        north_m = at.north_m + offset_m * math.sin(yaw_rad)
        return replace(at, east_m=east_m, north_m=north_m)

    def arrived(self) -> bool:
        """Never: it goes on until it is interrupted."""
        return False

    def after_success(self, result: Any) -> Outcome:
        """It stood at its station, and follows on."""
        del result
        return Outcome(BehaviorState.RUNNING)
