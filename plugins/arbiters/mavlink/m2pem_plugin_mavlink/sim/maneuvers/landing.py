"""LAND: come down where it is, and stop the motors on the ground."""

from m2pem_plugin_mavlink.sim.demands import Demand, Go, Reach
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver

SLOW_BELOW_M = 10.0
"""From there on it comes down slowly (LAND_ALT_LOW)."""


class Land(Maneuver):
    """Down to the ground."""

    def begin(self) -> None:
        """Down from where it is."""
        self._point = self.autopilot.position

    def step(self, dt_s: float) -> Demand:
        """Down, slowly near the ground."""
        return come_down(self, self._point)


class Descend(Maneuver):
    """Descend of PX4: down without knowing where it is."""

    def step(self, dt_s: float) -> Demand:
        """Slowly."""
        if self.autopilot.body.on_ground:
            self.autopilot.arming.disarm_after_landing()
        return Go(0.0, 0.0, -self.autopilot.tuning.land_mps)


def come_down(maneuver: Maneuver, point: Point) -> Demand:
    """Descend to the ground at a point; landed, the motors stop."""
    pilot = maneuver.autopilot
    pilot.modes.maneuver.landing = True
    if pilot.body.on_ground:
        pilot.arming.disarm_after_landing()
    tuning = pilot.tuning
    high = pilot.body.up_m - pilot.home.point.up_m > SLOW_BELOW_M
    descent_mps = tuning.descent_mps if high else tuning.land_mps
    # The height asked for is below the ground, so that it does not slow down above it.
    return Reach(point.at_height(-100.0), 2.0, 0.0, descent_mps, pilot.body.yaw_rad)
