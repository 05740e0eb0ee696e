"""How vehicles move: a motion setpoint and a small time step in, a changed state of motion out."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.simulator.geometry import Point, towards, wrapped_rad
from m2pem_plugin_mavlink.simulator.specification import Kind


@dataclass(slots=True)
class BodyState:
    """The true position and motion, in metres from home (north, east, up), m/s and radians.

    Attitude as aircraft count it: yaw from north clockwise, pitch nose up, roll right.
    """

    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    north_mps: float = 0.0
    east_mps: float = 0.0
    up_mps: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_rps: float = 0.0
    on_ground: bool = True

    @property
    def point(self) -> Point:
        """The position."""
        return Point(self.north_m, self.east_m, self.up_m)

    @property
    def ground_speed_mps(self) -> float:
        """Over the ground, never negative."""
        return math.hypot(self.north_mps, self.east_mps)

    @property
    def moving(self) -> bool:
        """Whether it is faster than the noise of sensors."""
        return self.ground_speed_mps > 0.1 or abs(self.up_mps) > 0.1

    def stop(self) -> None:
        """Stop at once, level."""
        self.north_mps = self.east_mps = self.up_mps = self.yaw_rps = 0.0
        self.roll_rad = self.pitch_rad = 0.0


@dataclass(frozen=True, slots=True)
class NoThrust:
    """No thrust: a vehicle in the air falls, one that drives or floats stops."""


@dataclass(frozen=True, slots=True)
class PositionSetpoint:
    """Go to a point and stay there. A plane flies over it, and returns.

    `climb_mps` and `descent_mps` bound the vertical speed; `yaw_rad` None: face the way it goes;
    `reverse`: a rover drives there backwards.
    """

    point: Point
    speed_mps: float
    climb_mps: float = 2.5
    descent_mps: float = 1.5
    yaw_rad: float | None = None
    reverse: bool = False


@dataclass(frozen=True, slots=True)
class VelocitySetpoint:
    """Move with a velocity over the ground. Yaw: an angle, a rate, or (both None) the present one.

    A rover turns towards the velocity and drives on.
    """

    north_mps: float
    east_mps: float
    up_mps: float = 0.0
    yaw_rad: float | None = None
    yaw_rps: float | None = None


@dataclass(frozen=True, slots=True)
class CircleSetpoint:
    """Circle a point; a negative `radius_m` means counter-clockwise. Copters face the centre."""

    center: Point
    radius_m: float
    speed_mps: float


MotionSetpoint = NoThrust | PositionSetpoint | VelocitySetpoint | CircleSetpoint


GRAVITY_MPS2 = 9.80665
FALL_MPS = 8.0
"""How fast it comes down without thrust."""
FACING_M = 3.0
"""Nearer than that to where it goes, it no longer turns to face it."""


def approach_mps(distance_m: float, deceleration_mps2: float) -> float:
    """Return the speed from which to stop within a distance: proportional when near, by braking
    when far."""
    near_m = deceleration_mps2  # there, one metre more is one metre per second more
    if distance_m <= near_m:
        return distance_m
    return math.sqrt(2 * deceleration_mps2 * (distance_m - near_m / 2))


@dataclass(frozen=True, slots=True)
class CopterDynamics:
    """A multicopter."""

    acceleration_mps2: float = 3.0
    climb_mps2: float = 2.0
    turn_rps: float = math.radians(90)
    fastest_mps: float = 25.0
    fastest_climb_mps: float = 10.0

    def step(self, body: BodyState, setpoint: MotionSetpoint, dt_s: float) -> None:
        """Advance by `dt_s`."""
        north, east, up, yaw_rps = self._wanted(body, setpoint, dt_s)
        speed = math.hypot(north, east)
        if speed > self.fastest_mps:
            north, east = north / speed * self.fastest_mps, east / speed * self.fastest_mps
        up = max(-self.fastest_climb_mps, min(self.fastest_climb_mps, up))
        if body.on_ground and up <= 0:
            body.stop()
            return
        d_north, d_east = north - body.north_mps, east - body.east_mps
        change = math.hypot(d_north, d_east)
        component = min(1.0, self.acceleration_mps2 * dt_s / change) if change else 0.0
        body.north_mps += d_north * component
        body.east_mps += d_east * component
        falls = isinstance(setpoint, NoThrust) and not body.on_ground
        climb_mps2 = GRAVITY_MPS2 if falls else self.climb_mps2
        body.up_mps = towards(body.up_mps, up, climb_mps2 * dt_s)
        body.north_m += body.north_mps * dt_s
        body.east_m += body.east_mps * dt_s
        body.up_m += body.up_mps * dt_s
        body.yaw_rps = max(-self.turn_rps, min(self.turn_rps, yaw_rps))
        body.yaw_rad = wrapped_rad(body.yaw_rad + body.yaw_rps * dt_s)
        self._lean(body, d_north * component / dt_s, d_east * component / dt_s)
        body.on_ground = body.up_m <= 0 and body.up_mps <= 0
        if body.on_ground:
            body.up_m = 0.0
            body.stop()

    def _wanted(
        self, body: BodyState, setpoint: MotionSetpoint, dt_s: float
    ) -> tuple[float, float, float, float]:
        """Velocity north, east, up and turning rate."""
        match setpoint:
            case PositionSetpoint(point=point):
                distance_m = body.point.distance_m(point)
                speed = min(
                    setpoint.speed_mps, approach_mps(distance_m, self.acceleration_mps2 / 2)
                )
                bearing = body.point.bearing_rad(point)
                rise_m = point.up_m - body.up_m
                vertical = approach_mps(abs(rise_m), self.climb_mps2 / 2)
                up = (
                    min(vertical, setpoint.climb_mps)
                    if rise_m > 0
                    else -min(vertical, setpoint.descent_mps)
                )
                if body.on_ground and point.up_m <= 0:
                    up = 0.0
                yaw = setpoint.yaw_rad
                if yaw is None and distance_m > FACING_M:
                    yaw = bearing
                return (
                    speed * math.cos(bearing),
                    speed * math.sin(bearing),
                    up,
                    _turn(body, yaw, dt_s),
                )
            case VelocitySetpoint():
                turn = setpoint.yaw_rps
                return (
                    setpoint.north_mps,
                    setpoint.east_mps,
                    setpoint.up_mps,
                    _turn(body, setpoint.yaw_rad, dt_s) if turn is None else turn,
                )
            case CircleSetpoint(center=center):
                return self._around(body, setpoint, center, dt_s)
            case _:
                return 0.0, 0.0, -FALL_MPS, 0.0

    def _around(
        self, body: BodyState, setpoint: CircleSetpoint, center: Point, dt_s: float
    ) -> tuple[float, float, float, float]:
        radius_m = max(1.0, abs(setpoint.radius_m))
        side = 1 if setpoint.radius_m >= 0 else -1
        speed = min(setpoint.speed_mps, math.sqrt(self.acceleration_mps2 * radius_m))
        inward = body.point.bearing_rad(center)
        outside_m = body.point.distance_m(center) - radius_m
        closing = math.copysign(min(speed, approach_mps(abs(outside_m), 1.0)), outside_m)
        tangent = center.bearing_rad(body.point) + side * math.pi / 2
        slow = 1.0 if abs(outside_m) < radius_m / 4 else 0.2
        rise_m = center.up_m - body.up_m
        up = math.copysign(min(1.5, abs(rise_m)), rise_m)
        return (
            slow * speed * math.cos(tangent) + closing * math.cos(inward),
            slow * speed * math.sin(tangent) + closing * math.sin(inward),
            up,
            _turn(body, inward, dt_s),
        )

    def _lean(self, body: BodyState, north_mps2: float, east_mps2: float) -> None:
        """Tilt towards the acceleration."""
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        forward = north_mps2 * cos + east_mps2 * sin
        right = -north_mps2 * sin + east_mps2 * cos
        body.pitch_rad = -math.atan2(forward, GRAVITY_MPS2)
        body.roll_rad = math.atan2(right, GRAVITY_MPS2)


def _turn(body: BodyState, yaw_rad: float | None, dt_s: float) -> float:
    """The rate that brings it to a heading."""
    if yaw_rad is None:
        return 0.0
    return wrapped_rad(yaw_rad - body.yaw_rad) / max(dt_s, 0.3)


HEADING_GAIN = 1.5
"""Turning rate for an error of heading, per second."""


@dataclass(frozen=True, slots=True)
class PlaneDynamics:
    """A small fixed-wing aircraft in still air."""

    cruise_mps: float = 22.0
    lift_off_mps: float = 12.0
    fastest_mps: float = 40.0
    acceleration_mps2: float = 4.0
    braking_mps2: float = 3.0
    climb_mps: float = 5.0
    climb_mps2: float = 3.0
    bank_rad: float = math.radians(45)
    roll_rps: float = math.radians(75)

    def step(self, body: BodyState, setpoint: MotionSetpoint, dt_s: float) -> None:
        """Advance by `dt_s`."""
        course, up_mps, speed_mps = self._wanted(body, setpoint)
        forward = body.ground_speed_mps
        faster = speed_mps > forward
        change = (self.acceleration_mps2 if faster else self.braking_mps2) * dt_s
        if not body.on_ground:
            # It must not become so slow that it falls.
            speed_mps = max(speed_mps, self.lift_off_mps)
        forward = towards(forward, min(speed_mps, self.fastest_mps), change)
        if body.on_ground and (forward < self.lift_off_mps or up_mps <= 0):
            course, up_mps = body.yaw_rad, 0.0
        self._turn(body, course, forward, dt_s)
        body.up_mps = towards(body.up_mps, up_mps, self.climb_mps2 * dt_s)
        body.north_mps = forward * math.cos(body.yaw_rad)
        body.east_mps = forward * math.sin(body.yaw_rad)
        body.north_m += body.north_mps * dt_s
        body.east_m += body.east_mps * dt_s
        body.up_m += body.up_mps * dt_s
        body.pitch_rad = math.atan2(body.up_mps, max(forward, 1.0))
        body.on_ground = body.up_m <= 0 and body.up_mps <= 0
        if body.on_ground:
            body.up_m = body.up_mps = body.roll_rad = body.pitch_rad = 0.0

    def _turn(self, body: BodyState, course_rad: float, forward_mps: float, dt_s: float) -> None:
        """Bank towards the course; the bank gives the rate of turn."""
        if body.on_ground:
            body.roll_rad = body.yaw_rps = 0.0
            return
        rate = HEADING_GAIN * wrapped_rad(course_rad - body.yaw_rad)
        bank = math.atan(rate * forward_mps / GRAVITY_MPS2)
        bank = max(-self.bank_rad, min(self.bank_rad, bank))
        body.roll_rad = towards(body.roll_rad, bank, self.roll_rps * dt_s)
        body.yaw_rps = GRAVITY_MPS2 * math.tan(body.roll_rad) / max(forward_mps, 1.0)
        body.yaw_rad = wrapped_rad(body.yaw_rad + body.yaw_rps * dt_s)

    def _wanted(self, body: BodyState, setpoint: MotionSetpoint) -> tuple[float, float, float]:
        """Course, vertical and forward speed."""
        match setpoint:
            case PositionSetpoint(point=point):
                rise_m = point.up_m - body.up_m
                up = max(-setpoint.descent_mps, min(setpoint.climb_mps, rise_m))
                return body.point.bearing_rad(point), up, setpoint.speed_mps
            case CircleSetpoint(center=center):
                rise_m = center.up_m - body.up_m
                up = max(-self.climb_mps, min(self.climb_mps, rise_m))
                return self._around(body, center, setpoint), up, setpoint.speed_mps
            case NoThrust() if body.on_ground:
                return body.yaw_rad, 0.0, 0.0
            case NoThrust():
                # Without thrust it glides.
                return body.yaw_rad, -2.5, self.lift_off_mps
            case _ if body.on_ground:
                return body.yaw_rad, 0.0, 0.0
            case _:
                return body.yaw_rad, 0.0, self.cruise_mps

    def _around(self, body: BodyState, center: Point, setpoint: CircleSetpoint) -> float:
        """The course along the circle, leaning in or out as it is off it."""
        smallest_m = setpoint.speed_mps**2 / (GRAVITY_MPS2 * math.tan(self.bank_rad))
        radius_m = max(abs(setpoint.radius_m), smallest_m)
        side = 1 if setpoint.radius_m >= 0 else -1
        outside_m = body.point.distance_m(center) - radius_m
        lean = math.atan(3 * outside_m / radius_m)
        # The heading follows the course with a lag, in which the course turns on.
        lag = setpoint.speed_mps / radius_m / HEADING_GAIN
        return center.bearing_rad(body.point) + side * (math.pi / 2 + lean + lag)


CREEP_MPS = 0.3
"""It cannot turn on the spot; facing away from where it is to go, it creeps around."""


@dataclass(frozen=True, slots=True)
class RoverDynamics:
    """A rover with steered wheels, or a boat."""

    acceleration_mps2: float = 1.5
    turn_rps: float = math.radians(90)
    turn_radius_m: float = 0.9
    fastest_mps: float = 10.0

    def step(self, body: BodyState, setpoint: MotionSetpoint, dt_s: float) -> None:
        """Advance by `dt_s`."""
        forward = body.north_mps * math.cos(body.yaw_rad) + body.east_mps * math.sin(body.yaw_rad)
        speed, rate = self._wanted(body, setpoint, forward, dt_s)
        speed = max(-self.fastest_mps, min(self.fastest_mps, speed))
        forward = towards(forward, speed, self.acceleration_mps2 * dt_s)
        most_rps = min(self.turn_rps, abs(forward) / self.turn_radius_m)
        body.yaw_rps = max(-most_rps, min(most_rps, rate))
        body.yaw_rad = wrapped_rad(body.yaw_rad + body.yaw_rps * dt_s)
        body.north_mps = forward * math.cos(body.yaw_rad)
        body.east_mps = forward * math.sin(body.yaw_rad)
        body.north_m += body.north_mps * dt_s
        body.east_m += body.east_mps * dt_s
        body.up_m = body.up_mps = 0.0
        body.on_ground = True

    def _wanted(
        self, body: BodyState, setpoint: MotionSetpoint, forward_mps: float, dt_s: float
    ) -> tuple[float, float]:
        """Forward speed and turning rate."""
        match setpoint:
            case PositionSetpoint(point=point, reverse=reverse):
                distance_m = body.point.distance_m(point)
                speed = min(
                    setpoint.speed_mps, approach_mps(distance_m, self.acceleration_mps2 / 2)
                )
                bearing = body.point.bearing_rad(point) + (math.pi if reverse else 0.0)
                return self._along(body, bearing, speed, -1 if reverse else 1, dt_s)
            case VelocitySetpoint():
                speed = math.hypot(setpoint.north_mps, setpoint.east_mps)
                if speed < 0.01:
                    return 0.0, setpoint.yaw_rps or 0.0
                bearing = math.atan2(setpoint.east_mps, setpoint.north_mps)
                return self._along(body, bearing, speed, 1, dt_s)
            case CircleSetpoint(center=center):
                radius_m = max(self.turn_radius_m, abs(setpoint.radius_m))
                side = 1 if setpoint.radius_m >= 0 else -1
                outside_m = body.point.distance_m(center) - radius_m
                lean = math.atan(outside_m / radius_m * 2)
                bearing = center.bearing_rad(body.point) + side * (math.pi / 2 + lean)
                return self._along(body, bearing, setpoint.speed_mps, 1, dt_s)
            case _:
                return 0.0, 0.0

    def _along(
        self, body: BodyState, bearing_rad: float, speed_mps: float, sign: int, dt_s: float
    ) -> tuple[float, float]:
        """Turn towards a heading; the more it is off, the slower it drives."""
        off = wrapped_rad(bearing_rad - body.yaw_rad)
        slow = max(0.0, math.cos(off)) ** 2
        speed = max(min(speed_mps, CREEP_MPS), speed_mps * slow)
        return sign * speed, off / max(dt_s, 0.3)


Dynamics = CopterDynamics | PlaneDynamics | RoverDynamics


def dynamics_of(kind: Kind) -> Dynamics:
    """Return the dynamics of a kind of vehicle."""
    match kind:
        case Kind.COPTER:
            return CopterDynamics()
        case Kind.PLANE:
            return PlaneDynamics()
        case Kind.ROVER:
            return RoverDynamics()
        case Kind.BOAT:
            return RoverDynamics(acceleration_mps2=0.8, turn_radius_m=2.0)
