"""Data types of motions, and geometry in the local plane."""

import math
from dataclasses import dataclass
from typing import TypeAlias
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds


@dataclass(frozen=True, slots=True)
class Target:
    """The state of another vehicle in the local frame, `age_s` seconds old."""

    pose: Pose
    east_m_s: float = 0.0
    north_m_s: float = 0.0
    age_s: float = 0.0

    @property
    def place(self) -> "Place":
        """Where it is by now, at its velocity."""
        east_m = self.pose.east_m + self.east_m_s * self.age_s
        return east_m, self.pose.north_m + self.north_m_s * self.age_s


@dataclass(frozen=True, slots=True)
class Observation:
    """The input of `Pilot.step`. `now_s` never decreases. `age_s` is the age of `pose` and `twist`.

    `target` is the vehicle that `Pilot.target` names, or None if it is not known. `joystick` is the
    last command of the operator, `joystick_age_s` seconds old.
    """

    now_s: float
    pose: Pose | None
    twist: Twist | None = None
    age_s: float = 0.0
    target: Target | None = None
    joystick: Twist | None = None
    joystick_age_s: float = 0.0


@dataclass(frozen=True, slots=True)
class MotionState:
    """The input of a motion, checked by the pilot.

    `dt_s`: time since the last step, without holds. `speed_m_s`: forward; negative backwards.
    `stands`: the base does not move. `joystick` None: there is no recent command of the operator.
    """

    dt_s: float
    pose: Pose
    speed_m_s: float
    stands: bool
    bounds: Bounds
    target: Target | None = None
    joystick: Twist | None = None


@dataclass(frozen=True, slots=True)
class DesiredMotion:
    """The motion that a behavior asks for. `VelocityLimiter` makes a command of it.

    The yaw rate is `curvature_1_m` (positive to the left) times the resulting speed, plus
    `yaw_rate_rad_s`, which applies only to a base that turns on the spot.
    """

    speed_m_s: float = 0.0
    curvature_1_m: float = 0.0
    yaw_rate_rad_s: float = 0.0

    @property
    def moves(self) -> bool:
        return self.speed_m_s != 0.0 or self.yaw_rate_rad_s != 0.0


STANDSTILL = DesiredMotion()


@dataclass(frozen=True, slots=True)
class Ending:
    """How a motion ends. The base stops before the ending is reported. `state` is terminal."""

    state: BehaviorState = BehaviorState.SUCCEEDED
    code: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """The output of `Pilot.step`. With `twist` None, nothing is published, and others may command
    the base. With `ending`, the goal has ended."""

    twist: Twist | None
    goal: UUID | None = None
    ending: Ending | None = None


class RefusedError(Exception):
    """The behavior cannot be done; the text says why."""


Place: TypeAlias = tuple[float, float]
"""East and north in the local frame, in metres."""


def angle_between(from_rad: float, to_rad: float) -> float:
    """Return the shortest rotation from one direction to another; positive is counter-clockwise."""
    return math.remainder(to_rad - from_rad, math.tau)


def position_of(pose: Pose) -> Place:
    return pose.east_m, pose.north_m


def point_beyond(place: Place, yaw_rad: float, distance_m: float) -> Place:
    """Return the position at a distance in a direction."""
    return (place[0] + distance_m * math.cos(yaw_rad), place[1] + distance_m * math.sin(yaw_rad))


def direction_to(start: Place, end: Place) -> float:
    """Return the direction from `start` to `end`."""
    return math.atan2(end[1] - start[1], end[0] - start[0])


FARTHEST_M = 1e6
FASTEST = 1e3
"""Poses farther from the origin, and twists faster than this in m/s or rad/s, are invalid."""


def sane_pose(pose: Pose | None) -> Pose | None:
    """Return the pose, or None if it is missing or invalid."""
    if pose is None or not math.isfinite(pose.yaw_rad):
        return None
    return pose if _within(FARTHEST_M, pose.east_m, pose.north_m) else None


def sane_twist(twist: Twist | None) -> Twist | None:
    """Return the twist, or None if it is missing or invalid."""
    if twist is None or not _within(FASTEST, twist.forward_m_s, twist.yaw_rad_s):
        return None
    return twist


def _within(bound: float, *numbers: float) -> bool:
    return all(-bound <= number <= bound for number in numbers)  # False for NaN
