"""The simulated camera itself: its head, its clock, its recordings, its troubles."""

import asyncio
import itertools
import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from m2pem_plugin_ptz.sim.onvif.specification import CameraSpec

Moment = Callable[[], float]


@dataclass(slots=True)
class Troubles:
    """What is wrong with it. `speaks`: unset, it takes requests and does not answer. `slow_s`: it
    answers so much later. `locked`: no password is right. `fault`: it answers moves with this one.
    `picture`: what it gives instead of a picture. `full`: it has no room for video."""

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
    """A stretch of video, by the camera's clock in seconds since the Unix epoch."""

    begin_s: float
    end_s: float | None = None


class Camera:
    """`monotonic` and `wall` tell its time.

    `calls`: how often each operation was asked for and done. `moves`: how often it was told to turn
    somewhere else. `reboots`: how often it was switched on again.
    """

    def __init__(
        self, spec: CameraSpec, monotonic: Moment = time.monotonic, wall: Moment = time.time
    ) -> None:
        self.spec = spec
        self.monotonic, self.wall = monotonic, wall
        self.troubles = Troubles()
        self.calls: Counter[str] = Counter()
        self.jobs: dict[str, Job] = {}
        self.recorded: list[Recorded] = []
        self.skew_s = spec.skew_s
        self.moves = 0
        self.reboots = 0
        self.head = spec.head()
        self.head.advance(monotonic())
        self._numbers = itertools.count(1)

    @property
    def now_s(self) -> float:
        """What its clock shows, in seconds since the Unix epoch."""
        return self.wall() + self.skew_s

    def advance(self) -> None:
        """Let it turn until now."""
        self.head.advance(self.monotonic())

    @property
    def look(self) -> tuple[float, float, float]:
        """Where it really looks now: pan and tilt in rad, the zoom factor."""
        self.advance()
        head = self.head
        pan = math.remainder(head.pan.at, math.tau) if self.spec.endless else head.pan.at
        return pan, head.tilt.at, head.zoom.at

    @property
    def recording(self) -> bool:
        """It records."""
        return any(job.active for job in self.jobs.values())

    def add_job(self, active: bool) -> Job:
        """A new recording job."""
        job = Job(f"job_{next(self._numbers)}", active=False)
        self.jobs[job.token] = job
        self.set_job(job, active)
        return job

    def set_job(self, job: Job, active: bool) -> None:
        """Let it record, or not."""
        before = self.recording
        job.active = active
        if self.recording and not before:
            self.recorded.append(Recorded(self.now_s))
        elif before and not self.recording:
            self.recorded[-1].end_s = self.now_s

    def remove_job(self, job: Job) -> None:
        """No more of it."""
        self.set_job(job, False)
        del self.jobs[job.token]

    def restart(self) -> None:
        """It was switched off and on: its head is at zero again, nothing records."""
        for job in tuple(self.jobs.values()):
            self.remove_job(job)
        stuck = [axis.stuck for axis in self.head.axes]
        self.head = self.spec.head()
        for axis, is_stuck in zip(self.head.axes, stuck, strict=True):
            axis.stuck = is_stuck
        self.head.advance(self.monotonic())
        self.reboots += 1
