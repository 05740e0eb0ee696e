"""Staying with something that moves: one step of steering at a time."""

import math

import msgspec

from m2pem.simulation.course import turned
from m2pem.simulation.kinematics import Kinematics
from m2pem.simulation.segments import Pose, Steer, Vector, along
from m2pem.units import US_PER_S

STEP_S = 1.0
STEP_US = round(STEP_S * US_PER_S)
"""How often a pursuit looks where its target is."""

_SLOWEST_TURNING_M_S = 0.3
_STANDING_M_S = 0.05


class Pursuit(msgspec.Struct, frozen=True):
    """Keep a station: `offset_m` from the vehicle `target` at `bearing_rad` from its bow,
    clockwise. `up_m`: the height to keep."""

    target: str
    offset_m: float
    bearing_rad: float
    up_m: float
    speed_m_s: float

    def station(self, target: Pose) -> Vector:
        """Where to be when the target stands so."""
        direction = target.yaw - self.bearing_rad
        return (
            target.place[0] + self.offset_m * math.cos(direction),
            target.place[1] + self.offset_m * math.sin(direction),
            self.up_m,
        )


def steer(
    kinematics: Kinematics,
    pose: Pose,
    station: Vector,
    velocity: Vector,
    *,
    speed_m_s: float,
    standing_load: float,
) -> Steer:
    """One step towards a station that moves with `velocity`."""
    error = (station[0] - pose.place[0], station[1] - pose.place[1], station[2] - pose.place[2])
    decel = kinematics.deceleration_m_s2
    east, north = _approach(error[0], error[1], decel)
    east, north = _capped(velocity[0] + east, velocity[1] + north, speed_m_s)
    up = max(-kinematics.climb_rate_m_s, min(kinematics.climb_rate_m_s, error[2] / 2))
    change = (east - pose.velocity[0], north - pose.velocity[1], up - pose.velocity[2])
    size = math.hypot(*change)
    bound = kinematics.acceleration_m_s2 * STEP_S
    part = 1.0 if size <= bound else bound / size
    acceleration = along((0.0, 0.0, 0.0), change, part / STEP_S)
    yaw_rate = 0.0
    if math.hypot(east, north) > _SLOWEST_TURNING_M_S:
        sweep = turned(pose.yaw, math.atan2(north, east))
        bound = kinematics.turn_rate_rad_s
        yaw_rate = max(-bound, min(bound, sweep / STEP_S))
    stands = pose.speed < _STANDING_M_S and size < _STANDING_M_S
    return Steer(
        pose.place,
        pose.velocity,
        acceleration,
        pose.yaw,
        yaw_rate,
        # Longer than a step, so that the vehicle still moves at the moment of the next one.
        1.5 * STEP_S,
        standing_load if stands else 1.0,
    )


def _approach(east: float, north: float, decel: float) -> tuple[float, float]:
    """The speed at which one can still stop at the end of the error."""
    distance = math.hypot(east, north)
    if distance < 1e-9:
        return 0.0, 0.0
    speed = min(distance / 2, math.sqrt(decel * distance))
    return east / distance * speed, north / distance * speed


def _capped(east: float, north: float, bound: float) -> tuple[float, float]:
    size = math.hypot(east, north)
    return (east, north) if size <= bound else (east / size * bound, north / size * bound)
