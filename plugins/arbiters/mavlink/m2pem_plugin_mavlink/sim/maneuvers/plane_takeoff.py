"""TAKEOFF of ArduPlane: straight ahead and up to TKOFF_ALT, and then around there."""

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay

AHEAD_M = 3000.0
REACHED_M = 2.0


class PlaneTakeoff(Maneuver):
    """Begins as soon as it is armed; `taking_off` until it is at its height."""

    taking_off = True
    _goal: Point | None = None

    def begin(self) -> None:
        """Nothing yet: the heading is that of the moment at which it rolls."""
        self._stay = Stay(self.autopilot)

    def step(self, dt_s: float) -> Demand:
        """Up, then around."""
        pilot = self.autopilot
        if self._goal is None:
            if pilot.body.on_ground:
                pilot.note("takeoff", "TAKEOFF")
            up_m = pilot.home.point.up_m + pilot.parameters["TKOFF_ALT"]
            self._goal = pilot.position.moved(pilot.body.yaw_rad, AHEAD_M).at_height(up_m)
        if self._goal.up_m - pilot.body.up_m <= REACHED_M:
            self.taking_off = False
        return self.reach(self._goal) if self.taking_off else self._stay.step(dt_s)
