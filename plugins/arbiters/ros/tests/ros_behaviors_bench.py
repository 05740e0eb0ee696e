"""A base on a plane for the tests of the pilot: it does what it is told, some time later."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from uuid import UUID

from m2pem_plugin_ros.behaviors import (
    Ending,
    LocalParameters,
    Observation,
    Pilot,
    Step,
    Target,
    make_motion,
)
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

from m2pem.api import Point, ResolvedValue, Route

DT_S = 0.05
GOAL = UUID("0b0f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f11")
TURNS_ON_THE_SPOT = Bounds()
LIKE_A_CAR = Bounds(turn_radius_m=3.0, speed_m_s=3.0)

Place = tuple[float, float]


def route(places: Sequence[Place]) -> Route:
    """A route of local places, for a frame in which they are latitudes and longitudes."""
    return Route(tuple((east, north, None) for east, north in places))


def point(place: Place) -> Point:
    """The same for one place."""
    return Point((*place, None))


@dataclass
class Dynamics:
    """Speed and yaw rate follow the command with a lag, as on a real base."""

    pose: Pose = field(default_factory=lambda: Pose(0.0, 0.0, 0.0))
    twist: Twist = field(default_factory=Twist)
    lag_s: float = 0.15
    stuck: bool = False

    def move(self, command: Twist, dt_s: float) -> None:
        part = 1.0 - math.exp(-dt_s / self.lag_s)
        speed = self.twist.forward_m_s + part * (command.forward_m_s - self.twist.forward_m_s)
        rate = self.twist.yaw_rad_s + part * (command.yaw_rad_s - self.twist.yaw_rad_s)
        if self.stuck:
            speed = rate = 0.0
        yaw = self.pose.yaw_rad + rate * dt_s / 2
        self.pose = Pose(
            self.pose.east_m + speed * math.cos(yaw) * dt_s,
            self.pose.north_m + speed * math.sin(yaw) * dt_s,
            math.remainder(self.pose.yaw_rad + rate * dt_s, math.tau),
        )
        self.twist = Twist(speed, rate)


class Road:
    """A pilot that drives a body. Every command is checked against the bounds."""

    def __init__(
        self,
        bounds: Bounds = TURNS_ON_THE_SPOT,
        body: Dynamics | None = None,
        outside_m: Callable[[Place], float] | None = None,
    ) -> None:
        self.bounds = bounds
        self.body = body or Dynamics()
        self.pilot = Pilot(bounds, outside_m)
        self.now_s = 100.0
        self.commands: list[Twist] = []
        self.driven: list[Pose] = [self.body.pose]
        self.ending: Ending | None = None
        self.target: Callable[[float], Target | None] = lambda _: None
        self.joystick: Twist | None = None
        self.joystick_age_s = 0.0
        self.age_s = 0.0
        self.seen_pose: Callable[[Pose], Pose | None] = lambda pose: pose
        self._last = Twist()

    def begin(self, behavior: str, **parameters: ResolvedValue) -> None:
        self.ending = None
        self.pilot.begin(GOAL, make_motion(behavior, self.local(parameters), self.bounds))

    def local(self, parameters: Mapping[str, ResolvedValue]) -> LocalParameters:
        return LocalParameters(parameters, lambda east, north: (east, north), "self")

    def step(self) -> Step:
        self.now_s += DT_S
        seen = Observation(
            self.now_s,
            self.seen_pose(self.body.pose),
            self.body.twist,
            self.age_s,
            self.target(self.now_s),
            self.joystick,
            self.joystick_age_s,
        )
        step = self.pilot.step(seen)
        command = step.twist or Twist()
        self._check(command, halted=self.age_s > 0.5)
        self.commands.append(command)
        self.body.move(command, DT_S)
        self.driven.append(self.body.pose)
        if step.ending is not None:
            assert step.goal == GOAL
            assert self.ending is None
            self.ending = step.ending
        return step

    def drive(self, seconds: float) -> None:
        for _ in range(round(seconds / DT_S)):
            self.step()

    def until(self, condition: Callable[[], object], within_s: float = 600.0) -> None:
        deadline = self.now_s + within_s
        while not condition():
            assert self.now_s < deadline, f"not within {within_s} s: {self.body}"
            self.step()

    def until_ended(self, within_s: float = 600.0) -> Ending:
        self.until(lambda: self.ending, within_s)
        assert self.ending is not None
        return self.ending

    def away(self, place: Place) -> float:
        return math.dist((self.body.pose.east_m, self.body.pose.north_m), place)

    def _check(self, command: Twist, *, halted: bool) -> None:
        bounds, slack = self.bounds, 1e-9
        speed, rate = command.forward_m_s, command.yaw_rad_s
        assert math.isfinite(speed)
        assert math.isfinite(rate)
        assert -bounds.reverse_m_s - slack <= speed <= bounds.speed_m_s + slack
        assert abs(rate) <= bounds.yaw_rate_rad_s + slack
        assert abs(rate * speed) <= bounds.lateral_m_s2 + slack
        if bounds.turn_radius_m > 0:
            assert abs(rate) * bounds.turn_radius_m <= abs(speed) + slack
        if not halted and not (speed == 0.0 and rate == 0.0):
            change = abs(speed - self._last.forward_m_s)
            assert change <= bounds.acceleration_m_s2 * DT_S + slack
        self._last = command


def off_path(place: Place, places: Sequence[Place]) -> float:
    """How far a place is from a path."""
    nearest = math.inf
    for (ae, an), (be, bn) in pairwise(places):
        length2 = (be - ae) ** 2 + (bn - an) ** 2
        ahead = (place[0] - ae) * (be - ae) + (place[1] - an) * (bn - an)
        # The square of a tiny length is 0.
        along = max(0.0, min(1.0, ahead / length2)) if length2 else 0.0
        foot = (ae + along * (be - ae), an + along * (bn - an))
        nearest = min(nearest, math.dist(place, foot))
    return nearest
