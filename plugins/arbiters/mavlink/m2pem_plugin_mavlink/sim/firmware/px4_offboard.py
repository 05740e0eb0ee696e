"""OFFBOARD needs a stream of setpoints: before it is entered, and as long as it lasts."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from m2pem_plugin_mavlink.sim.failsafes.px4 import Px4Failsafes
from m2pem_plugin_mavlink.sim.firmware.px4_modes import HOLD, LAND, OFFBOARD, RETURN
from m2pem_plugin_mavlink.sim.part import MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

ACTIONS = {4: LAND, 5: HOLD}
"""COM_OBL_RC_ACT: the mode that follows on OFFBOARD; else it is RETURN, because modes for a pilot
cannot be entered without a remote control."""


class OffboardWatch(Part):
    """Leaves OFFBOARD when setpoints have not come for COM_OF_LOSS_T."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._heard_s = -1e9

    @property
    def streaming(self) -> bool:
        """Setpoints are coming."""
        pilot = self.autopilot
        return pilot.now_s - self._heard_s <= pilot.parameters["COM_OF_LOSS_T"]

    def messages(self) -> Mapping[str, MessageHandler]:
        """The setpoints; what they ask for is the maneuver's."""
        names = ("LOCAL_NED", "GLOBAL_INT")
        return {f"SET_POSITION_TARGET_{name}": self._heard for name in names}

    def _heard(self, message: Any, sender: Heard) -> None:
        self._heard_s = self.autopilot.now_s

    def refusals(self) -> Iterator[str]:
        """It is not armed in OFFBOARD without setpoints."""
        if self.autopilot.modes.mode.number == OFFBOARD and not self.streaming:
            yield "No offboard signal"

    def step(self, dt_s: float) -> None:
        """Look whether they still come."""
        pilot = self.autopilot
        if pilot.modes.mode.number != OFFBOARD or not pilot.arming.armed or self.streaming:
            return
        mode = ACTIONS.get(int(pilot.parameters["COM_OBL_RC_ACT"]), RETURN)
        pilot.part(Px4Failsafes).act("no setpoints", mode, at_once=True)
