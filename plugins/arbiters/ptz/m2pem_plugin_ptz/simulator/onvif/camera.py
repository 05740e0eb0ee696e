"""A simulated camera: its motors, its specification, its clock and its recordings."""

import asyncio
import itertools
import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

STEP_S = 0.005
NEAR = 1e-9


@dataclass(slots=True)
class Axis:
    """One motor. `stops` None: it turns all round. Units per second; angles in rad."""

    stops: tuple[float, float] | None
    rate: float
    acceleration: float
    at: float = 0.0
    speed: float = 0.0
    goal: float | None = None
    velocity: float = 0.0
    most: float = math.inf
    until_s: float = math.inf
    stuck: bool = False

    def go(self, goal: float, most: float | None = None) -> None:
        """Turn to a goal and stay, not faster than `most`."""
        if self.stops is None:
            goal = self.at + math.remainder(goal - self.at, math.tau)
        else:
            goal = min(max(goal, self.stops[0]), self.stops[1])
        self.goal, self.velocity = goal, 0.0
        self.most = self.rate if most is None else min(most, self.rate)

    def run(self, velocity: float, until_s: float = math.inf) -> None:
        """Turn at a velocity, until a time at the latest."""
        self.goal, self.until_s = None, until_s
        self.velocity = min(max(velocity, -self.rate), self.rate)

    def stop(self) -> None:
        self.goal, self.velocity = None, 0.0

    @property
    def moving(self) -> bool:
        """Whether it turns, or is about to."""
        return abs(self.speed) > NEAR or (self.goal is not None and abs(self.goal - self.at) > NEAR)

    def step(self, now_s: float, seconds: float) -> None:
        """Advance by a time."""
        if self.stuck:
            self.speed = 0.0
            return
        if now_s >= self.until_s and self.goal is None:
            self.velocity = 0.0
        wanted = self.velocity if self.goal is None else self._towards(self.goal - self.at)
        change = self.acceleration * seconds
        self.speed += min(max(wanted - self.speed, -change), change)
        before = self.at
        self.at += self.speed * seconds
        goal = self.goal
        crossed = goal is not None and (before - goal) * (self.at - goal) <= 0
        if goal is not None and crossed and abs(self.speed) <= 2 * change:
            self.at, self.speed = goal, 0.0
        if self.stops is None:
            return
        low, high = self.stops
        if not low <= self.at <= high:
            self.at, self.speed = min(max(self.at, low), high), 0.0

    def _towards(self, left: float) -> float:
        brake = math.sqrt(2 * self.acceleration * 0.9 * abs(left))
        return math.copysign(min(self.most, brake), left)


@dataclass(slots=True)
class Gimbal:
    """The motors. Pan is clockwise from the camera's zero, tilt is up, zoom is a factor."""

    pan: Axis
    tilt: Axis
    zoom: Axis
    _now_s: float | None = field(default=None)

    @property
    def axes(self) -> tuple[Axis, Axis, Axis]:
        return self.pan, self.tilt, self.zoom

    def advance(self, now_s: float) -> None:
        """Advance to a time."""
        if self._now_s is None:
            self._now_s = now_s
        while self._now_s < now_s:
            seconds = min(STEP_S, now_s - self._now_s)
            self._now_s += seconds
            for axis in self.axes:
                axis.step(self._now_s, seconds)


ZOOM_S = 2.0
"""From the widest view to the narrowest."""


class Asks(StrEnum):
    """How the camera asks for user and password before it gives a picture."""

    DIGEST = "digest"
    BASIC = "basic"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Account:
    """The account that may do everything."""

    user: str
    password: str


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """One camera. Pan is clockwise and tilt is up, from the camera's zero.

    `account` None: no password is needed. `skew_s`: how far its clock is ahead. `latency_s`: of
    answers. `degrees`: it has spaces in degrees, besides those from -1 to 1. `turns`, `drives`: it
    takes absolute moves, and velocities. `media`, `media2`: its media services. `endless`: it pans
    all round.
    """

    name: str = "m2pem simulated camera"
    pan_deg: tuple[float, float] = (-180.0, 180.0)
    tilt_deg: tuple[float, float] = (-90.0, 30.0)
    zoom_max: float = 20.0
    focal_mm: float = 4.3
    view_deg: tuple[float, float] = (60.0, 34.0)
    rate_deg_s: float = 100.0
    acceleration_deg_s2: float = 300.0
    endless: bool = False
    degrees: bool = True
    turns: bool = True
    drives: bool = True
    positions: bool = True
    media: bool = True
    media2: bool = True
    snapshots: bool = True
    asks: Asks = Asks.DIGEST
    recording: bool = True
    account: Account | None = None
    skew_s: float = 0.0
    latency_s: float = 0.05

    def gimbal(self) -> Gimbal:
        """Make its motors, at rest at zero."""
        rate, acceleration = math.radians(self.rate_deg_s), math.radians(self.acceleration_deg_s2)
        pan = None if self.endless else _radians(self.pan_deg)
        tilt = _radians(self.tilt_deg)
        zoom_rate = (self.zoom_max - 1.0) / ZOOM_S
        return Gimbal(
            Axis(pan, rate, acceleration),
            Axis(tilt, rate, acceleration, at=min(max(0.0, tilt[0]), tilt[1])),
            Axis((1.0, self.zoom_max), zoom_rate, zoom_rate * 10, at=1.0),
        )


def _radians(degrees: tuple[float, float]) -> tuple[float, float]:
    return math.radians(degrees[0]), math.radians(degrees[1])


Moment = Callable[[], float]


@dataclass(slots=True)
class FaultState:
    """The active faults. `speaks`: if it is not set, requests are not answered. `slow_s`:
    additional latency. `locked`: no password is right. `fault`: answer to moves. `picture`: content
    in place of a picture. `full`: no storage for video."""

    speaks: asyncio.Event = field(default_factory=asyncio.Event)
    slow_s: float = 0.0
    locked: bool = False
    fault: str = ""
    picture: bytes | None = None
    full: bool = False

    def __post_init__(self) -> None:
        self.speaks.set()


@dataclass(slots=True)
class Job:
    """A recording job."""

    token: str
    active: bool = True


@dataclass(slots=True)
class Recorded:
    """A part of a video, by the camera's clock in seconds since the Unix epoch."""

    begin_s: float
    end_s: float | None = None


class Camera:
    """`monotonic` and `wall` are its clocks.

    `calls`: number of calls of each operation. `moves`: number of moves. `reboots`: number of
    restarts.
    """

    def __init__(
        self, spec: CameraSpec, monotonic: Moment = time.monotonic, wall: Moment = time.time
    ) -> None:
        self.spec = spec
        self.monotonic, self.wall = monotonic, wall
        self.fault_state = FaultState()
        self.calls: Counter[str] = Counter()
        self.jobs: dict[str, Job] = {}
        self.recorded: list[Recorded] = []
        self.skew_s = spec.skew_s
        self.moves = 0
        self.reboots = 0
        self.gimbal = spec.gimbal()
        self.gimbal.advance(monotonic())
        self._numbers = itertools.count(1)

    @property
    def now_s(self) -> float:
        """The time of its clock, in seconds since the Unix epoch."""
        return self.wall() + self.skew_s

    def advance(self) -> None:
        self.gimbal.advance(self.monotonic())

    @property
    def ptz(self) -> tuple[float, float, float]:
        """The true pan and tilt in rad, and the zoom factor."""
        self.advance()
        gimbal = self.gimbal
        pan = math.remainder(gimbal.pan.at, math.tau) if self.spec.endless else gimbal.pan.at
        return pan, gimbal.tilt.at, gimbal.zoom.at

    @property
    def recording(self) -> bool:
        return any(job.active for job in self.jobs.values())

    def add_job(self, active: bool) -> Job:
        """Add a recording job."""
        job = Job(f"job_{next(self._numbers)}", active=False)
        self.jobs[job.token] = job
        self.set_job(job, active)
        return job

    def set_job(self, job: Job, active: bool) -> None:
        """Start or stop a recording job."""
        before = self.recording
        job.active = active
        if self.recording and not before:
            self.recorded.append(Recorded(self.now_s))
        elif before and not self.recording:
            self.recorded[-1].end_s = self.now_s

    def remove_job(self, job: Job) -> None:
        """Remove a recording job."""
        self.set_job(job, False)
        del self.jobs[job.token]

    def restart(self) -> None:
        """Restart: the motors are at zero again, and nothing is recorded."""
        for job in tuple(self.jobs.values()):
            self.remove_job(job)
        stuck = [axis.stuck for axis in self.gimbal.axes]
        self.gimbal = self.spec.gimbal()
        for axis, is_stuck in zip(self.gimbal.axes, stuck, strict=True):
            axis.stuck = is_stuck
        self.gimbal.advance(self.monotonic())
        self.reboots += 1
