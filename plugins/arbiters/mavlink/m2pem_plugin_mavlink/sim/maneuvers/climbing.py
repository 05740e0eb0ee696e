"""AUTO.TAKEOFF of PX4: climb straight up, then hold."""

from dataclasses import replace

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.maneuvers.holding import Hold
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver

THERE_M = 0.5
"""The climb is over when it is that near to its height."""


class TakeOff(Maneuver):
    """Climbs once it is armed: the mode may be entered before.

    `up_m`: the height above the frame's origin; None: MIS_TAKEOFF_ALT above where it stands.
    """

    up_m: float | None = None

    def begin(self) -> None:
        """From where it is. Armed on the ground, it takes off."""
        pilot = self.autopilot
        self._start = pilot.position
        self.taking_off = pilot.arming.armed and pilot.body.on_ground
        if self.taking_off:
            pilot.note("takeoff", "AUTO.TAKEOFF")

    def climb_to(self, up_m: float | None) -> None:
        """How high, from the command that entered the mode."""
        pilot = self.autopilot
        least_m = self._start.up_m + pilot.parameters["MIS_TAKEOFF_ALT"]
        if up_m is None:
            pilot.say(f"Using default takeoff altitude: {least_m:.1f} m")
        elif up_m < pilot.body.up_m:
            pilot.warn("Already higher than takeoff altitude")
            up_m = pilot.body.up_m
        self.up_m = up_m

    def step(self, dt_s: float) -> Demand:
        """Up; then AUTO.LOITER."""
        pilot = self.autopilot
        default_m = self._start.up_m + pilot.parameters["MIS_TAKEOFF_ALT"]
        up_m = default_m if self.up_m is None else self.up_m
        if up_m - pilot.body.up_m <= THERE_M and not pilot.body.on_ground:
            self.taking_off = False
            demand = self.hand_over(pilot.firmware.roles.hold, dt_s)
            if isinstance(pilot.modes.maneuver, Hold):
                pilot.modes.maneuver.keep(self._start.at_height(up_m))
            return demand
        goal = self.reach(self._start.at_height(up_m), yaw_rad=pilot.body.yaw_rad)
        return replace(goal, climb_mps=pilot.parameters["MPC_TKO_SPEED"])
