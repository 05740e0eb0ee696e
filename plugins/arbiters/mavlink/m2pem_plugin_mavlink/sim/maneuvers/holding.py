"""AUTO.LOITER of PX4: stay, or go to the place that was asked for and stay there.

To enter the mode once more does not stop it on its way; only a reposition to nowhere does.
"""

from m2pem_plugin_mavlink.sim.demands import Demand, Rest
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay
from m2pem_plugin_mavlink.sim.specification import Kind


class Hold(Maneuver):
    """`destination`: where it was told to be; None: where it was when the mode was entered."""

    destination: Point | None = None
    yaw_rad: float | None = None

    def begin(self) -> None:
        """Stay."""
        self.destination = self.yaw_rad = None
        self._stay = Stay(self.autopilot)
        self._arrived = False

    def go_to(self, point: Point, yaw_rad: float | None) -> None:
        """Be there."""
        if self.destination is None or self.destination != point:
            place = self.autopilot.frame.to_location(point)
            self.autopilot.note("motion", f"{place.latitude_deg:.7f},{place.longitude_deg:.7f}")
            self._arrived = False
        self.destination, self.yaw_rad = point, yaw_rad

    def pause(self) -> None:
        """Brake, and stay there."""
        self.destination = self.yaw_rad = None
        self._stay = Stay(self.autopilot)

    def keep(self, point: Point) -> None:
        """Stay there, which is where it is, or nearly."""
        self.destination, self.yaw_rad = point, self.autopilot.body.yaw_rad

    def step(self, dt_s: float) -> Demand:
        """Go there, or stay."""
        pilot, destination = self.autopilot, self.destination
        if pilot.body.on_ground and pilot.spec.kind is Kind.COPTER:
            return Rest()
        if destination is None:
            return self._stay.step(dt_s)
        if pilot.spec.kind is Kind.COPTER:
            return self.reach(destination, yaw_rad=self.yaw_rad)
        near = pilot.position.distance_m(destination) <= pilot.tuning.acceptance_m
        self._arrived = self._arrived or near
        return self.stay(destination) if self._arrived else self.reach(destination)
