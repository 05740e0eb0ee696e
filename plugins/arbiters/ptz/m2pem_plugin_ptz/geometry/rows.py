"""How to look over what has not been seen yet: in rows, from the farthest to the nearest."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from m2pem_plugin_ptz.geometry.frames import Vector
from m2pem_plugin_ptz.geometry.view import View


@dataclass(frozen=True, slots=True)
class Row:
    """Look along one elevation, from a heading to another, which may lie beyond a whole turn.

    `points`: which of the places are to be seen by it.
    """

    elevation_rad: float
    start_rad: float
    end_rad: float
    points: NDArray[np.intp]


def next_row(
    seen_from: Vector,
    unseen: NDArray[np.intp],
    view: View,
    overlap: float,
    heading_rad: float,
    stop_heading_rad: float | None,
) -> Row:
    """The uppermost row of what is left.

    `seen_from`: directions from the camera, ENU, one in each row, of which `unseen` are left; at
    least one. `overlap`: of neighbouring rows, a fraction. `heading_rad`: where it looks now.
    `stop_heading_rad`: over which it cannot turn; None: it turns all round.
    """
    vectors = seen_from[unseen]
    elevations = np.arctan2(vectors[:, 2], np.hypot(vectors[:, 0], vectors[:, 1]))
    band = view.height_rad * (1 - overlap)
    top, bottom = float(elevations.max()), float(elevations.min())
    of_row = unseen[elevations >= top - band]
    middle = max(top - band / 2, (top + bottom) / 2)
    headings = np.arctan2(seen_from[of_row, 0], seen_from[of_row, 1])
    cut = _widest_gap(headings) if stop_heading_rad is None else stop_heading_rad
    along = (headings - cut) % math.tau
    order = np.argsort(along)
    along, of_row = along[order], of_row[order]
    # Where nothing is left for a whole view, there is no need to look along slowly.
    breaks = np.flatnonzero(np.diff(along) > view.width_rad) + 1
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
    """The middle of the widest gap between headings."""
    ordered = np.sort(headings)
    gaps = np.diff(np.append(ordered, ordered[0] + math.tau))
    widest = int(np.argmax(gaps))
    return float(ordered[widest] + gaps[widest] / 2)
