"""Where a route goes on for who has driven a part of it, and only knows where it stands."""

import math
from collections.abc import Sequence
from itertools import pairwise

from m2pem_plugin_ros.pilot.plane import Place

NEARER_M = 0.5
"""A later leg must be nearer by so much than one before it: nothing is left out by chance."""


def next_waypoint(places: Sequence[Place], here: Place, within_m: float) -> int | None:
    """The number of the waypoint that comes next.

    None: nobody can tell, as the route does not come by within `within_m`, or comes by again
    later on.
    """
    away = [_distance(leg, here) for leg in pairwise(places)]
    near = [number for number, distance_m in enumerate(away) if distance_m <= within_m]
    if not near or near[-1] - near[0] >= len(near):
        return None
    found = near[0]
    for number in near:
        if away[number] < away[found] - NEARER_M:
            found = number
    return found + 1


def _distance(leg: tuple[Place, Place], place: Place) -> float:
    (x, y), end = leg
    east, north = end[0] - x, end[1] - y
    square = east * east + north * north
    share = 0.0 if square == 0.0 else ((place[0] - x) * east + (place[1] - y) * north) / square
    share = max(0.0, min(1.0, share))
    return math.dist((x + share * east, y + share * north), place)
