"""The sensors of a simulated vehicle: odometry, battery and detector."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from random import Random

from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.simulator.dynamics import moved, wrapped_rad

NOWHERE = Pose(math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Inaccuracy:
    """`drift`: relative error of each metre, and rotation in radians for each metre. `noise_m`:
    standard deviation of each reading."""

    drift: float = 0.0
    noise_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Reading:
    """One odometry message. `time_us` is its stamp."""

    time_us: int
    pose: Pose
    twist: Twist


class Odometer:
    """Integrates the motion of a vehicle from `start`.

    Faults: `frozen` repeats the same reading, `nonsense` gives NaN.
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
        """Integrate a motion of `dt_s`."""
        self._twist = twist
        drift = self._inaccuracy.drift
        measured = Twist(
            twist.forward_m_s * (1 + drift), twist.yaw_rad_s + abs(twist.forward_m_s) * drift
        )
        self._pose = moved(self._pose, measured, dt_s)

    def jump(self, distance_m: float) -> None:
        """Jump to the left by a distance."""
        left = self._pose.yaw_rad + math.pi / 2
        self._pose = Pose(
            self._pose.east_m + distance_m * math.cos(left),
            self._pose.north_m + distance_m * math.sin(left),
            self._pose.yaw_rad,
            self._pose.up_m,
        )

    def read(self, time_us: int) -> Reading:
        """Return the current reading."""
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


FULL_V, EMPTY_V = 29.4, 21.0
LOW_FRACTION = 0.2
"""Below it the vehicle reports a problem."""


@dataclass(frozen=True, slots=True)
class Capacity:
    """The range of a full battery in metres, and its life in seconds if the vehicle stands."""

    range_m: float = 40_000.0
    standing_s: float = 24 * 3600.0


class Battery:
    """A battery that drains with distance and time. `fraction` is its charge, 0 to 1, and may be
    set."""

    def __init__(self, capacity: Capacity, fraction: float = 1.0) -> None:
        self._capacity = capacity
        self.fraction = fraction

    @property
    def voltage_v(self) -> float:
        """The voltage of seven cells in series, linear in the charge."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.fraction

    def drain(self, way_m: float, dt_s: float) -> None:
        """Drain for a distance that was driven in `dt_s`."""
        used = way_m / self._capacity.range_m + dt_s / self._capacity.standing_s
        self.fraction = max(0.0, self.fraction - used)


@dataclass(frozen=True, slots=True)
class Target:
    """Something that a detector can find, or has found, in the local frame of the fleet."""

    type: str
    east_m: float
    north_m: float


@dataclass(frozen=True, slots=True)
class DetectorSpec:
    """`payload`: its name in the fleet, or "". `topic`: as the vehicle resolves it. `type`: of
    detections that are made on request. `plain`: it publishes only types, as std_msgs/String."""

    payload: str = ""
    topic: str = "detections"
    type: str = "gpr"
    range_m: float = 5.0
    targets: Sequence[Target] = ()
    plain: bool = False


class Detector:
    """Finds each target within its range once."""

    def __init__(self, spec: DetectorSpec) -> None:
        self.spec = spec
        self._hidden = list(spec.targets)

    @property
    def hidden(self) -> int:
        """The number of targets that were not found yet."""
        return len(self._hidden)

    def find(self, pose: Pose) -> Iterator[Target]:
        """Yield the targets within the range."""
        if not self._hidden:
            return
        for target in list(self._hidden):
            distance_m = math.hypot(target.east_m - pose.east_m, target.north_m - pose.north_m)
            if distance_m <= self.spec.range_m:
                self._hidden.remove(target)
                yield target
