"""How a plane moves: always forward, turning by banking, within its rates of climb and sink."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Reach, Rest
from m2pem_plugin_mavlink.sim.geometry import Point, towards, wrapped_rad
from m2pem_plugin_mavlink.sim.kinematics.copter import GRAVITY_MPS2

HEADING_GAIN = 1.5
"""Turning rate for an error of heading, per second."""


@dataclass(frozen=True, slots=True)
class PlaneKinematics:
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

    def step(self, body: Body, demand: Demand, dt_s: float) -> None:
        """Let `dt_s` pass."""
        course, up_mps, speed_mps = self._wanted(body, demand)
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

    def _turn(self, body: Body, course_rad: float, forward_mps: float, dt_s: float) -> None:
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

    def _wanted(self, body: Body, demand: Demand) -> tuple[float, float, float]:
        """Course, vertical and forward speed."""
        match demand:
            case Reach(point=point):
                rise_m = point.up_m - body.up_m
                up = max(-demand.descent_mps, min(demand.climb_mps, rise_m))
                return body.point.bearing_rad(point), up, demand.speed_mps
            case Circle(center=center):
                rise_m = center.up_m - body.up_m
                up = max(-self.climb_mps, min(self.climb_mps, rise_m))
                return self._around(body, center, demand), up, demand.speed_mps
            case Rest() if body.on_ground:
                return body.yaw_rad, 0.0, 0.0
            case Rest():
                # Without thrust it glides.
                return body.yaw_rad, -2.5, self.lift_off_mps
            case _ if body.on_ground:
                return body.yaw_rad, 0.0, 0.0
            case _:
                return body.yaw_rad, 0.0, self.cruise_mps

    def _around(self, body: Body, center: Point, demand: Circle) -> float:
        """The course along the circle, leaning in or out as it is off it."""
        smallest_m = demand.speed_mps**2 / (GRAVITY_MPS2 * math.tan(self.bank_rad))
        radius_m = max(abs(demand.radius_m), smallest_m)
        side = 1 if demand.radius_m >= 0 else -1
        outside_m = body.point.distance_m(center) - radius_m
        lean = math.atan(3 * outside_m / radius_m)
        # The heading follows the course with a lag, in which the course turns on.
        lag = demand.speed_mps / radius_m / HEADING_GAIN
        return center.bearing_rad(body.point) + side * (math.pi / 2 + lean + lag)
