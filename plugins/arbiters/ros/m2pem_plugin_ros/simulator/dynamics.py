"""The dynamics of a base on wheels or on water."""

import math
from dataclasses import dataclass

from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

STANDS_M_S = 1e-3
"""A base slower than this, in m/s and rad/s, stands."""


@dataclass(frozen=True, slots=True)
class Chassis:
    """The capabilities of a base, in SI units.

    `turn_radius_m` 0: the base turns on the spot. `lag_s`: time constant of the drives (first
    order). `command_timeout_s`: without a command for this time, the base stops.
    """

    speed_m_s: float = 2.0
    reverse_m_s: float = 1.0
    acceleration_m_s2: float = 1.0
    yaw_rate_rad_s: float = 1.0
    yaw_acceleration_rad_s2: float = 2.0
    turn_radius_m: float = 0.0
    lag_s: float = 0.1
    command_timeout_s: float = 0.5


def limits(of: Chassis | Bounds) -> dict[str, float]:
    """Return the limits that a chassis and the settings of a base have both."""
    same = ("speed_m_s", "reverse_m_s", "acceleration_m_s2", "yaw_rate_rad_s", "turn_radius_m")
    return {name: getattr(of, name) for name in same}


class Dynamics:
    """A base in the plane. Times are in simulated seconds.

    `stuck`: the wheels turn in vain. `motions` counts how often the base started to move from a
    stand. `driven_m` is the distance driven.
    """

    def __init__(self, chassis: Chassis, pose: Pose) -> None:
        self.chassis = chassis
        self.pose = pose
        self.stuck = False
        self.motions = 0
        self.driven_m = 0.0
        self.twist = Twist()
        self._command = Twist()
        self._commanded_s = -math.inf
        self._wanted = Twist()
        self.stands = True
        """Whether the base neither moves nor is commanded to."""

    def command(self, twist: Twist, now_s: float) -> None:
        """Process a command. Commands that are not finite are ignored."""
        if math.isfinite(twist.forward_m_s) and math.isfinite(twist.yaw_rad_s):
            self._command, self._commanded_s = twist, now_s

    def step(self, now_s: float, dt_s: float) -> None:
        """Advance by `dt_s` to `now_s`."""
        requested = self._requested_twist(now_s)
        if self.stands:
            if not _moves(requested):
                return
            self.stands = False
            self.motions += 1
        self._follow(requested, dt_s)
        self._move(dt_s)
        if not (_moves(requested) or _moves(self.twist) or _moves(self._wanted)):
            self.stands, self.twist, self._wanted = True, Twist(), Twist()

    def _requested_twist(self, now_s: float) -> Twist:
        """Return the bounded command; zero if it is old, or the wheels are stuck."""
        chassis, command = self.chassis, self._command
        if self.stuck or now_s - self._commanded_s > chassis.command_timeout_s:
            return Twist()
        forward = _within(-chassis.reverse_m_s, command.forward_m_s, chassis.speed_m_s)
        yaw = _within(-chassis.yaw_rate_rad_s, command.yaw_rad_s, chassis.yaw_rate_rad_s)
        if chassis.turn_radius_m > 0 and abs(forward) < STANDS_M_S:
            yaw = 0.0  # steered wheels that stand turn nothing
        return Twist(forward, yaw)

    def _follow(self, requested: Twist, dt_s: float) -> None:
        chassis = self.chassis
        share = 1.0 if chassis.lag_s <= 0 else 1.0 - math.exp(-dt_s / chassis.lag_s)
        self._wanted = Twist(
            _lagged(self._wanted.forward_m_s, requested.forward_m_s, share),
            _lagged(self._wanted.yaw_rad_s, requested.yaw_rad_s, share),
        )
        forward = _towards(
            self.twist.forward_m_s, self._wanted.forward_m_s, chassis.acceleration_m_s2 * dt_s
        )
        yaw = _towards(
            self.twist.yaw_rad_s, self._wanted.yaw_rad_s, chassis.yaw_acceleration_rad_s2 * dt_s
        )
        if chassis.turn_radius_m > 0:
            most = abs(forward) / chassis.turn_radius_m
            yaw = _within(-most, yaw, most)
        self.twist = Twist(forward, yaw)

    def _move(self, dt_s: float) -> None:
        self.pose = moved(self.pose, self.twist, dt_s)
        self.driven_m += abs(self.twist.forward_m_s) * dt_s


def moved(pose: Pose, twist: Twist, dt_s: float) -> Pose:
    """Return the pose after `dt_s`, by one straight step in the mean direction."""
    turn = twist.yaw_rad_s * dt_s
    way = twist.forward_m_s * dt_s
    middle = pose.yaw_rad + turn / 2
    return Pose(
        pose.east_m + way * math.cos(middle),
        pose.north_m + way * math.sin(middle),
        wrapped_rad(pose.yaw_rad + turn),
        pose.up_m,
    )


def wrapped_rad(angle: float) -> float:
    """Return the same direction, from -pi to pi."""
    return math.remainder(angle, math.tau)


def _moves(twist: Twist) -> bool:
    return abs(twist.forward_m_s) > STANDS_M_S or abs(twist.yaw_rad_s) > STANDS_M_S


def _within(least: float, value: float, most: float) -> float:
    return max(least, min(most, value))


def _towards(value: float, wanted: float, step: float) -> float:
    return value + _within(-step, wanted - value, step)


def _lagged(value: float, wanted: float, share: float) -> float:
    after = value + (wanted - value) * share
    return wanted if abs(wanted - after) < STANDS_M_S / 10 else after
