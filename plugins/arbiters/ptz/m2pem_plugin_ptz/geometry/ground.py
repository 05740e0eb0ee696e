"""Where a line of sight meets the ground: a surface of one height above the ellipsoid."""

import numpy as np
import pymap3d
from numpy.typing import NDArray

from m2pem_plugin_ptz.geometry.eye import Eye
from m2pem_plugin_ptz.geometry.frames import Vector

_EQUATOR_M = 6_378_137.0
_POLE_M = 6_356_752.314245179
_CLOSE_M = 1e-4
_ROUNDS = 4


def ranges_m(eye: Eye, directions: Vector, ground_m: float) -> Vector:
    """How far the ground is in each direction (ENU, unit vectors, one in each row); NaN: nowhere.

    `ground_m`: the ground's altitude. Of a camera below the ground, everything is NaN.
    """
    rays = directions @ eye.enu
    # The surface of equal height is almost an ellipsoid with longer axes: the first guess.
    scale = np.array([_EQUATOR_M, _EQUATOR_M, _POLE_M]) + ground_m
    start, step = eye.place / scale, rays / scale
    a = np.einsum("ij,ij->i", step, step)
    b = step @ start
    c = float(start @ start) - 1.0
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - a * c)
    found: Vector = (-b - root) / a
    found[~(found > 0)] = np.nan
    for _ in range(_ROUNDS):
        known = np.isfinite(found)
        if not known.any():
            break
        places = eye.place + found[known, None] * rays[known]
        latitude, longitude, height = pymap3d.ecef2geodetic(*places.T)
        above = height - ground_m
        if np.abs(above).max() < _CLOSE_M:
            break
        lat, lon = np.radians(latitude), np.radians(longitude)
        up = np.column_stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
        sinking = np.einsum("ij,ij->i", up, rays[known])
        found[known] -= above / np.minimum(sinking, -1e-9)
    return found


def visible(eye: Eye, places: Vector) -> NDArray[np.bool_]:
    """Which places of the ground (ECEF, one in each row) are this side of the horizon."""
    latitude, longitude, _ = pymap3d.ecef2geodetic(*places.T)
    lat, lon = np.radians(latitude), np.radians(longitude)
    up = np.column_stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    seen: NDArray[np.bool_] = np.einsum("ij,ij->i", up, eye.place - places) > 0
    return seen
