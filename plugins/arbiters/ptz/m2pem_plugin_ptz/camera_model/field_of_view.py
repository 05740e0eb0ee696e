"""The field of view of a camera, and the footprint of it on the ground.

The ground is a surface of one height above the ellipsoid.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from m2pem.api import GeoPosition
from m2pem_plugin_ptz.camera_model.frames import (
    EQUATOR_M,
    POLE_M,
    Matrix,
    Vector,
    enu_vector,
    geodetic,
    up_and_heights_m,
)
from m2pem_plugin_ptz.camera_model.pose import CameraPose


@dataclass(frozen=True, slots=True)
class FieldOfView:
    """The horizontal and vertical angle of a picture, in rad."""

    width_rad: float
    height_rad: float

    def zoomed(self, zoom: float) -> "FieldOfView":
        """Return the field of view at a magnification; this one is that of zoom 1."""
        return FieldOfView(
            2 * math.atan(math.tan(self.width_rad / 2) / zoom),
            2 * math.atan(math.tan(self.height_rad / 2) / zoom),
        )

    def holds(self, axes: Matrix, vectors: Vector, share: float = 1.0) -> NDArray[np.bool_]:
        """Return which vectors of ENU (one in each row) are in the picture, or in the middle
        `share` of it. `axes` are those of `MountFrame.axes`."""
        vector_to = vectors @ axes.T
        ahead = vector_to[:, 0]
        held: NDArray[np.bool_] = (
            (ahead > 0)
            & (np.abs(vector_to[:, 1]) <= ahead * (share * math.tan(self.width_rad / 2)))
            & (np.abs(vector_to[:, 2]) <= ahead * (share * math.tan(self.height_rad / 2)))
        )
        return held

    def border(self, axes: Matrix, each_side: int) -> Vector:
        """Return directions along the border of the picture in ENU, clockwise from the upper left
        corner."""
        wide, high = math.tan(self.width_rad / 2), math.tan(self.height_rad / 2)
        along = np.linspace(-1.0, 1.0, each_side + 1)[:-1]
        ones = np.ones(each_side)
        left = np.concatenate((-along, -ones, along, ones)) * wide
        up = np.concatenate((ones, -along, -ones, along)) * high
        rays = np.column_stack((np.ones(4 * each_side), left, up)) @ axes
        unit: Vector = rays / np.linalg.norm(rays, axis=1)[:, None]
        return unit


_CLOSE_M = 1e-4
_ROUNDS = 4


def ranges_m(camera_pose: CameraPose, directions: Vector, ground_m: float) -> Vector:
    """Return the distance to the ground in each direction (unit vectors in ENU, one in each row);
    NaN if the direction does not meet the ground.

    `ground_m` is the altitude of the ground. For a camera below the ground, all are NaN.
    """
    rays = directions @ camera_pose.enu
    # The surface of equal height is almost an ellipsoid with longer axes: the first guess.
    scale = np.array([EQUATOR_M, EQUATOR_M, POLE_M]) + ground_m
    start, step = camera_pose.place / scale, rays / scale
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
        places = camera_pose.place + found[known, None] * rays[known]
        up, heights_m = up_and_heights_m(places)
        above = heights_m - ground_m
        if np.abs(above).max() < _CLOSE_M:
            break
        sinking = np.einsum("ij,ij->i", up, rays[known])
        found[known] -= above / np.minimum(sinking, -1e-9)
    return found


def visible(camera_pose: CameraPose, places: Vector) -> NDArray[np.bool_]:
    """Return which points of the ground (ECEF, one in each row) are nearer than the horizon."""
    up, _ = up_and_heights_m(places)
    vector_to: NDArray[np.bool_] = np.einsum("ij,ij->i", up, camera_pose.place - places) > 0
    return vector_to


RANGE_M = 5_000.0
"""The footprint ends at this distance, or at a nearer horizon."""

_EACH_SIDE = 16
_STEPS, _EDGE_ROUNDS = 17, 3
_ARC = 4
"""Number of corners along the far end, where the view reaches beyond it."""


def footprint(
    camera_pose: CameraPose,
    axes: Matrix,
    field_of_view: FieldOfView,
    ground_m: float,
    range_m: float = RANGE_M,
) -> tuple[GeoPosition, ...]:
    """Return the corners of the footprint, clockwise as the camera sees them; none if no ground is
    in view.

    There are four corners if the view is on the ground within `range_m`; otherwise the footprint is
    cut off there.
    """
    corners = field_of_view.border(axes, 1)
    if _in_range(ranges_m(camera_pose, corners, ground_m), range_m).all():
        return _places(camera_pose, corners, ground_m, range_m)
    border = field_of_view.border(axes, _EACH_SIDE)
    near = _in_range(ranges_m(camera_pose, border, ground_m), range_m)
    if not near.any():
        return ()
    if near.all():
        return _places(camera_pose, border, ground_m, range_m)
    # Begin where the view comes back to the near ground, so that what is cut off comes last.
    first = next(i for i in range(len(near)) if near[i] and not near[i - 1])
    border, near = np.roll(border, -first, axis=0), np.roll(near, -first)
    rays: list[Vector] = [_edge(camera_pose, border[-1], border[0], ground_m, range_m)]
    for index, ray in enumerate(border):
        if near[index]:
            rays.append(ray)
        elif near[index - 1]:
            rays.append(_edge(camera_pose, ray, border[index - 1], ground_m, range_m))
    rays += _arc(rays[-1], rays[0])
    return _places(camera_pose, np.array(rays), ground_m, range_m)


def _in_range(ranges: Vector, range_m: float) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = ranges <= range_m
    return inside


def _edge(
    camera_pose: CameraPose, far: Vector, near: Vector, ground_m: float, range_m: float
) -> Vector:
    """Return the last direction within the range between one that is beyond it and one that is
    not."""
    for _ in range(_EDGE_ROUNDS):
        rays = near + np.linspace(0.0, 1.0, _STEPS)[:, None] * (far - near)
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        inside = _in_range(ranges_m(camera_pose, rays, ground_m), range_m)
        last = max(int(np.argmin(inside)) - 1, 0)
        near, far = rays[last], rays[last + 1]
    return near


def _arc(start: Vector, end: Vector) -> list[Vector]:
    """Return directions between two at the far end, the shorter way round."""
    begin, elevation = math.atan2(start[0], start[1]), math.asin(float(start[2]))
    turn = math.remainder(math.atan2(end[0], end[1]) - begin, math.tau)
    fall = math.asin(float(end[2])) - elevation
    return [
        enu_vector(begin + turn * k / (_ARC + 1), elevation + fall * k / (_ARC + 1))
        for k in range(1, _ARC + 1)
    ]


def _places(
    camera_pose: CameraPose, rays: Vector, ground_m: float, range_m: float
) -> tuple[GeoPosition, ...]:
    far = ranges_m(camera_pose, rays, ground_m)
    far = np.where(np.isfinite(far), far, range_m)
    places = camera_pose.place + far[:, None] * (rays @ camera_pose.enu)
    return tuple(geodetic(place) for place in places)
