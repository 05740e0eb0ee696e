"""OFFBOARD of PX4: places and velocities from a computer on board or on the ground, as long as
they keep coming."""

from m2pem_plugin_mavlink.sim.demands import Demand, Rest
from m2pem_plugin_mavlink.sim.maneuvers.guided import Guided
from m2pem_plugin_mavlink.sim.specification import Kind


class Offboard(Guided):
    """As GUIDED, but a setpoint above takes it from the ground too."""

    def step(self, dt_s: float) -> Demand:
        """The last setpoint; that they stop, is for somebody else to notice."""
        pilot = self.autopilot
        if not (pilot.body.on_ground and pilot.spec.kind is Kind.COPTER):
            return super().step(dt_s)
        if self._velocity is not None and pilot.now_s <= self._velocity_until_s:
            return self._velocity()
        if self.destination is not None and self.destination.up_m > pilot.body.up_m:
            return self.reach(self.destination, yaw_rad=self.yaw_rad)
        return Rest()
