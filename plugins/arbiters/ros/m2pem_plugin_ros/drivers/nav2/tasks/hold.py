"""Orders that give Nav2 no goal: standing, and leaving the vehicle to an operator."""

from typing import ClassVar

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Outcome
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError, taken_over
from m2pem_plugin_ros.drivers.nav2.tasks.task import Errand, Job
from m2pem_plugin_ros.sensors.localization import moves, stands

STAND_WITHIN_S = 10.0
LOOK_EVERY_S = 0.2


class Hold(Errand):
    """Stand for a time, or until it stands."""

    needs_nav2: ClassVar[bool] = False

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._left_s = self.parameters.duration_s or 0.0

    async def run(self) -> None:
        """Stop it, and see that it stands for as long as is left."""
        await self.nav2.stop()
        self.job.begun()
        if why := await stands(self.job.seat.localization, self.clock, STAND_WITHIN_S):
            raise NavigationError(f"it does not stop: {why}", "TIMEOUT")
        since_us = self.clock.now_us()
        left_s = self._left_s
        while self._left_s > 0:
            if rival := self.nav2.rival():
                raise taken_over(f"somebody else has given Nav2 a goal: {rival}")
            await self.clock.sleep(min(LOOK_EVERY_S, self._left_s))
            self._left_s = left_s - (self.clock.now_us() - since_us) / 1e6

    async def look(self) -> Outcome:
        """Whether it stands. For how long it has is not known: it stands as long again."""
        if rival := self.nav2.rival():
            return Outcome(BehaviorState.UNKNOWN, reason=f"Nav2 carries out a goal: {rival}")
        if why := moves(self.job.seat.localization):
            return Outcome(BehaviorState.UNKNOWN, reason=why)
        return Outcome(BehaviorState.RUNNING if self._left_s else BehaviorState.SUCCEEDED)


class Stop(Hold):
    """Stop."""


class Teleop(Errand):
    """Nav2 does nothing, and an operator drives by the vehicle's own means."""

    needs_nav2: ClassVar[bool] = False

    async def run(self) -> None:
        """Stop Nav2; how the vehicle moves then is nobody's business here."""
        await self.nav2.stop()
        self.job.begun()
        timeout_s = self.parameters.timeout_s
        if timeout_s is not None:
            await self.clock.sleep(timeout_s)
            return
        while True:
            await self.clock.sleep(60.0)

    async def look(self) -> Outcome:
        """Whether Nav2 leaves it alone; a timeout begins anew."""
        if rival := self.nav2.rival():
            return Outcome(BehaviorState.UNKNOWN, reason=f"Nav2 carries out a goal: {rival}")
        return Outcome(BehaviorState.RUNNING)
