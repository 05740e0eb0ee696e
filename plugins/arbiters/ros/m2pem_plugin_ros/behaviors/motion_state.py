"""What the pilot is shown, what a motion wishes, and what the pilot says."""

import math
from dataclasses import dataclass
from typing import TypeAlias
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds


@dataclass(frozen=True, slots=True)
class Target:
    """Another vehicle, in the local frame; `age_s`: how long ago it said so."""

    pose: Pose
    east_m_s: float = 0.0
    north_m_s: float = 0.0
    age_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Seen:
    """What is known at one moment. `now_s` never goes back. `age_s`: of `pose` and `twist`.

    `target`: the vehicle that `Pilot.target` names; None: nothing is known of it. `stick`: what an
    operator wants, `stick_age_s` seconds ago.
    """

    now_s: float
    pose: Pose | None
    twist: Twist | None = None
    age_s: float = 0.0
    target: Target | None = None
    stick: Twist | None = None
    stick_age_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Scene:
    """What a motion is shown: all of it is there, and can be trusted.

    `dt_s`: since the last step, not counting a hold. `speed_m_s`: forward, negative backwards.
    `stands`: it is at a stand. `stick` None: the operator's stick is not heard.
    """

    dt_s: float
    pose: Pose
    speed_m_s: float
    stands: bool
    bounds: Bounds
    target: Target | None = None
    stick: Twist | None = None


@dataclass(frozen=True, slots=True)
class Wish:
    """How a motion wants the base to move; the governor makes of it what the base can do.

    The yaw rate is `curvature_1_m` (positive to the left) times the speed that comes of it, plus
    `yaw_rate_rad_s`, which only a base that turns on the spot can have.
    """

    speed_m_s: float = 0.0
    curvature_1_m: float = 0.0
    yaw_rate_rad_s: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether it is one to move at all."""
        return self.speed_m_s != 0.0 or self.yaw_rate_rad_s != 0.0


STAND = Wish()


@dataclass(frozen=True, slots=True)
class Ending:
    """How a motion ends; `state` is terminal. The base is brought to a stand before it is told."""

    state: BehaviorState = BehaviorState.SUCCEEDED
    code: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """What is to be done now. `twist` None: nothing is to be sent, others may use the base.

    `goal` has ended so, if `ending` is given.
    """

    twist: Twist | None
    goal: UUID | None = None
    ending: Ending | None = None


class RefusedError(Exception):
    """It cannot be done; the text says why."""


Place: TypeAlias = tuple[float, float]
"""East and north, in metres, of the fleet's local frame."""


def turned(from_rad: float, to_rad: float) -> float:
    """The short way from one direction to another: positive is counter-clockwise."""
    return math.remainder(to_rad - from_rad, math.tau)


def place_of(pose: Pose) -> Place:
    """Where a pose is."""
    return pose.east_m, pose.north_m


def beyond(place: Place, yaw_rad: float, distance_m: float) -> Place:
    """The place so far away in a direction."""
    return (
        place[0] + distance_m * math.cos(yaw_rad),
        place[1] + distance_m * math.sin(yaw_rad),
    )


def yaw_towards(start: Place, end: Place) -> float:
    """The direction in which `end` lies."""
    return math.atan2(end[1] - start[1], end[0] - start[0])


FARTHEST_M = 1e6
FASTEST = 1e3
"""What is farther from the origin, or faster in m/s or rad/s, is no pose or twist of a base."""


def sane_pose(pose: Pose | None) -> Pose | None:
    """The pose, unless something in it is no number, or none that can be."""
    if pose is None or not math.isfinite(pose.yaw_rad):
        return None
    return pose if _within(FARTHEST_M, pose.east_m, pose.north_m) else None


def sane_twist(twist: Twist | None) -> Twist | None:
    """The twist, unless something in it is no number, or none that can be."""
    if twist is None or not _within(FASTEST, twist.forward_m_s, twist.yaw_rad_s):
        return None
    return twist


def _within(bound: float, *numbers: float) -> bool:
    return all(-bound <= number <= bound for number in numbers)  # not if it is no number
