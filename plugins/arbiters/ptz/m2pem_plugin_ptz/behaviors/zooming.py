"""To zoom."""

from m2pem.api import BehaviorState
from m2pem_plugin_ptz.behaviors.behavior import Behavior, BehaviorFailedError

_ENOUGH = 0.02
"""Of the level: as near as lenses come."""

_AGAIN_S = 1.0
_STUCK_S = 20.0


class Zoom(Behavior):
    """To the parameter `level`."""

    name = "zoom"

    _told_s = -_AGAIN_S

    def refusal(self) -> str:
        """The lens must have such a level."""
        most = self.driver.reach.zoom_max
        level = self._level()
        return f"parameter 'level': {level:g} is above {most:g}" if level > most + 1e-9 else ""

    async def step(self, elapsed_s: float) -> bool:
        """Done when it is there."""
        if self._there():
            return True
        if elapsed_s >= _STUCK_S:
            raise BehaviorFailedError(
                f"the camera does not zoom to {self._level():g}: it has not within {_STUCK_S:g} s"
            )
        if elapsed_s - self._told_s >= _AGAIN_S:
            self._told_s = elapsed_s
            self.driver.zoom(self._level())
        return False

    def recognised(self) -> BehaviorState:
        """To zoom there twice does no harm: what is on its way goes on."""
        return BehaviorState.SUCCEEDED if self._there() else BehaviorState.RUNNING

    def _level(self) -> float:
        level = self.job.number("level")
        return 1.0 if level is None else level

    def _there(self) -> bool:
        look = self.driver.look
        return look is not None and abs(look.zoom - self._level()) <= _ENOUGH * self._level()
