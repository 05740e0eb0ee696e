"""What a camera has in its picture: a pyramid around the direction in which it looks."""

import math
from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

from m2pem.api import GeoPosition
from m2pem_plugin_ptz.camera_model.frames import Matrix, Vector, enu_vector
from m2pem_plugin_ptz.camera_model.pose import Eye


@dataclass(frozen=True, slots=True)
class View:
    """The angles of a picture's width and height, in rad."""

    width_rad: float
    height_rad: float

    def zoomed(self, zoom: float) -> "View":
        """At a magnification; this one is that of zoom 1."""
        return View(
            2 * math.atan(math.tan(self.width_rad / 2) / zoom),
            2 * math.atan(math.tan(self.height_rad / 2) / zoom),
        )

    def holds(self, axes: Matrix, vectors: Vector, share: float = 1.0) -> NDArray[np.bool_]:
        """Which vectors of ENU (one in each row) are in the picture of a camera with such `axes`
        (`Deck.axes`), or in the middle `share` of it."""
        seen = vectors @ axes.T
        ahead = seen[:, 0]
        held: NDArray[np.bool_] = (
            (ahead > 0)
            & (np.abs(seen[:, 1]) <= ahead * (share * math.tan(self.width_rad / 2)))
            & (np.abs(seen[:, 2]) <= ahead * (share * math.tan(self.height_rad / 2)))
        )
        return held

    def border(self, axes: Matrix, each_side: int) -> Vector:
        """Directions along the picture's border, in ENU, clockwise from its upper left corner."""
        wide, high = math.tan(self.width_rad / 2), math.tan(self.height_rad / 2)
        along = np.linspace(-1.0, 1.0, each_side + 1)[:-1]
        ones = np.ones(each_side)
        left = np.concatenate((-along, -ones, along, ones)) * wide
        up = np.concatenate((ones, -along, -ones, along)) * high
        rays = np.column_stack((np.ones(4 * each_side), left, up)) @ axes
        unit: Vector = rays / np.linalg.norm(rays, axis=1)[:, None]
        return unit


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


RANGE_M = 5_000.0
"""Farther away nothing is said to be seen; a horizon that is nearer is the end, too."""

_EACH_SIDE = 16
_STEPS, _EDGE_ROUNDS = 17, 3
_ARC = 4
"""So many corners along the far end, where the view reaches beyond it."""


def footprint(
    eye: Eye, axes: Matrix, view: View, ground_m: float, range_m: float = RANGE_M
) -> tuple[GeoPosition, ...]:
    """Its corners, clockwise as the camera sees them; none if no ground is in view.

    Four, if all of the view is on the ground within `range_m`; else it is cut off there.
    """
    corners = view.border(axes, 1)
    if _in_range(ranges_m(eye, corners, ground_m), range_m).all():
        return _places(eye, corners, ground_m, range_m)
    border = view.border(axes, _EACH_SIDE)
    near = _in_range(ranges_m(eye, border, ground_m), range_m)
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


def _in_range(ranges: Vector, range_m: float) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = ranges <= range_m
    return inside


def _edge(eye: Eye, far: Vector, near: Vector, ground_m: float, range_m: float) -> Vector:
    """Between a direction that is beyond the range and one that is not: the last that is not."""
    for _ in range(_EDGE_ROUNDS):
        rays = near + np.linspace(0.0, 1.0, _STEPS)[:, None] * (far - near)
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        inside = _in_range(ranges_m(eye, rays, ground_m), range_m)
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
