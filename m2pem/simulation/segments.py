"""Segments of a motion: each says where a body is at any time after its start."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar, TypeAlias, Union

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
        return max(0.0, self.v_peak - self.v_in) / self.accel

    @property
    def braking_s(self) -> float:
        return max(0.0, self.v_peak - self.v_out) / self.decel

    @property
    def cruising_s(self) -> float:
        ramps = (self.v_peak**2 - self.v_in**2) / (2 * self.accel)
        ramps += (self.v_peak**2 - self.v_out**2) / (2 * self.decel)
        rest = self.length - ramps
        return rest / self.v_peak if rest > 0 and self.v_peak > 0 else 0.0

    @property
    def duration_s(self) -> float:
        return self.accelerating_s + self.cruising_s + self.braking_s

    def time_scaled(self, factor: float) -> "Profile":
        """Return the profile over the same length that takes `factor` times as long."""
        return Profile(
            self.length,
            self.v_in / factor,
            self.v_peak / factor,
            self.v_out / factor,
            self.accel / factor**2,
            self.decel / factor**2,
        )

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

    def when(self, gone: float) -> float:
        """The time after the start at which that distance is gone, but for rounding."""
        t_up, t_cruise = self.accelerating_s, self.cruising_s
        up = (self.v_in + self.v_peak) / 2 * t_up
        if gone < up:
            root = math.sqrt(self.v_in**2 + 2 * self.accel * max(0.0, gone))
            return (root - self.v_in) / self.accel
        down = up + self.v_peak * t_cruise
        if gone < down:
            return t_up + (gone - up) / self.v_peak
        slower = math.sqrt(max(0.0, self.v_peak**2 - 2 * self.decel * (gone - down)))
        return t_up + t_cruise + min(self.braking_s, (self.v_peak - slower) / self.decel)


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
    joints = [v_in, *(min(a, b) for (_, a), (_, b) in pairwise(pieces)), 0.0]
    for index, (length, _) in enumerate(pieces):
        joints[index + 1] = min(
            joints[index + 1], math.sqrt(joints[index] ** 2 + 2 * accel * length)
        )
    for index in range(len(pieces) - 1, -1, -1):
        length = pieces[index][0]
        joints[index] = min(joints[index], math.sqrt(joints[index + 1] ** 2 + 2 * decel * length))
    joints[0] = v_in
    return tuple(
        fit(length, limit, v_in=joints[index], v_out=joints[index + 1], accel=accel, decel=decel)
        for index, (length, limit) in enumerate(pieces)
    )


def rest_to_rest_length(seconds: float, speed: float, accel: float, decel: float) -> float:
    """How far one gets in `seconds` from rest to rest at no more than `speed`."""
    ramps_s = speed / accel + speed / decel
    if seconds >= ramps_s:
        return speed * (seconds - ramps_s / 2)
    return seconds**2 * accel * decel / (2 * (accel + decel))


Vector: TypeAlias = tuple[float, float, float]
"""East, north, up."""


class Pose(msgspec.Struct, frozen=True):
    """A vehicle at one moment: place in m, yaw in rad, velocity in m/s."""

    place: Vector
    yaw: float
    velocity: Vector = (0.0, 0.0, 0.0)

    @property
    def speed(self) -> float:
        """Of the velocity, in m/s."""
        return math.hypot(*self.velocity)

    def slowed(self, rate: float) -> "Pose":
        """The same place, passed at `rate` times the speed."""
        if rate == 1.0:
            return self
        ve, vn, vu = self.velocity
        return Pose(self.place, self.yaw, (ve * rate, vn * rate, vu * rate))


class Look(msgspec.Struct, frozen=True):
    """A payload at one moment: pan and tilt in rad, zoom as a factor."""

    pan: float = 0.0
    tilt: float = 0.0
    zoom: float = 1.0

    def slowed(self, _: float) -> "Look":
        """A look has no speed to scale."""
        return self


def along(start: Vector, direction: Vector, distance: float) -> Vector:
    """The place `distance` from `start` in the unit `direction`."""
    return (
        start[0] + direction[0] * distance,
        start[1] + direction[1] * distance,
        start[2] + direction[2] * distance,
    )


class Travel(msgspec.Struct, frozen=True, tag=True):
    """Along a straight line; `direction` is a unit vector."""

    start: Vector
    direction: Vector
    yaw: float
    profile: Profile
    load: ClassVar[float] = 1.0

    @property
    def duration_s(self) -> float:
        return self.profile.duration_s

    def at(self, t: float) -> Pose:
        gone, speed = self.profile.at(t)
        velocity = along((0.0, 0.0, 0.0), self.direction, speed)
        return Pose(along(self.start, self.direction, gone), self.yaw, velocity)


class Curve(msgspec.Struct, frozen=True, tag=True):
    """Around a centre, climbing evenly. `sweep` is counter-clockwise, in rad, of any size."""

    centre: tuple[float, float]
    radius: float
    angle: float
    sweep: float
    up: float
    climb: float
    profile: Profile
    load: ClassVar[float] = 1.0

    @property
    def duration_s(self) -> float:
        return self.profile.duration_s

    def place(self, sweep: float) -> tuple[float, float]:
        """Return the place on the map when a part of the sweep is done, in rad."""
        angle = self.angle + sweep
        east = self.centre[0] + self.radius * math.cos(angle)
        return east, self.centre[1] + self.radius * math.sin(angle)

    def at(self, t: float) -> Pose:
        gone, speed = self.profile.at(t)
        length = self.profile.length
        part = gone / length
        angle = self.angle + self.sweep * part
        yaw = angle + math.copysign(math.pi / 2, self.sweep)
        level = speed * self.radius * abs(self.sweep) / length
        return Pose(
            (*self.place(self.sweep * part), self.up + self.climb * part),
            yaw,
            (level * math.cos(yaw), level * math.sin(yaw), speed * self.climb / length),
        )


class Pivot(msgspec.Struct, frozen=True, tag=True):
    """Turn on the spot."""

    place: Vector
    yaw: float
    sweep: float
    duration_s: float
    load: ClassVar[float] = 1.0

    def at(self, t: float) -> Pose:
        part = min(1.0, max(0.0, t / self.duration_s)) if self.duration_s > 0 else 1.0
        return Pose(self.place, self.yaw + self.sweep * part)


class Stand(msgspec.Struct, frozen=True, tag=True):
    """Stay. `load`: 1.0 while hovering, little while parked."""

    place: Vector
    yaw: float
    duration_s: float
    load: float

    def at(self, _: float) -> Pose:
        return Pose(self.place, self.yaw)


class Steer(msgspec.Struct, frozen=True, tag=True):
    """Constant acceleration and turn rate: one step of a pursuit."""

    place: Vector
    velocity: Vector
    acceleration: Vector
    yaw: float
    yaw_rate: float
    duration_s: float
    load: float = 1.0

    def at(self, t: float) -> Pose:
        t = min(t, self.duration_s)
        halfway = along(self.velocity, self.acceleration, t / 2)
        return Pose(
            along(self.place, halfway, t),
            self.yaw + self.yaw_rate * t,
            along(self.velocity, self.acceleration, t),
        )


class Slew(msgspec.Struct, frozen=True, tag=True):
    """A payload from one look to another, evenly; the same look twice is a stare."""

    start: Look
    end: Look
    duration_s: float
    load: ClassVar[float] = 0.0

    def at(self, t: float) -> Look:
        if math.isinf(self.duration_s):
            return self.start
        part = min(1.0, max(0.0, t / self.duration_s)) if self.duration_s > 0 else 1.0
        a, b = self.start, self.end
        return Look(
            a.pan + (b.pan - a.pan) * part,
            a.tilt + (b.tilt - a.tilt) * part,
            a.zoom + (b.zoom - a.zoom) * part,
        )


VehiclePhase: TypeAlias = Union[Travel, Curve, Pivot, Stand, Steer]
PayloadPhase: TypeAlias = Slew


def time_scaled(phase: VehiclePhase | PayloadPhase, factor: float) -> VehiclePhase | PayloadPhase:
    """Return the same motion, but for steps of a pursuit, `factor` times as long."""
    match phase:
        case Travel() | Curve():
            return msgspec.structs.replace(phase, profile=phase.profile.time_scaled(factor))
        case Steer():
            return phase
        case _:
            return msgspec.structs.replace(phase, duration_s=phase.duration_s * factor)
