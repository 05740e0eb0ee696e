"""POSCTL.ORBIT of PX4: go around a place for as long as nothing else is asked for (DO_ORBIT)."""

from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Rest
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay


class Orbit(Maneuver):
    """Goes around `circle`, seen from above clockwise if its radius is positive."""

    circle: Circle | None = None

    def begin(self) -> None:
        """Where, is said behind."""
        self._stay = Stay(self.autopilot)

    def around(self, center: Point, radius_m: float, speed_mps: float) -> None:
        """Go around there."""
        circle = Circle(center, radius_m, speed_mps)
        if circle != self.circle:
            self.autopilot.note("motion", f"orbit of {radius_m:g} m")
        self.circle = circle

    def step(self, dt_s: float) -> Demand:
        """Around it; on the ground, nothing."""
        if self.autopilot.body.on_ground:
            return Rest()
        return self.circle or self._stay.step(dt_s)
