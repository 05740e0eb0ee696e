"""Routes that follow the ground: heights above ground as altitudes above mean sea level.

A vehicle flies straight from one waypoint to the next. Where the ground between two is not even,
the route gets more of them, as few as keep it within a tolerance of the height that is wanted.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from m2pem.geo.elevation_files import Floats, Terrain, TerrainError, tile_name
from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import LatLon
from m2pem.geo.terrain import LONGEST_M, Parts, each_of, pieces
from m2pem.mission.geometry import Route

TOLERANCE_M = 2.0
_CLOSE_M = 0.02
"""How far the ground that is followed may be from the straight lines it is taken as."""

MOST_WAYPOINTS = 500
"""Of a route that follows the ground: autopilots take few more."""


def follow_terrain(
    route: Route,
    terrain: Terrain,
    height_m: float | None = None,
    step_m: float = 30.0,
    tolerance_m: float = TOLERANCE_M,
) -> Route:
    """Return the route in altitudes above mean sea level, so far above the ground below.

    `height_m`: above the ground, everywhere; None: the altitude of each waypoint counts as its
    height above ground, in whatever frame it is, and changes evenly in between. The ground is
    that of each sample on the way, and looked up at least every `step_m`. Waypoints of the route
    stay, with their speeds.

    Raises:
        GeometryError: a waypoint has no altitude, or they have different frames, and `height_m` is
            None; or it needs more than `MOST_WAYPOINTS`.
        TerrainError: no elevation file has a place of the route, or one cannot be used.
    """
    if not (tolerance_m > _CLOSE_M and step_m > 0):
        raise GeometryError(f"the tolerance is above {_CLOSE_M:g} m, and the step above 0")
    if route.altitude_frames and height_m is None:
        raise GeometryError(
            "the altitudes of the waypoints count from different heights: say a height above ground"
        )
    own = np.array([each[2] if height_m is None else height_m for each in route.waypoints], float)
    if np.isnan(own).any():
        first = np.argmax(np.isnan(own)) + 1
        raise GeometryError(f"waypoint {first} has no altitude: say a height above ground")
    parts = Parts.of(route.waypoints, own, min(step_m, LONGEST_M))
    line, begins, ends, (middle, slope, bend) = pieces(terrain, *parts.ends)
    for gap in np.flatnonzero(np.isnan(bend))[:1]:
        start, stop = parts.ends[:, :, line[gap]]
        place = start + (stop - start) * (begins[gap] + ends[gap]) / 2
        raise TerrainError(not_covered((float(place[0]), float(place[1]))))
    # Each piece as straight ones, which are near enough to its parabola.
    counts = np.ceil(np.sqrt(np.abs(bend) / (2 * _CLOSE_M))).clip(1)
    piece, number = each_of(counts)
    at = (np.stack([number, number + 1]) / counts[piece]).T.ravel()
    piece = piece.repeat(2)
    line, of_line = line[piece], begins[piece] + (ends - begins)[piece] * at
    latitudes, longitudes, alongs, heights = (
        first[line] + (last - first)[line] * of_line
        for first, last in (*parts.ends.swapaxes(0, 1), parts.alongs_m, parts.heights_m)
    )
    grounds = middle[piece] + slope[piece] * (at - 0.5) + bend[piece] * (at - 0.5) ** 2
    wanted = grounds + heights
    corners = np.searchsorted(parts.leg[line], np.arange(len(route.waypoints) - 1)).tolist()
    corners.append(len(wanted) - 1)
    kept = _kept(alongs, wanted, corners, tolerance_m - _CLOSE_M)
    if len(kept) > MOST_WAYPOINTS:
        raise GeometryError(
            f"following the ground takes {len(kept)} waypoints, more than {MOST_WAYPOINTS}: "
            "allow a greater tolerance, or follow shorter routes"
        )
    places = dict(enumerate(zip(latitudes.tolist(), longitudes.tolist(), strict=True)))
    places |= zip(corners, (each[:2] for each in route.waypoints), strict=True)
    waypoints = tuple((*places[each], round(float(wanted[each]), 2)) for each in kept)
    speeds = dict(zip(corners, route.speeds_m_s, strict=False))
    return Route(waypoints, "amsl", tuple(map(speeds.get, kept)) if speeds else ())


def not_covered(place: LatLon) -> str:
    """Return what is missing where no elevation file has a place, and which file would have it."""
    latitude_deg, longitude_deg = place
    tile = tile_name(math.floor(latitude_deg), math.floor(longitude_deg))
    return (
        f"no elevation file has [{latitude_deg:.5f}, {longitude_deg:.5f}]: put {tile}, "
        "or a GeoTIFF with that place, into the folder of elevation files"
    )


def _kept(alongs: Floats, wanted: Floats, corners: Sequence[int], tolerance_m: float) -> list[int]:
    """Return the places that are needed (Ramer, Douglas and Peucker, by height)."""
    kept = set(corners)
    spans = list(pairwise(corners))
    while spans:
        first, last = spans.pop()
        if alongs[last] == alongs[first]:
            continue  # it climbs there
        part, ends = slice(first, last + 1), [first, last]
        off = np.abs(wanted[part] - np.interp(alongs[part], alongs[ends], wanted[ends]))
        farthest = first + int(np.argmax(off))
        if off.max() > tolerance_m and first < farthest < last:
            kept.add(farthest)
            spans += [(first, farthest), (farthest, last)]
    return sorted(kept)
