"""How the simulated camera turns: each axis with a rate, an acceleration, and stops."""

import math
from dataclasses import dataclass, field

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
        """Turn there and stay, not faster than `most`."""
        if self.stops is None:
            goal = self.at + math.remainder(goal - self.at, math.tau)
        else:
            goal = min(max(goal, self.stops[0]), self.stops[1])
        self.goal, self.velocity = goal, 0.0
        self.most = self.rate if most is None else min(most, self.rate)

    def run(self, velocity: float, until_s: float = math.inf) -> None:
        """Turn on, until a time at the latest."""
        self.goal, self.until_s = None, until_s
        self.velocity = min(max(velocity, -self.rate), self.rate)

    def stop(self) -> None:
        """Brake."""
        self.goal, self.velocity = None, 0.0

    @property
    def moving(self) -> bool:
        """It turns, or is about to."""
        return abs(self.speed) > NEAR or (self.goal is not None and abs(self.goal - self.at) > NEAR)

    def step(self, now_s: float, seconds: float) -> None:
        """Let time pass."""
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
class Head:
    """Pan from the camera's own zero, clockwise; tilt up; zoom as a factor."""

    pan: Axis
    tilt: Axis
    zoom: Axis
    _now_s: float | None = field(default=None)

    @property
    def axes(self) -> tuple[Axis, Axis, Axis]:
        """All of them."""
        return self.pan, self.tilt, self.zoom

    def advance(self, now_s: float) -> None:
        """Let it turn until now."""
        if self._now_s is None:
            self._now_s = now_s
        while self._now_s < now_s:
            seconds = min(STEP_S, now_s - self._now_s)
            self._now_s += seconds
            for axis in self.axes:
                axis.step(self._now_s, seconds)
