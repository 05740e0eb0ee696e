"""What PX4 says of a takeoff and a landing, and the mode that it enters when its motors stop (PX4:
Commander, UserModeIntention)."""

from typing import TYPE_CHECKING

from m2pem_plugin_mavlink.sim.firmware.px4_modes import HOLD, TAKEOFF
from m2pem_plugin_mavlink.sim.modes import Mode
from m2pem_plugin_mavlink.sim.part import Part
from m2pem_plugin_mavlink.sim.specification import Kind

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot


class LandingWatch(Part):
    """Disarmed, it is in the last mode in which it may be armed, other than AUTO.TAKEOFF."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._after_disarming = HOLD
        self._armed = False
        self._on_ground = True

    def step(self, dt_s: float) -> None:
        """Look at the ground and the motors."""
        pilot = self.autopilot
        on_ground = pilot.body.on_ground
        if on_ground != self._on_ground and pilot.spec.kind is Kind.COPTER:
            pilot.say("Landing detected" if on_ground else "Takeoff detected")
        self._on_ground = on_ground
        if self._armed and not pilot.arming.armed:
            pilot.modes.switch(self._after_disarming)
        self._armed = pilot.arming.armed

    def entered(self, mode: Mode) -> None:
        """A mode has been entered."""
        if mode.armable and mode.number != TAKEOFF:
            self._after_disarming = mode.number
