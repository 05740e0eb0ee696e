"""How a copter moves: any way it likes, within limits of acceleration and of turning."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Drive, Go, Reach
from m2pem_plugin_mavlink.sim.geometry import Point, towards, wrapped_rad

GRAVITY_MPS2 = 9.80665
FALL_MPS = 8.0
"""How fast it comes down without thrust."""
FACING_M = 3.0
"""Nearer than that to where it goes, it no longer turns to face it."""


def approach_mps(distance_m: float, deceleration_mps2: float, gain: float = 1.0) -> float:
    """How fast to be, to come to rest after a distance: proportional near, by braking afar."""
    near_m = deceleration_mps2 / gain**2
    if distance_m <= near_m:
        return gain * distance_m
    return math.sqrt(2 * deceleration_mps2 * (distance_m - near_m / 2))


@dataclass(frozen=True, slots=True)
class CopterKinematics:
    """A multicopter."""

    acceleration_mps2: float = 3.0
    climb_mps2: float = 2.0
    turn_rps: float = math.radians(90)
    fastest_mps: float = 25.0
    fastest_climb_mps: float = 10.0

    def step(self, body: Body, demand: Demand, dt_s: float) -> None:
        """Let `dt_s` pass."""
        north, east, up, yaw_rps = self._wanted(body, demand, dt_s)
        speed = math.hypot(north, east)
        if speed > self.fastest_mps:
            north, east = north / speed * self.fastest_mps, east / speed * self.fastest_mps
        up = max(-self.fastest_climb_mps, min(self.fastest_climb_mps, up))
        if body.on_ground and up <= 0:
            body.stop()
            return
        d_north, d_east = north - body.north_mps, east - body.east_mps
        change = math.hypot(d_north, d_east)
        part = min(1.0, self.acceleration_mps2 * dt_s / change) if change else 0.0
        body.north_mps += d_north * part
        body.east_mps += d_east * part
        body.up_mps = towards(body.up_mps, up, self.climb_mps2 * dt_s)
        body.north_m += body.north_mps * dt_s
        body.east_m += body.east_mps * dt_s
        body.up_m += body.up_mps * dt_s
        body.yaw_rps = max(-self.turn_rps, min(self.turn_rps, yaw_rps))
        body.yaw_rad = wrapped_rad(body.yaw_rad + body.yaw_rps * dt_s)
        self._lean(body, d_north * part / dt_s, d_east * part / dt_s)
        body.on_ground = body.up_m <= 0 and body.up_mps <= 0
        if body.on_ground:
            body.up_m = 0.0
            body.stop()

    def _wanted(self, body: Body, demand: Demand, dt_s: float) -> tuple[float, float, float, float]:
        """Velocity north, east, up and turning rate."""
        match demand:
            case Reach(point=point):
                distance_m = body.point.distance_m(point)
                speed = min(demand.speed_mps, approach_mps(distance_m, self.acceleration_mps2 / 2))
                bearing = body.point.bearing_rad(point)
                rise_m = point.up_m - body.up_m
                vertical = approach_mps(abs(rise_m), self.climb_mps2 / 2)
                up = (
                    min(vertical, demand.climb_mps)
                    if rise_m > 0
                    else -min(vertical, demand.descent_mps)
                )
                if body.on_ground and point.up_m <= 0:
                    up = 0.0
                yaw = demand.yaw_rad
                if yaw is None and distance_m > FACING_M:
                    yaw = bearing
                return (
                    speed * math.cos(bearing),
                    speed * math.sin(bearing),
                    up,
                    _turn(body, yaw, dt_s),
                )
            case Go():
                turn = demand.yaw_rps
                return (
                    demand.north_mps,
                    demand.east_mps,
                    demand.up_mps,
                    _turn(body, demand.yaw_rad, dt_s) if turn is None else turn,
                )
            case Drive(speed_mps=speed):
                return (
                    speed * math.cos(body.yaw_rad),
                    speed * math.sin(body.yaw_rad),
                    0.0,
                    demand.yaw_rps,
                )
            case Circle(center=center):
                return self._around(body, demand, center, dt_s)
            case _:
                return 0.0, 0.0, -FALL_MPS, 0.0

    def _around(
        self, body: Body, demand: Circle, center: Point, dt_s: float
    ) -> tuple[float, float, float, float]:
        radius_m = max(1.0, abs(demand.radius_m))
        side = 1 if demand.radius_m >= 0 else -1
        speed = min(demand.speed_mps, math.sqrt(self.acceleration_mps2 * radius_m))
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

    def _lean(self, body: Body, north_mps2: float, east_mps2: float) -> None:
        """It leans into what accelerates it."""
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        forward = north_mps2 * cos + east_mps2 * sin
        right = -north_mps2 * sin + east_mps2 * cos
        body.pitch_rad = -math.atan2(forward, GRAVITY_MPS2)
        body.roll_rad = math.atan2(right, GRAVITY_MPS2)


def _turn(body: Body, yaw_rad: float | None, dt_s: float) -> float:
    """The rate that brings it to a heading."""
    if yaw_rad is None:
        return 0.0
    return wrapped_rad(yaw_rad - body.yaw_rad) / max(dt_s, 0.3)
