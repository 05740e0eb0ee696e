"""Modes that stay where they are: LOITER, HOLD, BRAKE, and those in which a pilot would fly.

There is no pilot: the sticks stay in the middle, so a copter in STABILIZE hovers, a rover in MANUAL
stands.
"""

from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Drive, Reach, Rest
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.specification import Kind


class Stay(Maneuver):
    """Stop, and remain there. On the ground, remain on the ground."""

    _point: Point | None = None

    def step(self, dt_s: float) -> Demand:
        """Brake first; the place is where it then stands."""
        pilot = self.autopilot
        if pilot.body.on_ground and pilot.spec.kind in (Kind.COPTER, Kind.PLANE):
            return Rest()
        if self._point is None:
            if pilot.spec.kind is Kind.COPTER and pilot.body.moving:
                return Reach(pilot.position, 0.0, 0.0, 0.0, pilot.body.yaw_rad)
            if pilot.spec.kind is Kind.BOAT and pilot.body.moving:
                return Drive(0.0)
            self._point = pilot.position
        return self.stay(self._point)


class Halt(Maneuver):
    """Stop, and let it drift."""

    def step(self, dt_s: float) -> Demand:
        """No speed."""
        return Drive(0.0)


class CircleHere(Maneuver):
    """Go around the place where the mode was entered."""

    _center: Point | None = None

    @property
    def takes_speed(self) -> bool:
        """What drives or floats does."""
        return self.autopilot.spec.kind in (Kind.ROVER, Kind.BOAT)

    def step(self, dt_s: float) -> Demand:
        """Around it."""
        pilot = self.autopilot
        if pilot.body.on_ground and pilot.spec.kind is Kind.COPTER:
            return Rest()
        if self._center is None:
            radius_m = pilot.tuning.loiter_radius_m
            self._center = pilot.position.moved(pilot.body.yaw_rad, radius_m)
        speed_mps = pilot.modes.speed_mps if pilot.spec.kind is not Kind.COPTER else 2.0
        return Circle(self._center, pilot.tuning.loiter_radius_m, speed_mps)
