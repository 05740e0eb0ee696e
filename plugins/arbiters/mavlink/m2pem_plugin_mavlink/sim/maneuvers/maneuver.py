"""A maneuver: what a vehicle does while it is armed and in a mode."""

from typing import TYPE_CHECKING

from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Drive, Reach
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.specification import Kind

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot


class Maneuver:
    """Made when its mode is entered, gone when it is left. `taking_off`, `landing`: it goes up from
    or down to the ground."""

    taking_off = False
    landing = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self.autopilot = autopilot

    @property
    def takes_speed(self) -> bool:
        """Whether ArduPilot obeys DO_CHANGE_SPEED in it now (set_desired_speed of Rover's modes,
        set_speed_xy_cms of Copter's)."""
        return False

    def refusal(self) -> str | None:
        """Why it cannot be begun now, as ArduPilot words it; None: it can. Changes nothing."""
        return None

    def begin(self) -> None:
        """Its mode has been entered; it may be armed or not."""

    def end(self) -> None:
        """Its mode has been left."""

    def step(self, dt_s: float) -> Demand:
        """What the body is to do now. Asked only while armed."""
        raise NotImplementedError

    def hand_over(self, mode: int, dt_s: float) -> Demand:
        """Enter another mode and do what is done there; if that cannot be, stay."""
        pilot = self.autopilot
        pilot.modes.switch(mode)
        successor = pilot.modes.maneuver
        return self.stay(pilot.position) if successor is self else successor.step(dt_s)

    def stay(self, point: Point) -> Demand:
        """Remain at a point: a copter hovers, a rover stands, a boat keeps station, a plane
        circles."""
        tuning = self.autopilot.tuning
        match self.autopilot.spec.kind:
            case Kind.ROVER:
                return Drive(0.0)
            case Kind.PLANE:
                return Circle(point, tuning.loiter_radius_m, tuning.cruise_mps)
            case Kind.BOAT:
                if self.autopilot.position.distance_m(point) <= tuning.loiter_radius_m:
                    return Drive(0.0)
        return self.reach(point, yaw_rad=self.autopilot.body.yaw_rad)

    def reach(self, point: Point, *, yaw_rad: float | None = None) -> Reach:
        """Go to a point at the speed that is set."""
        tuning = self.autopilot.tuning
        return Reach(
            point,
            self.autopilot.modes.speed_mps,
            tuning.climb_mps,
            tuning.descent_mps,
            yaw_rad,
            self.autopilot.modes.reverse,
        )
