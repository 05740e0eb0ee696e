"""RTL: climb, come home, land (a rover stands there, a plane circles)."""

from m2pem_plugin_mavlink.sim.demands import Demand, Rest
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.landing import come_down
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.specification import Kind

CLOSE_M = 1.0
WAIT_S = 5.0
"""How long it waits above home before it comes down (RTL_LOIT_TIME)."""


class ReturnToLaunch(Maneuver):
    """Home. `arrived`: it is there, or above."""

    @property
    def takes_speed(self) -> bool:
        """Planes come home as fast as they are set up."""
        return self.autopilot.spec.kind is not Kind.PLANE

    def begin(self) -> None:
        """At which height, is decided once."""
        pilot = self.autopilot
        home = pilot.home.point
        up_m = self.least_up_m()
        if pilot.spec.kind is Kind.COPTER:
            up_m = max(up_m, pilot.body.up_m)
        elif pilot.spec.kind is not Kind.PLANE:
            up_m = 0.0
        self._above_home = home.at_height(up_m)
        self._climb_to: Point | None = pilot.position.at_height(up_m)
        self._waited_s = 0.0
        self.arrived = False
        if pilot.body.on_ground and pilot.spec.kind is Kind.COPTER and pilot.arming.armed:
            pilot.arming.disarm_after_landing()

    def least_up_m(self) -> float:
        """The height at which it comes home, unless it is higher already."""
        return self.autopilot.home.point.up_m + self.autopilot.tuning.return_up_m

    def step(self, dt_s: float) -> Demand:
        """Climb, fly, wait, land."""
        pilot = self.autopilot
        match pilot.spec.kind:
            case Kind.COPTER:
                return self._copter(dt_s)
            case Kind.PLANE:
                return self.stay(self._above_home)
        near_m = max(pilot.tuning.acceptance_m, CLOSE_M)
        if not self.arrived and pilot.position.distance_m(self._above_home) <= near_m:
            self.arrived = True
            pilot.say("Reached destination")
        return self.stay(self._above_home) if self.arrived else self.reach(self._above_home)

    def _copter(self, dt_s: float) -> Demand:
        pilot = self.autopilot
        if pilot.body.on_ground and self._waited_s == 0.0:
            pilot.arming.disarm_after_landing()
            return Rest()
        if self._climb_to is not None:
            if self._climb_to.up_m - pilot.body.up_m > CLOSE_M:
                return self.reach(self._climb_to, yaw_rad=pilot.body.yaw_rad)
            self._climb_to = None
        if not self.arrived:
            if pilot.position.distance_m(self._above_home) > CLOSE_M:
                return self.reach(self._above_home)
            self.arrived = True
        self._waited_s += dt_s
        if self._waited_s < WAIT_S:
            return self.reach(self._above_home, yaw_rad=pilot.body.yaw_rad)
        return come_down(self, self._above_home)
