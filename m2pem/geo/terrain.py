"""Heights of the ground from elevation files of this machine: SRTM tiles (.hgt) and GeoTIFF.

Heights are in metres above mean sea level, bilinear between the samples. Where no file has a place,
or a file has no value there, the height is not known. GeoTIFF files need the extra `terrain`.
"""

import math
import mmap
import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Protocol

from m2pem.errors import M2pemError
from m2pem.findings import unreadable_remedy
from m2pem.geo.local_frame import LatLon, distance_m
from m2pem.mission.geometry import Coordinate, Route

if TYPE_CHECKING:
    from rasterio.io import DatasetReader

TERRAIN_FOLDER = "M2PEM_TERRAIN"
"""The variable of the environment with the folder of elevation files."""

MOST_SAMPLES = 2_000
"""Of a profile: over a longer route they are farther apart."""

_TILE = re.compile(r"([NS])(\d{2})([EW])(\d{3})", re.IGNORECASE)
_SIDES = {2 * side * side: side for side in (1201, 3601)}
"""Samples of a side of a tile, by its bytes: 3 and 1 seconds of arc apart."""

_VOID = -32768
_TIFF = (".tif", ".tiff")


class TerrainError(M2pemError):
    """An elevation file cannot be used; the message says which, why, and what would be right."""

    exit_status = 2


class _ElevationFile(Protocol):
    def height_m(self, latitude_deg: float, longitude_deg: float) -> float | None:
        """Return the height of the ground; None: it is not known."""
        ...


class Terrain:
    """The elevation files of a folder, which are opened when a place of theirs is asked for.

    Heights may be asked for from several threads.

    Raises:
        TerrainError: the folder cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self._lock = Lock()
        self._tiles: dict[tuple[int, int], Path] = {}
        self._open: dict[Path, _ElevationFile] = {}
        self._rasters: list[Path] = []
        try:
            files = sorted(folder.iterdir())
        except OSError as error:
            remedy = unreadable_remedy(error)
            raise TerrainError(f"{folder}: cannot be read: {error.strerror}; {remedy}") from None
        for file in files:
            corner = _corner(file)
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
        latitude_deg, longitude_deg = place
        with self._lock:
            for file in self._files(latitude_deg, longitude_deg):
                height_m = file.height_m(latitude_deg, longitude_deg)
                if height_m is not None:
                    return height_m
        return None

    def _files(self, latitude_deg: float, longitude_deg: float) -> Iterator[_ElevationFile]:
        corner = math.floor(latitude_deg), math.floor(longitude_deg)
        if corner in self._tiles:
            path = self._tiles[corner]
            if path not in self._open:
                self._open[path] = _Tile(path, corner)
            yield self._open[path]
        for path in self._rasters:
            if path not in self._open:
                self._open[path] = _Raster(path)
            yield self._open[path]


def _corner(file: Path) -> tuple[int, int] | None:
    """Return the latitude and longitude of a tile's south-west corner; None: it is no tile."""
    found = _TILE.fullmatch(file.stem)
    if found is None or file.suffix.lower() != ".hgt":
        return None
    north, latitude, east, longitude = found.groups()
    return (
        int(latitude) * (1 if north.upper() == "N" else -1),
        int(longitude) * (1 if east.upper() == "E" else -1),
    )


class _Tile:
    """A tile of one degree: rows from north to south, as big-endian 16-bit integers."""

    def __init__(self, path: Path, corner: tuple[int, int]) -> None:
        try:
            size = path.stat().st_size
            side = _SIDES.get(size)
            if side is None:
                expected = " or ".join(f"{each:,}" for each in _SIDES)
                raise TerrainError(f"{path}: has {size:,} bytes; an SRTM tile has {expected}")
            with path.open("rb") as file:
                self._samples = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise TerrainError(f"{path}: cannot be read: {error.strerror}") from None
        self._side = side
        self._corner = corner

    def height_m(self, latitude_deg: float, longitude_deg: float) -> float | None:
        """Return the height between the four samples around a place."""
        last = self._side - 1
        row = (1 - (latitude_deg - self._corner[0])) * last
        column = (longitude_deg - self._corner[1]) * last
        return _between(row, column, self._side, self._side, self._sample)

    def _sample(self, row: int, column: int) -> float | None:
        (value,) = struct.unpack_from(">h", self._samples, 2 * (row * self._side + column))
        return None if value == _VOID else float(value)


class _Raster:
    """A GeoTIFF in any projection."""

    def __init__(self, path: Path) -> None:
        try:
            import rasterio  # noqa: PLC0415
            from rasterio.errors import RasterioError  # noqa: PLC0415
        except ImportError:
            raise TerrainError(
                f"{path}: GeoTIFF is read with rasterio: pip install 'm2pem[terrain]'"
            ) from None
        try:
            self._data: DatasetReader = rasterio.open(path)
        except (RasterioError, OSError) as error:
            raise TerrainError(f"{path}: cannot be read as GeoTIFF: {error}") from None
        if self._data.crs is None:
            raise TerrainError(f"{path}: does not say its projection; georeference it")
        self._in_degrees = self._data.crs.to_epsg() == 4326

    def height_m(self, latitude_deg: float, longitude_deg: float) -> float | None:
        """Return the height between the four samples around a place."""
        from rasterio.warp import transform  # noqa: PLC0415

        x, y = longitude_deg, latitude_deg
        if not self._in_degrees:
            xs, ys, *_ = transform("EPSG:4326", self._data.crs, [longitude_deg], [latitude_deg])
            x, y = xs[0], ys[0]
        column, row = ~self._data.transform @ (x, y)
        # A sample is the height in the middle of its cell.
        row, column = row - 0.5, column - 0.5
        height, width = self._data.height, self._data.width
        return _between(row, column, height, width, self._sample)

    def _sample(self, row: int, column: int) -> float | None:
        from rasterio.errors import RasterioError  # noqa: PLC0415

        try:
            values = self._data.read(1, window=((row, row + 1), (column, column + 1)), masked=True)
        except (RasterioError, OSError) as error:
            raise TerrainError(f"{self._data.name}: is damaged: {error}") from None
        value = values[0, 0]
        return None if values.mask.any() or not math.isfinite(value) else float(value)


class _Sample(Protocol):
    def __call__(self, row: int, column: int) -> float | None: ...


def _between(row: float, column: float, rows: int, columns: int, sample: _Sample) -> float | None:
    """Return the bilinear mean of the four samples around a place; None: one is not known."""
    if not (0 <= row <= rows - 1 and 0 <= column <= columns - 1):
        return None
    top, left = min(int(row), rows - 2), min(int(column), columns - 2)
    down, right = row - top, column - left
    total = 0.0
    for at_row, weight_row in ((top, 1 - down), (top + 1, down)):
        for at_column, weight_column in ((left, 1 - right), (left + 1, right)):
            weight = weight_row * weight_column
            if weight == 0:
                continue
            value = sample(at_row, at_column)
            if value is None:
                return None
            total += weight * value
    return total


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
    known = [(each.above_ground_m, each) for each in points]
    return min(
        ((height, each) for height, each in known if height is not None),
        key=lambda found: found[0],
        default=(0.0, None),
    )[1]
