"""The tasks without a goal: `hold`, `drive_stop` and `teleop`."""

from typing import ClassVar

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.drivers.nav2.tasks.task import Nav2Task, TaskContext
from m2pem_plugin_ros.sensors.localization import moves, stands

STAND_WITHIN_S = 10.0
LOOK_EVERY_S = 0.2


class Hold(Nav2Task):
    """Stand for `duration`; without it, until the vehicle stands."""

    needs_nav2: ClassVar[bool] = False

    def __init__(self, context: TaskContext) -> None:
        super().__init__(context)
        self._left_s = self.parameters.duration_s or 0.0

    async def run(self) -> None:
        """Stop, and wait for the rest of the duration."""
        await self.nav2.stop()
        self.context.begun()
        if why := await stands(self.context.setup.localization, self.clock, STAND_WITHIN_S):
            raise NavigationError(f"the vehicle does not stop: {why}", "TIMEOUT")
        since_us = self.clock.now_us()
        left_s = self._left_s
        while self._left_s > 0:
            self.nav2.expect_no_other_client()
            await self.clock.sleep(min(LOOK_EVERY_S, self._left_s))
            self._left_s = left_s - (self.clock.now_us() - since_us) / 1e6

    async def query(self) -> Outcome:
        """Return RUNNING or SUCCEEDED if the vehicle stands. The duration starts again, as its rest
        is not known."""
        if other_client := self.nav2.other_client():
            return Outcome(BehaviorState.UNKNOWN, reason=f"Nav2 executes a goal: {other_client}")
        if why := moves(self.context.setup.localization):
            return Outcome(BehaviorState.UNKNOWN, reason=why)
        return Outcome(BehaviorState.RUNNING if self._left_s else BehaviorState.SUCCEEDED)


class Stop(Hold):
    """Stop, and end when the vehicle stands."""


class Teleop(Nav2Task):
    """Stop Nav2, and let an operator drive by the vehicle's own joystick."""

    needs_nav2: ClassVar[bool] = False

    async def run(self) -> None:
        """Stop Nav2, and wait for the timeout, if there is one."""
        await self.nav2.stop()
        self.context.begun()
        timeout_s = self.parameters.timeout_s
        if timeout_s is not None:
            await self.clock.sleep(timeout_s)
            return
        while True:
            await self.clock.sleep(60.0)

    async def query(self) -> Outcome:
        """Return RUNNING if Nav2 executes no goal. The timeout starts again."""
        if other_client := self.nav2.other_client():
            return Outcome(BehaviorState.UNKNOWN, reason=f"Nav2 executes a goal: {other_client}")
        return Outcome(BehaviorState.RUNNING)
