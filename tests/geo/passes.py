"""The ends of passes over an area, one after the other."""

from collections.abc import Sequence

from m2pem.geo.lawn_mower import Ring, passes_over
from m2pem.geo.local_frame import EastNorth


def lawn_mower(
    rings: Sequence[Ring], spacing_m: float, yaw_rad: float, overshoot_m: float = 0.0
) -> list[EastNorth]:
    passes = passes_over(rings, spacing_m, yaw_rad, overshoot_m)
    return [point for each in passes for point in (each.start, each.end)]
