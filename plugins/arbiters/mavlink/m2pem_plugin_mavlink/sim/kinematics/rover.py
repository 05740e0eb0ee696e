"""How a rover or boat moves: forward and backward, and in curves."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Drive, Go, Reach
from m2pem_plugin_mavlink.sim.geometry import towards, wrapped_rad
from m2pem_plugin_mavlink.sim.kinematics.copter import approach_mps

CREEP_MPS = 0.3
"""It cannot turn on the spot; facing away from where it is to go, it creeps around."""


@dataclass(frozen=True, slots=True)
class RoverKinematics:
    """A rover with steered wheels, or a boat."""

    acceleration_mps2: float = 1.5
    turn_rps: float = math.radians(90)
    turn_radius_m: float = 0.9
    fastest_mps: float = 10.0

    def step(self, body: Body, demand: Demand, dt_s: float) -> None:
        """Let `dt_s` pass."""
        forward = body.north_mps * math.cos(body.yaw_rad) + body.east_mps * math.sin(body.yaw_rad)
        speed, rate = self._wanted(body, demand, forward, dt_s)
        speed = max(-self.fastest_mps, min(self.fastest_mps, speed))
        forward = towards(forward, speed, self.acceleration_mps2 * dt_s)
        most_rps = min(self.turn_rps, abs(forward) / self.turn_radius_m)
        if isinstance(demand, Drive):
            # Told to turn, even a standing one does: it has tracks or thrusters.
            most_rps = self.turn_rps
        body.yaw_rps = max(-most_rps, min(most_rps, rate))
        body.yaw_rad = wrapped_rad(body.yaw_rad + body.yaw_rps * dt_s)
        body.north_mps = forward * math.cos(body.yaw_rad)
        body.east_mps = forward * math.sin(body.yaw_rad)
        body.north_m += body.north_mps * dt_s
        body.east_m += body.east_mps * dt_s
        body.up_m = body.up_mps = 0.0
        body.on_ground = True

    def _wanted(
        self, body: Body, demand: Demand, forward_mps: float, dt_s: float
    ) -> tuple[float, float]:
        """Forward speed and turning rate."""
        match demand:
            case Reach(point=point, reverse=reverse):
                distance_m = body.point.distance_m(point)
                speed = min(demand.speed_mps, approach_mps(distance_m, self.acceleration_mps2 / 2))
                bearing = body.point.bearing_rad(point) + (math.pi if reverse else 0.0)
                return self._along(body, bearing, speed, -1 if reverse else 1, dt_s)
            case Go():
                speed = math.hypot(demand.north_mps, demand.east_mps)
                if speed < 0.01:
                    return 0.0, demand.yaw_rps or 0.0
                bearing = math.atan2(demand.east_mps, demand.north_mps)
                return self._along(body, bearing, speed, 1, dt_s)
            case Drive():
                rate = demand.yaw_rps
                if demand.yaw_rad is not None:
                    rate = wrapped_rad(demand.yaw_rad - body.yaw_rad) / max(dt_s, 0.3)
                return demand.speed_mps, rate
            case Circle(center=center):
                radius_m = max(self.turn_radius_m, abs(demand.radius_m))
                side = 1 if demand.radius_m >= 0 else -1
                outside_m = body.point.distance_m(center) - radius_m
                lean = math.atan(outside_m / radius_m * 2)
                bearing = center.bearing_rad(body.point) + side * (math.pi / 2 + lean)
                return self._along(body, bearing, demand.speed_mps, 1, dt_s)
            case _:
                return 0.0, 0.0

    def _along(
        self, body: Body, bearing_rad: float, speed_mps: float, sign: int, dt_s: float
    ) -> tuple[float, float]:
        """Turn towards a heading; the more it is off, the slower it drives."""
        off = wrapped_rad(bearing_rad - body.yaw_rad)
        slow = max(0.0, math.cos(off)) ** 2
        speed = max(min(speed_mps, CREEP_MPS), speed_mps * slow)
        return sign * speed, off / max(dt_s, 0.3)
