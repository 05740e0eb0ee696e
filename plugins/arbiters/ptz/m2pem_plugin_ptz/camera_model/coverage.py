"""The coverage of an area by a camera: points that stand for the area, and rows to see them."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pymap3d
import shapely
from numpy.typing import NDArray

from m2pem.api import Area
from m2pem_plugin_ptz.camera_model.field_of_view import FieldOfView, ranges_m
from m2pem_plugin_ptz.camera_model.frames import Vector
from m2pem_plugin_ptz.camera_model.pose import CameraPose

EVEN = 2_500
"""Number of points that are spread evenly over the ground."""

_CELLS_IN_A_VIEW = 10
_MOST_CELLS = 20_000
_EACH_EDGE = 64


def points_in_area(
    area: Area, camera_pose: CameraPose, field_of_view: FieldOfView, ground_m: float
) -> Vector:
    """Return points in ECEF, one in each row: even on the ground, even in the view of the camera,
    and along the border. There is at least one."""
    rings = [np.array([corner[:2] for corner in ring], dtype=float) for ring in area.rings]
    on_border = _ecef(np.concatenate([_along(ring) for ring in rings]), ground_m)
    region = shapely.Polygon(rings[0], rings[1:])
    seen = _as_seen(region, on_border, camera_pose, field_of_view, ground_m)
    return np.concatenate((on_border, _evenly(region, ground_m), seen))


def _along(ring: Vector) -> Vector:
    share = np.linspace(0.0, 1.0, _EACH_EDGE, endpoint=False)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in pairwise(ring)])


def _evenly(region: shapely.Polygon, ground_m: float) -> Vector:
    low, high = np.reshape(region.bounds, (2, 2))
    narrowing = math.cos(math.radians(float(low[0] + high[0]) / 2))
    tall, wide = float(high[0] - low[0]), float(high[1] - low[1]) * narrowing
    probe = _grid(low, high, tall, wide, EVEN)
    share = max(float(shapely.contains_xy(region, probe).mean()), 0.02) if len(probe) else 1.0
    points = _grid(low, high, tall, wide, round(EVEN / share))
    return _ecef(points[shapely.contains_xy(region, points)], ground_m)


def _grid(low: Vector, high: Vector, tall: float, wide: float, count: int) -> Vector:
    step = math.sqrt(max(tall * wide, 1e-18) / count)
    rows, columns = max(1, round(tall / step)), max(1, round(wide / step))
    up = (np.arange(rows) + 0.5) / rows
    across = (np.arange(columns) + 0.5) / columns
    mesh = np.stack(np.meshgrid(up, across, indexing="ij"), axis=-1).reshape(-1, 2)
    points: Vector = low + mesh * (high - low)
    return points


def _as_seen(
    region: shapely.Polygon,
    border: Vector,
    camera_pose: CameraPose,
    field_of_view: FieldOfView,
    ground_m: float,
) -> Vector:
    vectors = camera_pose.vector_to(border)
    elevation = np.arctan2(vectors[:, 2], np.hypot(vectors[:, 0], vectors[:, 1]))
    heading = np.unwrap(np.arctan2(vectors[:, 0], vectors[:, 1]))
    position = camera_pose.position
    below = shapely.contains_xy(region, position.latitude_deg, position.longitude_deg)
    bottom = -math.pi / 2 if below else float(elevation.min())
    left, right = float(heading.min()), float(heading.max())
    if below or right - left > math.tau:
        left, right = -math.pi, math.pi
    tall, wide = float(elevation.max()) - bottom, right - left
    step = min(field_of_view.width_rad, field_of_view.height_rad) / _CELLS_IN_A_VIEW
    step = max(step, math.sqrt(tall * wide / _MOST_CELLS), 1e-6)
    up = bottom + (np.arange(max(1, math.ceil(tall / step))) + 0.5) * step
    across = left + (np.arange(max(1, math.ceil(wide / step))) + 0.5) * step
    mesh = np.stack(np.meshgrid(up, across, indexing="ij"), axis=-1).reshape(-1, 2)
    level = np.cos(mesh[:, 0])
    rays = np.column_stack(
        (level * np.sin(mesh[:, 1]), level * np.cos(mesh[:, 1]), np.sin(mesh[:, 0]))
    )
    far = ranges_m(camera_pose, rays, ground_m)
    rays, far = rays[np.isfinite(far)], far[np.isfinite(far)]
    if not len(far):
        return np.empty((0, 3))
    places = camera_pose.place + far[:, None] * (rays @ camera_pose.enu)
    latitude, longitude, _ = pymap3d.ecef2geodetic(*places.T)
    seen: Vector = places[shapely.contains_xy(region, latitude, longitude)]
    return seen


def _ecef(points: Vector, ground_m: float) -> Vector:
    heights = np.full(len(points), ground_m)
    return np.column_stack(pymap3d.geodetic2ecef(points[:, 0], points[:, 1], heights))


@dataclass(frozen=True, slots=True)
class Row:
    """A sweep along one elevation from a heading to another, which may be more than a turn away.
    `points`: the indices of the points to see."""

    elevation_rad: float
    start_rad: float
    end_rad: float
    points: NDArray[np.intp]


def next_row(
    seen_from: Vector,
    unseen: NDArray[np.intp],
    field_of_view: FieldOfView,
    overlap: float,
    heading_rad: float,
    stop_heading_rad: float | None,
) -> Row:
    """Return the uppermost row of the points that are left.

    `seen_from`: directions from the camera in ENU, one in each row. `unseen`: indices of those that
    are left; at least one. `overlap`: of neighboring rows, as a fraction. `heading_rad`: of the
    camera now. `stop_heading_rad`: over which the camera cannot turn; None if it can turn all
    round.
    """
    vectors = seen_from[unseen]
    elevations = np.arctan2(vectors[:, 2], np.hypot(vectors[:, 0], vectors[:, 1]))
    band = field_of_view.height_rad * (1 - overlap)
    top, bottom = float(elevations.max()), float(elevations.min())
    of_row = unseen[elevations >= top - band]
    middle = max(top - band / 2, (top + bottom) / 2)
    headings = np.arctan2(seen_from[of_row, 0], seen_from[of_row, 1])
    cut = _widest_gap(headings) if stop_heading_rad is None else stop_heading_rad
    along = (headings - cut) % math.tau
    order = np.argsort(along)
    along, of_row = along[order], of_row[order]
    # Where nothing is left for a whole view, there is no need to look along slowly.
    breaks = np.flatnonzero(np.diff(along) > field_of_view.width_rad) + 1
    here = (heading_rad - cut) % math.tau
    runs = list(zip(np.split(along, breaks), np.split(of_row, breaks), strict=True))

    def away(run: tuple[Vector, NDArray[np.intp]]) -> float:
        ends = (abs(float(run[0][0]) - here), abs(float(run[0][-1]) - here))
        nearest = min(ends)
        return min(nearest, math.tau - nearest) if stop_heading_rad is None else nearest

    nearest, points = min(runs, key=away)
    first, last = float(nearest[0]), float(nearest[-1])
    if _apart(here, last, stop_heading_rad) < _apart(here, first, stop_heading_rad):
        first, last = last, first
    return Row(middle, cut + first, cut + last, points)


def _apart(a: float, b: float, stop: float | None) -> float:
    return abs(math.remainder(a - b, math.tau)) if stop is None else abs(a - b)


def _widest_gap(headings: Vector) -> float:
    """Return the middle of the widest gap between headings."""
    ordered = np.sort(headings)
    gaps = np.diff(np.append(ordered, ordered[0] + math.tau))
    widest = int(np.argmax(gaps))
    return float(ordered[widest] + gaps[widest] / 2)
