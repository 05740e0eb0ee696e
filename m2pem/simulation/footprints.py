"""What a simulated payload sees of the ground, which is flat.

Places are east, north and up in metres, as of a `Pose`; corners are in order, clockwise as the
payload sees them.
"""

import math
from collections.abc import Sequence

from m2pem.simulation.gimbals import MAST_M
from m2pem.simulation.phases import Look, Pose, Vector
from m2pem.simulation.settings import Gimbal

RANGE_M = 5_000.0
"""Farther away nothing is said to be seen."""

CIRCLE_CORNERS = 24
_HALVINGS = 30


def seen(gimbal: Gimbal, look: Look, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
    """The corners of a picture, which is square; none if no ground is in view.

    Where the view goes beyond `RANGE_M` or the horizon, it ends there.
    """
    east, north, up = carrier.place
    height = up + MAST_M - ground_up_m
    if height <= 0:
        return ()
    half = math.tan(min(gimbal.view_rad / max(look.zoom, 1.0), math.radians(170)) / 2)
    top_left, bottom_left = _edge(look, carrier.yaw, height, -half, half)
    top_right, bottom_right = _edge(look, carrier.yaw, height, half, half)
    if top_left is None or bottom_left is None or top_right is None or bottom_right is None:
        return ()
    return [
        (east + x, north + y, ground_up_m)
        for x, y in (top_left, top_right, bottom_right, bottom_left)
    ]


def around(range_m: float, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
    """The circle in which a detector finds things."""
    east, north, _ = carrier.place
    angles = (-math.tau * index / CIRCLE_CORNERS for index in range(CIRCLE_CORNERS))
    return [
        (east + range_m * math.cos(angle), north + range_m * math.sin(angle), ground_up_m)
        for angle in angles
    ]


_Level = tuple[float, float]


def _edge(
    look: Look, yaw: float, height: float, aside: float, half: float
) -> tuple[_Level | None, _Level | None]:
    """Where the top and the bottom of a side of the picture meet the ground, from the payload."""
    bottom = _met(look, yaw, height, aside, -half)
    if bottom is None:
        return None, None
    top = _met(look, yaw, height, aside, half)
    low, high = -half, half
    if top is None:
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            if _met(look, yaw, height, aside, middle) is None:
                high = middle
            else:
                low = middle
        top = _met(look, yaw, height, aside, low)
    return top, bottom


def _met(look: Look, yaw: float, height: float, aside: float, above: float) -> _Level | None:
    """Where the ray through a point of the picture meets the ground; None: it is too far away."""
    bearing = yaw - look.pan
    cos_b, sin_b = math.cos(bearing), math.sin(bearing)
    cos_t, sin_t = math.cos(look.tilt), math.sin(look.tilt)
    level = cos_t - above * sin_t
    down = -(sin_t + above * cos_t)
    if down * RANGE_M <= height * math.hypot(level, aside):
        return None
    reach = height / down
    return reach * (level * cos_b + aside * sin_b), reach * (level * sin_b - aside * cos_b)
