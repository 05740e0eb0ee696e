"""PX4 checks a new mission for a while; until then it cannot be flown."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from m2pem_plugin_mavlink.sim.missions.plan import MISSION
from m2pem_plugin_mavlink.sim.part import Part

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

CHECKING_S = 0.2
"""Real ones take 0.1 s."""


class MissionAvailability(Part):
    """Whether there is a mission that was found good."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._items = autopilot.plans[MISSION]
        self._changed_s = autopilot.now_s - CHECKING_S

    @property
    def available(self) -> bool:
        """It may be flown."""
        pilot = self.autopilot
        if self._items != pilot.plans[MISSION]:
            self._items, self._changed_s = pilot.plans[MISSION], pilot.now_s
        return bool(self._items) and pilot.now_s - self._changed_s >= CHECKING_S

    def step(self, dt_s: float) -> None:
        """Notice a new mission."""
        _ = self.available

    def refusals(self) -> Iterator[str]:
        """Without a mission it is not armed to fly one."""
        pilot = self.autopilot
        if pilot.modes.mode.number == pilot.firmware.roles.mission and not self.available:
            yield "No valid mission available"
