"""What a camera has in its picture: a pyramid around the direction in which it looks."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from m2pem_plugin_ptz.geometry.frames import Matrix, Vector


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
