"""Phases of a motion: each says where a body is at any time after the phase's start.

Vehicles: local east, north, up in metres from the fleet's origin, yaw from east counter-clockwise.
Payloads: pan from the vehicle's bow clockwise, tilt up from the horizon, in radians. The phases can
be written to a file and read again, which is how a simulated vehicle outlives the executive.
"""

import math
from typing import TypeAlias, Union

import msgspec

from m2pem.simulation.speed import Profile

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

    @property
    def duration_s(self) -> float:
        """How long it lasts, in s."""
        return self.profile.duration_s

    @property
    def load(self) -> float:
        """Battery load; 1.0 is that of moving."""
        return 1.0

    def at(self, t: float) -> Pose:
        """Where the vehicle is, so many seconds after the start."""
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

    @property
    def duration_s(self) -> float:
        """How long it lasts, in s."""
        return self.profile.duration_s

    @property
    def load(self) -> float:
        """Battery load; 1.0 is that of moving."""
        return 1.0

    def at(self, t: float) -> Pose:
        """Where the vehicle is, so many seconds after the start."""
        gone, speed = self.profile.at(t)
        length = self.profile.length
        part = gone / length
        angle = self.angle + self.sweep * part
        yaw = angle + math.copysign(math.pi / 2, self.sweep)
        level = speed * self.radius * abs(self.sweep) / length
        return Pose(
            (
                self.centre[0] + self.radius * math.cos(angle),
                self.centre[1] + self.radius * math.sin(angle),
                self.up + self.climb * part,
            ),
            yaw,
            (level * math.cos(yaw), level * math.sin(yaw), speed * self.climb / length),
        )


class Pivot(msgspec.Struct, frozen=True, tag=True):
    """Turn on the spot."""

    place: Vector
    yaw: float
    sweep: float
    duration_s: float

    @property
    def load(self) -> float:
        """Battery load; 1.0 is that of moving."""
        return 1.0

    def at(self, t: float) -> Pose:
        """Where the vehicle is, so many seconds after the start."""
        part = min(1.0, max(0.0, t / self.duration_s)) if self.duration_s > 0 else 1.0
        return Pose(self.place, self.yaw + self.sweep * part)


class Stand(msgspec.Struct, frozen=True, tag=True):
    """Stay. `load`: 1.0 while hovering, little while parked."""

    place: Vector
    yaw: float
    duration_s: float
    load: float

    def at(self, _: float) -> Pose:
        """Where the vehicle is, so many seconds after the start."""
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
        """Where the vehicle is, so many seconds after the start."""
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

    @property
    def load(self) -> float:
        """Battery load; 1.0 is that of moving."""
        return 0.0

    def at(self, t: float) -> Look:
        """Where the payload looks, so many seconds after the start."""
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
