"""What a vehicle does in the modes that only PX4 has."""

from dataclasses import replace

from m2pem_plugin_mavlink.simulator.dynamics import CircleSetpoint, MotionSetpoint, NoThrust
from m2pem_plugin_mavlink.simulator.geometry import Point
from m2pem_plugin_mavlink.simulator.interfaces import Maneuver
from m2pem_plugin_mavlink.simulator.maneuvers import Guided, HoldPosition, ReturnToLaunch
from m2pem_plugin_mavlink.simulator.specification import Kind

THERE_M = 0.5
"""The climb is over when it is that near to its height."""


class TakeOff(Maneuver):
    """AUTO.TAKEOFF: climb once armed, then hold; the mode may be entered before.

    `up_m`: the height above the frame's origin; None: MIS_TAKEOFF_ALT above the start.
    """

    up_m: float | None = None

    def begin(self) -> None:
        """From where it is. Armed on the ground, it takes off."""
        autopilot = self.autopilot
        self._start = autopilot.position
        self.taking_off = autopilot.arming.armed and autopilot.body.on_ground
        if self.taking_off:
            autopilot.log_event("takeoff", "AUTO.TAKEOFF")

    def climb_to(self, up_m: float | None) -> None:
        """How high, from the command that entered the mode."""
        autopilot = self.autopilot
        least_m = self._start.up_m + autopilot.parameters["MIS_TAKEOFF_ALT"]
        if up_m is None:
            autopilot.say(f"Using default takeoff altitude: {least_m:.1f} m")
        elif up_m < autopilot.body.up_m:
            autopilot.warn("Already higher than takeoff altitude")
            up_m = autopilot.body.up_m
        self.up_m = up_m

    def step(self, dt_s: float) -> MotionSetpoint:
        """Up; then AUTO.LOITER."""
        autopilot = self.autopilot
        default_m = self._start.up_m + autopilot.parameters["MIS_TAKEOFF_ALT"]
        up_m = default_m if self.up_m is None else self.up_m
        if up_m - autopilot.body.up_m <= THERE_M and not autopilot.body.on_ground:
            self.taking_off = False
            setpoint = self.hand_over(autopilot.firmware.roles.hold, dt_s)
            if isinstance(autopilot.modes.maneuver, Hold):
                autopilot.modes.maneuver.keep(self._start.at_height(up_m))
            return setpoint
        goal = self.reach(self._start.at_height(up_m), yaw_rad=autopilot.body.yaw_rad)
        return replace(goal, climb_mps=autopilot.parameters["MPC_TKO_SPEED"])


class Hold(Maneuver):
    """AUTO.LOITER. `destination`: the commanded position; None: where the mode was entered."""

    destination: Point | None = None
    yaw_rad: float | None = None

    def begin(self) -> None:
        """Stay."""
        self.destination = self.yaw_rad = None
        self._stay = HoldPosition(self.autopilot)
        self._arrived = False

    def go_to(self, point: Point, yaw_rad: float | None) -> None:
        """Be there."""
        if self.destination is None or self.destination != point:
            place = self.autopilot.frame.to_location(point)
            self.autopilot.log_event(
                "motion", f"{place.latitude_deg:.7f},{place.longitude_deg:.7f}"
            )
            self._arrived = False
        self.destination, self.yaw_rad = point, yaw_rad

    def pause(self) -> None:
        """Brake, and stay there."""
        self.destination = self.yaw_rad = None
        self._stay = HoldPosition(self.autopilot)

    def keep(self, point: Point) -> None:
        """Hold a position that is the present one, or near it."""
        self.destination, self.yaw_rad = point, self.autopilot.body.yaw_rad

    def step(self, dt_s: float) -> MotionSetpoint:
        """Go there, or stay."""
        autopilot, destination = self.autopilot, self.destination
        if autopilot.body.on_ground and autopilot.spec.kind is Kind.COPTER:
            return NoThrust()
        if destination is None:
            return self._stay.step(dt_s)
        if autopilot.spec.kind is Kind.COPTER:
            return self.reach(destination, yaw_rad=self.yaw_rad)
        near = autopilot.position.distance_m(destination) <= autopilot.tuning.acceptance_m
        self._arrived = self._arrived or near
        return self.stay(destination) if self._arrived else self.reach(destination)


class Orbit(Maneuver):
    """POSCTL.ORBIT: circle around `circle`, clockwise from above if its radius is positive."""

    circle: CircleSetpoint | None = None

    def begin(self) -> None:
        """Where, is said behind."""
        self._stay = HoldPosition(self.autopilot)

    def around(self, center: Point, radius_m: float, speed_mps: float) -> None:
        """Go around there."""
        circle = CircleSetpoint(center, radius_m, speed_mps)
        if circle != self.circle:
            self.autopilot.log_event("motion", f"orbit of {radius_m:g} m")
        self.circle = circle

    def step(self, dt_s: float) -> MotionSetpoint:
        """Around it; on the ground, nothing."""
        if self.autopilot.body.on_ground:
            return NoThrust()
        return self.circle or self._stay.step(dt_s)


class Px4Return(ReturnToLaunch):
    """AUTO.RTL: climb to RTL_RETURN_ALT, but within a cone of 45 degrees (RTL_CONE_ANG) above home
    only to the cone."""

    def least_up_m(self) -> float:
        """On the cone, or at the height that is set."""
        autopilot = self.autopilot
        home = autopilot.home.point
        cone_m = max(autopilot.position.distance_m(home), autopilot.parameters["RTL_DESCEND_ALT"])
        return home.up_m + min(autopilot.tuning.return_up_m, cone_m)


class Offboard(Guided):
    """OFFBOARD: as GUIDED, but a setpoint above it also takes it off."""

    def step(self, dt_s: float) -> MotionSetpoint:
        """Return the last setpoint; `OffboardMonitor` detects that they stop."""
        autopilot = self.autopilot
        if not (autopilot.body.on_ground and autopilot.spec.kind is Kind.COPTER):
            return super().step(dt_s)
        if self._velocity is not None and autopilot.now_s <= self._velocity_until_s:
            return self._velocity
        if self.destination is not None and self.destination.up_m > autopilot.body.up_m:
            return self.reach(self.destination, yaw_rad=self.yaw_rad)
        return NoThrust()
