"""What a vehicle does in a mode: each maneuver gives the dynamics a motion setpoint."""

from dataclasses import replace

from pymavlink.dialects.v20.ardupilotmega import (
    MAV_SEVERITY_WARNING,
    MAVLink_mission_item_reached_message,
)

from m2pem_plugin_mavlink.simulator.dynamics import (
    CircleSetpoint,
    MotionSetpoint,
    NoThrust,
    PositionSetpoint,
    VelocitySetpoint,
)
from m2pem_plugin_mavlink.simulator.geometry import Point
from m2pem_plugin_mavlink.simulator.interfaces import Maneuver
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind


class HoldPosition(Maneuver):
    """Stop and hold the position; a vehicle on the ground stays there."""

    _point: Point | None = None

    def step(self, dt_s: float) -> MotionSetpoint:
        """Brake; then hold the position."""
        autopilot = self.autopilot
        if autopilot.body.on_ground and autopilot.spec.kind in (Kind.COPTER, Kind.PLANE):
            return NoThrust()
        if self._point is None:
            if autopilot.spec.kind is Kind.COPTER and autopilot.body.moving:
                return PositionSetpoint(autopilot.position, 0.0, 0.0, 0.0, autopilot.body.yaw_rad)
            if autopilot.spec.kind is Kind.BOAT and autopilot.body.moving:
                return NoThrust()
            self._point = autopilot.position
        return self.stay(self._point)


class Stop(Maneuver):
    """Stop, and drift."""

    def step(self, dt_s: float) -> MotionSetpoint:
        """No speed."""
        return NoThrust()


class CircleHere(Maneuver):
    """Circle the place at which the mode was entered."""

    _center: Point | None = None

    @property
    def takes_speed(self) -> bool:
        """Whether it obeys DO_CHANGE_SPEED: rovers and boats."""
        return self.autopilot.spec.kind in SURFACE

    def step(self, dt_s: float) -> MotionSetpoint:
        """Around it."""
        autopilot = self.autopilot
        if autopilot.body.on_ground and autopilot.spec.kind is Kind.COPTER:
            return NoThrust()
        if self._center is None:
            radius_m = autopilot.tuning.loiter_radius_m
            self._center = autopilot.position.moved(autopilot.body.yaw_rad, radius_m)
        speed_mps = autopilot.modes.speed_mps if autopilot.spec.kind is not Kind.COPTER else 2.0
        return CircleSetpoint(self._center, autopilot.tuning.loiter_radius_m, speed_mps)


SLOW_BELOW_M = 10.0
"""From there on it comes down slowly (LAND_ALT_LOW)."""


class Land(Maneuver):
    """LAND: descend and land."""

    def begin(self) -> None:
        """Down from where it is."""
        self._point = self.autopilot.position

    def step(self, dt_s: float) -> MotionSetpoint:
        """Down, slowly near the ground."""
        return descend_to_land(self, self._point)


class Descend(Maneuver):
    """AUTO.DESCEND of PX4: descend without a position."""

    def step(self, dt_s: float) -> MotionSetpoint:
        """Slowly."""
        if self.autopilot.body.on_ground:
            self.autopilot.arming.disarm_after_landing()
        return VelocitySetpoint(0.0, 0.0, -self.autopilot.tuning.land_mps)


def descend_to_land(maneuver: Maneuver, point: Point) -> MotionSetpoint:
    """Return the setpoint to land at a point; after landing, disarm."""
    autopilot = maneuver.autopilot
    autopilot.modes.maneuver.landing = True
    if autopilot.body.on_ground:
        autopilot.arming.disarm_after_landing()
    tuning = autopilot.tuning
    high = autopilot.body.up_m - autopilot.home.point.up_m > SLOW_BELOW_M
    descent_mps = tuning.descent_mps if high else tuning.land_mps
    # The height asked for is below the ground, so that it does not slow down above it.
    return PositionSetpoint(point.at_height(-100.0), 2.0, 0.0, descent_mps, autopilot.body.yaw_rad)


CLOSE_M = 1.0
WAIT_S = 5.0
"""How long it waits above home before it comes down (RTL_LOIT_TIME)."""


class ReturnToLaunch(Maneuver):
    """RTL: climb, return home, land; a rover stops there, a plane circles. `arrived`: at home, or
    above it."""

    @property
    def takes_speed(self) -> bool:
        """Whether it obeys DO_CHANGE_SPEED: all but planes."""
        return self.autopilot.spec.kind is not Kind.PLANE

    def begin(self) -> None:
        """Choose the height of the return."""
        autopilot = self.autopilot
        home = autopilot.home.point
        up_m = self.least_up_m()
        if autopilot.spec.kind is Kind.COPTER:
            up_m = max(up_m, autopilot.body.up_m)
        elif autopilot.spec.kind is not Kind.PLANE:
            up_m = 0.0
        self._above_home = home.at_height(up_m)
        self._climb_to: Point | None = autopilot.position.at_height(up_m)
        self._waited_s = 0.0
        self.arrived = False
        if (
            autopilot.body.on_ground
            and autopilot.spec.kind is Kind.COPTER
            and autopilot.arming.armed
        ):
            autopilot.arming.disarm_after_landing()

    def least_up_m(self) -> float:
        """Return the least height of the return."""
        return self.autopilot.home.point.up_m + self.autopilot.tuning.return_up_m

    def step(self, dt_s: float) -> MotionSetpoint:
        """Climb, fly, wait, land."""
        autopilot = self.autopilot
        match autopilot.spec.kind:
            case Kind.COPTER:
                return self._copter(dt_s)
            case Kind.PLANE:
                return self.stay(self._above_home)
        near_m = max(autopilot.tuning.acceptance_m, CLOSE_M)
        if not self.arrived and autopilot.position.distance_m(self._above_home) <= near_m:
            self.arrived = True
            autopilot.say("Reached destination")
        return self.stay(self._above_home) if self.arrived else self.reach(self._above_home)

    def _copter(self, dt_s: float) -> MotionSetpoint:
        autopilot = self.autopilot
        if autopilot.body.on_ground and self._waited_s == 0.0:
            autopilot.arming.disarm_after_landing()
            return NoThrust()
        if self._climb_to is not None:
            if self._climb_to.up_m - autopilot.body.up_m > CLOSE_M:
                return self.reach(self._climb_to, yaw_rad=autopilot.body.yaw_rad)
            self._climb_to = None
        if not self.arrived:
            if autopilot.position.distance_m(self._above_home) > CLOSE_M:
                return self.reach(self._above_home)
            self.arrived = True
        self._waited_s += dt_s
        if self._waited_s < WAIT_S:
            return self.reach(self._above_home, yaw_rad=autopilot.body.yaw_rad)
        return descend_to_land(self, self._above_home)


TAKEN_OFF_M = 0.3
"""A takeoff is over when it is that near to its height."""


class Guided(Maneuver):
    """What was last asked for: a takeoff, a place, a velocity; without any, it stays.

    `aimed`: it is on the way to a place, or (not boats, which then loiter) has arrived there. A
    copter goes as fast as it is set up whenever that begins or ends; what drives takes no speed
    before. (ArduPilot: ModeGuided::set_desired_speed of rovers, pva_control_start of copters.)
    `radius_m`: a plane circles the place so far away (0: WP_LOITER_RAD), until the mode is left.
    A velocity is forgotten after `tuning.setpoint_timeout_s` (ArduPilot: 3 s, GUID_TIMEOUT).
    """

    takeoff_up_m: float | None = None
    radius_m = 0.0
    destination: Point | None = None
    _entered = False
    aimed = False

    @property
    def takes_speed(self) -> bool:
        """What drives does so on the way to a place only."""
        return self.aimed or self.autopilot.spec.kind not in SURFACE

    def _aim(self, aimed: bool) -> None:
        if aimed != self.aimed and self.autopilot.spec.kind is Kind.COPTER:
            self.autopilot.modes.set_speed(None)
        self.aimed = aimed

    def begin(self) -> None:
        """Nothing has been asked for yet."""
        self._stay = HoldPosition(self.autopilot)
        self._velocity: VelocitySetpoint | None = None
        self._velocity_until_s = 0.0
        self.yaw_rad: float | None = None
        if not self._entered:
            self._say_reached()
        self._entered = True

    def _say_reached(self) -> None:
        """Report a reached item: a plane takes its last circle for that around the new place
        (Plane::update_loiter)."""
        if self.autopilot.spec.kind is Kind.PLANE:
            self.autopilot.send(MAVLink_mission_item_reached_message(0))

    def take_off(self, up_m: float) -> None:
        """Climb to a height (metres above the frame's origin)."""
        self._aim(False)
        self.takeoff_up_m, self.taking_off = up_m, True
        self._start = self.autopilot.position
        self.destination = self._velocity = None
        self.autopilot.log_event("takeoff", f"{up_m:g} m")

    def go_to(self, point: Point, yaw_rad: float | None = None) -> None:
        """Go there, and stay."""
        if (
            self.destination is None
            or self.destination.distance_m(point) > 0.1
            or (abs(self.destination.up_m - point.up_m) > 0.1)
        ):
            place = self.autopilot.frame.to_location(point)
            self.autopilot.log_event(
                "motion", f"{place.latitude_deg:.7f},{place.longitude_deg:.7f}"
            )
            self._say_reached()
        self._aim(True)
        self.taking_off, self._velocity = False, None
        self.destination, self.yaw_rad = point, yaw_rad

    def move(self, setpoint: VelocitySetpoint) -> None:
        """Follow a velocity for a while."""
        if self._velocity is None:
            self.autopilot.log_event("motion", "velocity")
        self._aim(False)
        self.taking_off, self.destination = False, None
        self._velocity = setpoint
        self._velocity_until_s = self.autopilot.now_s + self.autopilot.tuning.setpoint_timeout_s

    def stop(self) -> None:
        """Hold the position."""
        self.destination = self._velocity = None
        self.taking_off = False
        self._stay = HoldPosition(self.autopilot)

    def step(self, dt_s: float) -> MotionSetpoint:
        """What was asked for."""
        autopilot = self.autopilot
        if self.taking_off and self.takeoff_up_m is not None:
            if (
                abs(self.takeoff_up_m - autopilot.body.up_m) > TAKEN_OFF_M
                or autopilot.body.on_ground
            ):
                yaw_rad = autopilot.body.yaw_rad
                return self.reach(self._start.at_height(self.takeoff_up_m), yaw_rad=yaw_rad)
            self.taking_off = False
            self._stay = HoldPosition(autopilot)
        if autopilot.body.on_ground and autopilot.spec.kind in (Kind.COPTER, Kind.PLANE):
            return NoThrust()
        if self._velocity is not None:
            if autopilot.now_s <= self._velocity_until_s:
                return self._velocity
            self.stop()
            if autopilot.spec.kind in SURFACE:
                text = "target not received last 3secs, stopping"
                autopilot.say(text, MAV_SEVERITY_WARNING)
        if self.destination is not None:
            return self._towards(self.destination)
        return self._turned(self._stay.step(dt_s))

    def _towards(self, destination: Point) -> MotionSetpoint:
        autopilot = self.autopilot
        match autopilot.spec.kind:
            case Kind.PLANE:
                radius_m = self.radius_m or autopilot.tuning.loiter_radius_m
                return CircleSetpoint(destination, radius_m, autopilot.modes.speed_mps)
            case Kind.ROVER | Kind.BOAT:
                if autopilot.position.distance_m(destination) <= autopilot.tuning.acceptance_m:
                    self.destination = None
                    self._stay = HoldPosition(autopilot)
                    self.aimed = autopilot.spec.kind is Kind.ROVER
                    autopilot.send(MAVLink_mission_item_reached_message(0))
                    return NoThrust()
        return self.reach(destination, yaw_rad=self.yaw_rad)

    def _turned(self, setpoint: MotionSetpoint) -> MotionSetpoint:
        if self.yaw_rad is not None and isinstance(setpoint, PositionSetpoint | VelocitySetpoint):
            return replace(setpoint, yaw_rad=self.yaw_rad)
        return setpoint


AHEAD_M = 3000.0
REACHED_M = 2.0


class PlaneTakeoff(Maneuver):
    """Begins as soon as it is armed; `taking_off` until it is at its height."""

    taking_off = True
    _goal: Point | None = None

    def begin(self) -> None:
        """Nothing yet: the heading is that of the moment at which it rolls."""
        self._stay = HoldPosition(self.autopilot)

    def step(self, dt_s: float) -> MotionSetpoint:
        """Up, then around."""
        autopilot = self.autopilot
        if self._goal is None:
            if autopilot.body.on_ground:
                autopilot.log_event("takeoff", "TAKEOFF")
            up_m = autopilot.home.point.up_m + autopilot.parameters["TKOFF_ALT"]
            self._goal = autopilot.position.moved(autopilot.body.yaw_rad, AHEAD_M).at_height(up_m)
        if self._goal.up_m - autopilot.body.up_m <= REACHED_M:
            self.taking_off = False
        return self.reach(self._goal) if self.taking_off else self._stay.step(dt_s)
