"""Where a vehicle believes to be: its odometry, with drift, noise and faults."""

import math
from dataclasses import dataclass
from random import Random

from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.sim.body import moved, wrapped_rad

NOWHERE = Pose(math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Inaccuracy:
    """`drift`: so much of each metre is measured wrong, and as many radians a metre is it turned.
    `noise_m`: standard deviation of each reading."""

    drift: float = 0.0
    noise_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Reading:
    """One message's worth. `time_us`: its stamp."""

    time_us: int
    pose: Pose
    twist: Twist


class Odometer:
    """Counts the way of a vehicle from `start`.

    Faults: `frozen` says the same again and again, `nonsense` says NaN.
    """

    def __init__(self, start: Pose, inaccuracy: Inaccuracy, random: Random) -> None:
        self.frozen = False
        self.nonsense = False
        self._pose = start
        self._twist = Twist()
        self._inaccuracy = inaccuracy
        self._random = random
        self._last: Reading | None = None

    def step(self, twist: Twist, dt_s: float) -> None:
        """The vehicle moved like that for `dt_s`."""
        self._twist = twist
        drift = self._inaccuracy.drift
        measured = Twist(
            twist.forward_m_s * (1 + drift), twist.yaw_rad_s + abs(twist.forward_m_s) * drift
        )
        self._pose = moved(self._pose, measured, dt_s)

    def jump(self, distance_m: float) -> None:
        """Believe all at once to be elsewhere, to the left."""
        left = self._pose.yaw_rad + math.pi / 2
        self._pose = Pose(
            self._pose.east_m + distance_m * math.cos(left),
            self._pose.north_m + distance_m * math.sin(left),
            self._pose.yaw_rad,
            self._pose.up_m,
        )

    def read(self, time_us: int) -> Reading:
        """What it says now."""
        if self.frozen and self._last is not None:
            return self._last
        pose = NOWHERE if self.nonsense else self._noisy(self._pose)
        self._last = Reading(time_us, pose, self._twist)
        return self._last

    def _noisy(self, pose: Pose) -> Pose:
        noise_m = self._inaccuracy.noise_m
        if noise_m <= 0:
            return pose
        gauss = self._random.gauss
        return Pose(
            pose.east_m + gauss(0, noise_m),
            pose.north_m + gauss(0, noise_m),
            wrapped_rad(pose.yaw_rad + gauss(0, noise_m / 10)),
            pose.up_m,
        )
