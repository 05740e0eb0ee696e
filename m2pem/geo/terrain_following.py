"""Routes that follow the ground: heights above ground as altitudes above mean sea level.

A vehicle flies straight from one waypoint to the next. Where the ground between two is not even,
the route gets more of them, as few as keep it within a tolerance of the height that is wanted.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from m2pem.geo.elevation_files import TerrainError
from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import LatLon
from m2pem.geo.terrain import Terrain, along_route
from m2pem.mission.geometry import Coordinate, Route

TOLERANCE_M = 2.0
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
    looked up every `step_m`. Waypoints of the route stay, with their speeds.

    Raises:
        GeometryError: a waypoint has no altitude, or they have different frames, and `height_m` is
            None; or it needs more than `MOST_WAYPOINTS`.
        TerrainError: no elevation file has a place of the route, or one cannot be used.
    """
    if not (tolerance_m > 0 and step_m > 0):
        raise GeometryError("the tolerance and the step are above 0")
    if route.altitude_frames and height_m is None:
        raise GeometryError(
            "the altitudes of the waypoints count from different heights: say a height above ground"
        )
    places: list[LatLon] = []
    alongs: list[float] = []
    wanted: list[float] = []
    corners: list[int] = []
    for along_m, place, own_m, waypoint in along_route(route.waypoints, step_m):
        above_m = own_m if height_m is None else height_m
        if above_m is None:
            number = waypoint or 0
            raise GeometryError(f"waypoint {number + 1} has no altitude: say a height above ground")
        ground_m = terrain.height_m(place)
        if ground_m is None:
            raise TerrainError(not_covered(place))
        if waypoint is not None:
            corners.append(len(places))
        places.append(place)
        alongs.append(along_m)
        wanted.append(ground_m + above_m)
    kept = _kept(alongs, wanted, corners, tolerance_m)
    if len(kept) > MOST_WAYPOINTS:
        raise GeometryError(
            f"following the ground takes {len(kept)} waypoints, more than {MOST_WAYPOINTS}: "
            "allow a greater tolerance, or follow shorter routes"
        )
    waypoints: list[Coordinate] = [(*places[at], round(wanted[at], 1)) for at in kept]
    own = dict(zip(corners, route.speeds_m_s, strict=False))
    return Route(tuple(waypoints), "amsl", tuple(own.get(at) for at in kept) if own else ())


def not_covered(place: LatLon) -> str:
    """Return what is missing where no elevation file has a place, and which file would have it."""
    latitude_deg, longitude_deg = place
    south, west = math.floor(latitude_deg), math.floor(longitude_deg)
    row = f"{'N' if south >= 0 else 'S'}{abs(south):02d}"
    column = f"{'E' if west >= 0 else 'W'}{abs(west):03d}"
    return (
        f"no elevation file has [{latitude_deg:.5f}, {longitude_deg:.5f}]: put {row}{column}.hgt, "
        "or a GeoTIFF with that place, into the folder of elevation files"
    )


def _kept(
    alongs: Sequence[float], wanted: Sequence[float], corners: Sequence[int], tolerance_m: float
) -> list[int]:
    """Return the samples that are needed (Ramer, Douglas and Peucker, by height)."""
    kept = set(corners)
    spans = [(a, b) for a, b in pairwise(corners) if b - a > 1]
    while spans:
        first, last = spans.pop()
        length_m = alongs[last] - alongs[first]
        farthest, deviation_m = first, 0.0
        for at in range(first + 1, last):
            part = (alongs[at] - alongs[first]) / length_m if length_m > 0 else 0.0
            straight_m = wanted[first] + (wanted[last] - wanted[first]) * part
            if abs(wanted[at] - straight_m) > deviation_m:
                farthest, deviation_m = at, abs(wanted[at] - straight_m)
        if deviation_m > tolerance_m:
            kept.add(farthest)
            spans += [(a, b) for a, b in ((first, farthest), (farthest, last)) if b - a > 1]
    return sorted(kept)
