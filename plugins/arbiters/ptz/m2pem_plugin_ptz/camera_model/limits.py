"""The reachable directions of a camera: pan stops, endless pan, tilt limits."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from m2pem_plugin_ptz.camera_model.frames import Vector, angle_between
from m2pem_plugin_ptz.gimbal import Reach

_ROUNDING_RAD = 1e-9


@dataclass(frozen=True, slots=True)
class Reachable:
    """A reachable direction. `missing_rad`: its angle to the wanted direction; 0 if it is the same.

    `why`: what limits the direction, as text; "" if nothing does.
    """

    pan_rad: float
    tilt_rad: float
    missing_rad: float = 0.0
    why: str = ""


def nearest_reachable(
    reach: Reach, pan_rad: float, tilt_rad: float, from_pan_rad: float, slack_rad: float = 0.0
) -> Reachable:
    """Return the reachable direction nearest to (`pan_rad`, `tilt_rad`), from `from_pan_rad`.

    A camera with stops turns straight from one pan to another, so it never turns through them.
    `slack_rad`: a camera at a stop stays there if the target is no farther beyond it than this,
    and does not turn all the way round.
    """
    low, high = reach.tilt_rad
    tilt = min(max(tilt_rad, low), high)
    why = ""
    if abs(tilt - tilt_rad) > _ROUNDING_RAD:
        why = f"tilt {_degrees(tilt_rad)} is beyond its limits, {_range(reach.tilt_rad)}"
    pan, stopped = _pan(reach, pan_rad, from_pan_rad, slack_rad)
    if stopped:
        pan_deg = 180 - (180 - round(math.degrees(pan_rad))) % 360
        why = f"pan {pan_deg} deg is beyond its stops, {_range(reach.pan_rad)}"
    missing = angle_between((pan, tilt), (pan_rad, tilt_rad)) if why else 0.0
    # Straight up and down, no pan misses anything.
    return Reachable(pan, tilt, missing, why) if missing > _ROUNDING_RAD else Reachable(pan, tilt)


def within_reach(reach: Reach, vectors: Vector, bound_rad: float) -> NDArray[np.bool_]:
    """Return which directions (unit vectors in the deck frame of pan 0, one in each row) are no
    farther than `bound_rad` from a reachable direction."""
    forward, left, up = vectors.T
    pan, tilt = np.arctan2(-left, forward), np.arcsin(np.clip(up, -1.0, 1.0))
    near_tilt = np.clip(tilt, *reach.tilt_rad)
    near_pan = pan
    low, high = reach.pan_rad
    if not reach.endless and high - low < math.tau:
        beyond = (pan - low) % math.tau - (high - low)
        nearer = np.where(beyond < (math.tau - (high - low)) / 2, high, low)
        near_pan = np.where(beyond > 0, nearer, pan)
    level = np.cos(near_tilt)
    near = np.column_stack((level * np.cos(near_pan), -level * np.sin(near_pan), np.sin(near_tilt)))
    reached: NDArray[np.bool_] = np.einsum("ij,ij->i", near, vectors) >= math.cos(bound_rad)
    return reached


def _pan(reach: Reach, wanted: float, start: float, slack: float) -> tuple[float, bool]:
    low, high = reach.pan_rad
    if reach.endless:
        return low + (wanted - low) % math.tau, False
    least = wanted + math.tau * math.ceil((low - wanted - _ROUNDING_RAD) / math.tau)
    ways = []
    while least <= high + _ROUNDING_RAD:
        ways.append(min(max(least, low), high))
        least += math.tau
    nearest = min(ways, key=lambda way: abs(way - start), default=None)
    stop = min((low, high), key=lambda end: abs(math.remainder(wanted - end, math.tau)))
    if nearest is None:
        return stop, True
    short = min(reach.pan_rad, key=lambda end: abs(end - start))
    by = abs(math.remainder(wanted - short, math.tau))
    if slack and abs(nearest - start) > math.pi and by <= slack:
        return short, by > _ROUNDING_RAD
    return nearest, False


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.0f} deg"


def _range(ends: tuple[float, float]) -> str:
    return f"{math.degrees(ends[0]):.0f} to {_degrees(ends[1])}"
