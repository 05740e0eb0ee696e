"""The part of the ground that a camera sees, as corners on a map."""

import math

import numpy as np
import pymap3d
from numpy.typing import NDArray

from m2pem.api import GeoPosition
from m2pem_plugin_ptz.geometry.eye import Eye
from m2pem_plugin_ptz.geometry.frames import Matrix, Vector, enu_vector
from m2pem_plugin_ptz.geometry.ground import ranges_m
from m2pem_plugin_ptz.geometry.view import View

RANGE_M = 5_000.0
"""Farther away nothing is said to be seen; a horizon that is nearer is the end, too."""

_EACH_SIDE = 16
_STEPS, _ROUNDS = 17, 3
_ARC = 4
"""So many corners along the far end, where the view reaches beyond it."""


def footprint(
    eye: Eye, axes: Matrix, view: View, ground_m: float, range_m: float = RANGE_M
) -> tuple[GeoPosition, ...]:
    """Its corners, clockwise as the camera sees them; none if no ground is in view.

    Four, if all of the view is on the ground within `range_m`; else it is cut off there.
    """
    corners = view.border(axes, 1)
    if _within(ranges_m(eye, corners, ground_m), range_m).all():
        return _places(eye, corners, ground_m, range_m)
    border = view.border(axes, _EACH_SIDE)
    near = _within(ranges_m(eye, border, ground_m), range_m)
    if not near.any():
        return ()
    if near.all():
        return _places(eye, border, ground_m, range_m)
    # Begin where the view comes back to the near ground, so that what is cut off comes last.
    first = next(i for i in range(len(near)) if near[i] and not near[i - 1])
    border, near = np.roll(border, -first, axis=0), np.roll(near, -first)
    rays: list[Vector] = [_edge(eye, border[-1], border[0], ground_m, range_m)]
    for index, ray in enumerate(border):
        if near[index]:
            rays.append(ray)
        elif near[index - 1]:
            rays.append(_edge(eye, ray, border[index - 1], ground_m, range_m))
    rays += _arc(rays[-1], rays[0])
    return _places(eye, np.array(rays), ground_m, range_m)


def _within(ranges: Vector, range_m: float) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = ranges <= range_m
    return inside


def _edge(eye: Eye, far: Vector, near: Vector, ground_m: float, range_m: float) -> Vector:
    """Between a direction that is beyond the range and one that is not: the last that is not."""
    for _ in range(_ROUNDS):
        rays = near + np.linspace(0.0, 1.0, _STEPS)[:, None] * (far - near)
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        inside = _within(ranges_m(eye, rays, ground_m), range_m)
        last = max(int(np.argmin(inside)) - 1, 0)
        near, far = rays[last], rays[last + 1]
    return near


def _arc(start: Vector, end: Vector) -> list[Vector]:
    """Directions between two at the far end, the short way round."""
    begin, elevation = math.atan2(start[0], start[1]), math.asin(float(start[2]))
    turn = math.remainder(math.atan2(end[0], end[1]) - begin, math.tau)
    fall = math.asin(float(end[2])) - elevation
    return [
        enu_vector(begin + turn * k / (_ARC + 1), elevation + fall * k / (_ARC + 1))
        for k in range(1, _ARC + 1)
    ]


def _places(eye: Eye, rays: Vector, ground_m: float, range_m: float) -> tuple[GeoPosition, ...]:
    far = ranges_m(eye, rays, ground_m)
    far = np.where(np.isfinite(far), far, range_m)
    places = eye.place + far[:, None] * (rays @ eye.enu)
    return tuple(
        GeoPosition(float(latitude), float(longitude), float(altitude))
        for latitude, longitude, altitude in zip(*pymap3d.ecef2geodetic(*places.T), strict=True)
    )
