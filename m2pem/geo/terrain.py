"""Heights of the ground from elevation files of this machine: SRTM tiles (.hgt) and GeoTIFF.

Heights are in metres above mean sea level (EGM96), bilinear between the samples, also of files side
by side. Where no file has a place, or a file has no value there, the height is not known. GeoTIFF
files need the extra `terrain`.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise, product
from pathlib import Path
from threading import Lock

from m2pem.findings import unreadable_remedy
from m2pem.geo.elevation_files import Raster, TerrainError, Tile, corner_of
from m2pem.geo.local_frame import LatLon, distance_m
from m2pem.mission.geometry import Coordinate, Route

TERRAIN_FOLDER = "M2PEM_TERRAIN"
"""The variable of the environment with the folder of elevation files."""

MOST_SAMPLES = 2_000
"""Of a profile: over a longer route they are farther apart."""

_TIFF = (".tif", ".tiff")
_BESIDE_HEIGHTS = re.compile(
    r"\.|ASTGTM.*_num\.|ALPSML.*_(MSK|STK|LST)\.|.*_(EDM|FLM|HEM|WBM)\.", re.I
)
"""Hidden files, and what Copernicus, ASTER and ALOS have beside heights: masks, counts, errors."""
_FILES_BESIDE = 2
"""At a corner, files beside the file beside may be needed: where spacings differ."""


class Terrain:
    """The elevation files of a folder, which are opened when a place of theirs is asked for.

    Heights may be asked for from several threads.

    Raises:
        TerrainError: the folder cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self._lock = Lock()
        self._tile, self._raster = cache(Tile), cache(Raster)
        self._tiles: dict[tuple[int, int], Path] = {}
        self._rasters: list[Path] = []
        try:
            files = sorted(folder.iterdir())
        except OSError as error:
            remedy = unreadable_remedy(error)
            raise TerrainError(f"{folder}: cannot be read: {error.strerror}; {remedy}") from None
        for file in files:
            if _BESIDE_HEIGHTS.match(file.name):
                continue
            corner = corner_of(file)
            if corner is not None:
                self._tiles[corner] = file
            elif file.suffix.lower() in _TIFF:
                self._rasters.append(file)
        if not self._tiles and not self._rasters:
            raise TerrainError(
                f"{folder}: has no elevation file; put SRTM tiles (N38W078.hgt) or GeoTIFF there"
            )

    def height_m(self, place: LatLon) -> float | None:
        """Return the height of the ground above mean sea level; None: it is not known.

        Raises:
            TerrainError: the file of that place is damaged, or GeoTIFF cannot be read here.
        """
        with self._lock:
            return self._height_m(_FILES_BESIDE, *place)

    def _height_m(
        self, files_beside: int, latitude_deg: float, longitude_deg: float
    ) -> float | None:
        """Look into the files that have the place, then between those around it."""
        longitude_deg = (longitude_deg + 180.0) % 360.0 - 180.0
        for tile, longitude in self._tiles_at(latitude_deg, longitude_deg):
            if (height_m := tile.height_m(latitude_deg, longitude)) is not None:
                return height_m
        lookups = (None, partial(self._height_m, files_beside - 1)) if files_beside else (None,)
        for beside, path in product(lookups, self._rasters):
            height_m = self._raster(path).height_m(latitude_deg, longitude_deg, beside)
            if height_m is not None:
                return height_m
        return None

    def _tiles_at(self, latitude_deg: float, longitude_deg: float) -> Iterator[tuple[Tile, float]]:
        """Yield the tiles of a place, two or four on an edge, with its longitude by theirs."""
        south, west = math.floor(latitude_deg), math.floor(longitude_deg)
        souths = (south, south - 1) if latitude_deg == south else (south,)
        wests = (west, west - 1) if longitude_deg == west else (west,)
        for lowest, leftmost in product(souths, wests):
            turn = 360 if leftmost < -180 else 0
            corner = lowest, leftmost + turn
            if corner in self._tiles:
                yield self._tile(self._tiles[corner], corner), longitude_deg + turn


# --- profiles -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ProfilePoint:
    """A place along a route. `along_m`: from its beginning. `ground_m`, `altitude_m`: above mean
    sea level; None: not known. `waypoint`: its index, if it is one."""

    along_m: float
    place: LatLon
    ground_m: float | None
    altitude_m: float | None
    waypoint: int | None = None

    @property
    def above_ground_m(self) -> float | None:
        """Return the height above ground; None: it is not known."""
        if self.ground_m is None or self.altitude_m is None:
            return None
        return self.altitude_m - self.ground_m


def profile(
    route: Route, terrain: Terrain, step_m: float = 30.0, home_m: float | None = None
) -> list[ProfilePoint]:
    """Return the ground and the altitude along a route, at most `step_m` apart.

    `home_m`: the altitude above mean sea level from which `relative` altitudes count; None: the
    ground at the first waypoint. Altitudes change evenly from one waypoint to the next, those above
    ground over the ground below; where frames differ, above mean sea level.

    Raises:
        TerrainError: an elevation file cannot be used.
    """
    waypoints = route.waypoints
    if home_m is None and "relative" in route.frames:
        home_m = terrain.height_m(waypoints[0][:2])

    def amsl_m(height_m: float | None, ground_m: float | None, frame: str) -> float | None:
        base_m = {"amsl": 0.0, "relative": home_m, "terrain": ground_m}[frame]
        return None if height_m is None or base_m is None else height_m + base_m

    frame = route.altitude_frame
    if route.altitude_frames:
        frame = "amsl"
        waypoints = tuple(
            (*each[:2], amsl_m(each[2], terrain.height_m(each[:2]), own))
            for each, own in zip(waypoints, route.frames, strict=True)
        )
    points: list[ProfilePoint] = []
    for along_m, place, height_m, waypoint in along_route(waypoints, step_m):
        ground_m = terrain.height_m(place)
        altitude_m = amsl_m(height_m, ground_m, frame)
        points.append(ProfilePoint(along_m, place, ground_m, altitude_m, waypoint))
    return points


def along_route(
    waypoints: Sequence[Coordinate], step_m: float
) -> Iterator[tuple[float, LatLon, float | None, int | None]]:
    """Yield distance, place, height in the route's frame, and the index of a waypoint, at most
    `step_m` apart, but about `MOST_SAMPLES` in all."""
    length_m = sum(distance_m(a[:2], b[:2]) for a, b in pairwise(waypoints))
    step_m = max(step_m, length_m / MOST_SAMPLES)
    along_m = 0.0
    for index, (a, b) in enumerate(pairwise(waypoints)):
        leg_m = distance_m(a[:2], b[:2])
        steps = max(1, math.ceil(leg_m / step_m))
        for step in range(steps):
            part = step / steps
            place = (a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part)
            height_m = None if a[2] is None or b[2] is None else a[2] + (b[2] - a[2]) * part
            if step == 0:
                height_m = a[2]
            yield along_m + leg_m * part, place, height_m, index if step == 0 else None
        along_m += leg_m
    last = waypoints[-1]
    yield along_m, last[:2], last[2], len(waypoints) - 1


def lowest(points: Sequence[ProfilePoint]) -> ProfilePoint | None:
    """Return where a route is nearest to the ground; None: it is not known anywhere."""
    known = (each for each in points if each.above_ground_m is not None)
    return min(known, key=lambda each: each.above_ground_m or 0.0, default=None)
