"""How far a camera looked beside what it was to look at, from a vehicle that may move."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.column.series import Array, Series

ON_TARGET_RAD = math.radians(1.0)
MOVES_M_S = 0.5


@dataclass(frozen=True, slots=True)
class Mount:
    """Where the camera is, from what the vehicle's odometry tells of, in the vehicle's frame."""

    forward_m: float
    left_m: float
    up_m: float


@dataclass(frozen=True, slots=True)
class Looked:
    """One behavior of a camera: `acquired_s` after its beginning it was on the target (infinite:
    never), and so far was it off from then on, in rad, `moving` or not, at each time."""

    acquired_s: float
    off_rad: Array
    moving: NDArray[np.bool_]


NEVER = Looked(math.inf, np.array([]), np.array([], dtype=np.bool_))


def axes(vehicle: Series, head: Series) -> Array:
    """Where the camera looks at each time of the head: unit vectors, east, north and up.

    `vehicle`: east, north, up in m, yaw from east, counter-clockwise; it stands level. `head`: the
    joints, pan counter-clockwise from the bow and tilt upwards (REP-103). All angles in rad.
    """
    yaw = vehicle.at(head.times_s)[:, 3] + head.values[:, 0]
    tilt = head.values[:, 1]
    level = np.cos(tilt)
    return np.stack([level * np.cos(yaw), level * np.sin(yaw), np.sin(tilt)], axis=1)


def at_target(
    vehicle: Series, head: Series, mount: Mount, target: Array, window_s: tuple[float, float]
) -> Looked:
    """The angle between the camera's axis and a place (east, north, up in m), in a time window."""
    part = head.within(*window_s)
    poses = vehicle.at(part.times_s)
    cos, sin = np.cos(poses[:, 3]), np.sin(poses[:, 3])
    eyes = poses[:, :3] + np.stack(
        [
            mount.forward_m * cos - mount.left_m * sin,
            mount.forward_m * sin + mount.left_m * cos,
            np.full(len(cos), mount.up_m),
        ],
        axis=1,
    )
    wanted = target - eyes
    wanted /= np.linalg.norm(wanted, axis=1)[:, None]
    return _looked(vehicle, part, _between(axes(vehicle, part), wanted), window_s[0])


def along_sector(
    vehicle: Series,
    head: Series,
    sector: tuple[float, float, float],
    speed_rad_s: float,
    window_s: tuple[float, float],
) -> Looked:
    """The angle between the camera's axis and where a steady sweep should have been.

    `sector`: the two edges and the elevation; edges as headings from north, clockwise. A sweep goes
    from one edge to the other at `speed_rad_s`, at that elevation. Only when it sets out is taken
    from what was seen: from the time at which the camera passed the middle.
    """
    low, high, elevation = sector
    part = head.within(*window_s)
    looks = axes(vehicle, part)
    middle = (low + high) / 2
    headings = middle + np.unwrap(
        [math.remainder(math.atan2(east, north) - middle, math.tau) for east, north, _ in looks]
    )
    if not len(part.times_s):
        return NEVER
    half_s = (high - low) / 2 / speed_rad_s
    # The last time that it is before the middle: on its way to the first edge it may pass it, too.
    before = np.nonzero(np.diff(np.sign(headings - middle)))[0]
    if not len(before):
        return NEVER
    index = int(before[-1])
    share = (middle - headings[index]) / (headings[index + 1] - headings[index])
    passed_s = part.times_s[index] + share * (part.times_s[index + 1] - part.times_s[index])
    onwards = 1.0 if headings[index + 1] > headings[index] else -1.0
    since_s = np.clip(part.times_s - passed_s, -half_s, half_s)
    wanted_headings = middle + onwards * speed_rad_s * since_s
    level = math.cos(elevation)
    wanted = np.stack(
        [
            level * np.sin(wanted_headings),
            level * np.cos(wanted_headings),
            np.full(len(looks), math.sin(elevation)),
        ],
        axis=1,
    )
    return _looked(vehicle, part, _between(looks, wanted), window_s[0])


def _looked(vehicle: Series, part: Series, off_rad: Array, begin_s: float) -> Looked:
    on_target = np.nonzero(off_rad <= ON_TARGET_RAD)[0]
    if not len(on_target):
        return NEVER
    first = int(on_target[0])
    moving = vehicle.speeds(part.times_s) >= MOVES_M_S
    return Looked(float(part.times_s[first] - begin_s), off_rad[first:], moving[first:])


def _between(ones: Array, others: Array) -> Array:
    crossed = np.linalg.norm(np.cross(ones, others), axis=1)
    angles: Array = np.arctan2(crossed, np.einsum("ij,ij->i", ones, others))
    return angles
