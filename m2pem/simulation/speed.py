"""Speed along a path: accelerate, cruise, slow down, as a closed function of time.

All in metres, seconds and m/s along the path.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import msgspec


class Profile(msgspec.Struct, frozen=True):
    """Motion over `length` from speed `v_in` through `v_peak` to `v_out`."""

    length: float
    v_in: float
    v_peak: float
    v_out: float
    accel: float
    decel: float

    @property
    def accelerating_s(self) -> float:
        """How long it speeds up."""
        return max(0.0, self.v_peak - self.v_in) / self.accel

    @property
    def braking_s(self) -> float:
        """How long it slows down."""
        return max(0.0, self.v_peak - self.v_out) / self.decel

    @property
    def cruising_s(self) -> float:
        """How long it goes at `v_peak`."""
        ramps = (self.v_peak**2 - self.v_in**2) / (2 * self.accel)
        ramps += (self.v_peak**2 - self.v_out**2) / (2 * self.decel)
        rest = self.length - ramps
        return rest / self.v_peak if rest > 0 and self.v_peak > 0 else 0.0

    @property
    def duration_s(self) -> float:
        """The whole time."""
        return self.accelerating_s + self.cruising_s + self.braking_s

    def at(self, t: float) -> tuple[float, float]:
        """Distance gone and speed, `t` seconds after the start (clamped to the duration)."""
        t_up, t_cruise = self.accelerating_s, self.cruising_s
        if t <= 0:
            return 0.0, self.v_in
        if t < t_up:
            speed = self.v_in + self.accel * t
            return (self.v_in + speed) / 2 * t, speed
        gone = (self.v_in + self.v_peak) / 2 * t_up
        t -= t_up
        if t < t_cruise:
            return gone + self.v_peak * t, self.v_peak
        gone += self.v_peak * t_cruise
        t -= t_cruise
        if t < self.braking_s:
            speed = self.v_peak - self.decel * t
            return min(self.length, gone + (self.v_peak + speed) / 2 * t), speed
        return self.length, self.v_out


def fit(
    length: float, limit: float, *, v_in: float, v_out: float, accel: float, decel: float
) -> Profile:
    """The fastest profile over `length` that keeps to `limit`."""
    peak = math.sqrt(
        (2 * accel * decel * length + decel * v_in**2 + accel * v_out**2) / (accel + decel)
    )
    return Profile(length, v_in, max(v_in, v_out, min(limit, peak)), v_out, accel, decel)


def chain(
    pieces: Sequence[tuple[float, float]], accel: float, decel: float, v_in: float = 0.0
) -> tuple[Profile, ...]:
    """Profiles over pieces of (length, speed limit) in a row, from `v_in` to rest.

    From there one must be able to stop at the end, and before each piece to be as slow as it asks.
    """
    joints = [
        v_in,
        *(min(a, b) for (_, a), (_, b) in pairwise(pieces)),
        0.0,
    ]
    for index, (length, _) in enumerate(pieces):
        joints[index + 1] = min(
            joints[index + 1], math.sqrt(joints[index] ** 2 + 2 * accel * length)
        )
    for index in range(len(pieces) - 1, -1, -1):
        length = pieces[index][0]
        joints[index] = min(joints[index], math.sqrt(joints[index + 1] ** 2 + 2 * decel * length))
    joints[0] = v_in
    return tuple(
        fit(
            length,
            limit,
            v_in=joints[index],
            v_out=joints[index + 1],
            accel=accel,
            decel=decel,
        )
        for index, (length, limit) in enumerate(pieces)
    )


def rest_to_rest_length(seconds: float, speed: float, accel: float, decel: float) -> float:
    """How far one gets in `seconds` from rest to rest at no more than `speed`."""
    ramps_s = speed / accel + speed / decel
    if seconds >= ramps_s:
        return speed * (seconds - ramps_s / 2)
    return seconds**2 * accel * decel / (2 * (accel + decel))
