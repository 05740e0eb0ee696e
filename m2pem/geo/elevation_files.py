"""Elevation files of this machine: SRTM tiles (.hgt), and GeoTIFF in any projection (the extra
`terrain`). Heights are in metres above mean sea level (EGM96).

A file has samples at the nodes of its grid, and heights between four of them. Where some of the
four are beyond its edge, they come from the files beside it. Arrays of places are latitudes and
longitudes in WGS-84 degrees, (2, n); a height that is not known is NaN.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, lru_cache, partial
from itertools import chain, product
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from m2pem.errors import M2pemError
from m2pem.findings import unreadable_remedy
from m2pem.geo.local_frame import LatLon
from m2pem.units import LENGTHS_IN_FILES

if TYPE_CHECKING:
    from pyproj import Transformer
    from rasterio.io import DatasetReader

TERRAIN_FOLDER = "M2PEM_TERRAIN"
"""The variable of the environment with the folder of elevation files."""

_TILE = re.compile(r"[NS]\d{2}[EW]\d{3}\.hgt", re.I)
_SIDES = {2 * side * side: side for side in (1201, 3601)}
"""Samples of a side of a tile, by its bytes: 3 and 1 seconds of arc apart."""

_SPACES = str.maketrans(" -", "__")
_VOID = -32768
_VOIDS = (_VOID, -32767, -9999)
"""Samples without a value in files that do not say so."""

_LOWEST_M, _HIGHEST_M = -12_000, 9_000
"""No ground is beyond."""

_DIGITS, _NEAR = 6, 4e-7
"""Of a place between samples: what is nearer to one of them is at it, whatever rounding did."""

_BLOCK, _BLOCKS = 256, 64
"""A GeoTIFF is read in squares of so many samples; so many of them are kept."""

_TIFF = (".tif", ".tiff")
_BESIDE_HEIGHTS = re.compile(
    r"\.|ASTGTM.*_num\.|ALPSML.*_(MSK|STK|LST)\.|.*_(EDM|FLM|HEM|WBM)\.", re.I
)
"""Hidden files, and what Copernicus, ASTER and ALOS have beside heights: masks, counts, errors."""
_FILES_BESIDE = 2
"""At a corner, files beside the file beside may be needed: where spacings differ."""
_EDGE_DEG = 1e-9

Floats: TypeAlias = NDArray[np.float64]

_Beside: TypeAlias = Callable[[Floats], Floats]


class TerrainError(M2pemError):
    """An elevation file cannot be used; the message says which, why, and what would be right."""

    exit_status = 2


def tile_name(south: int, west: int) -> str:
    """Return the name of the tile with that corner, in degrees: N38W078.hgt."""
    return f"{'NS'[south < 0]}{abs(south):02d}{'EW'[west < 0]}{abs(west):03d}.hgt"


class ElevationFile:
    """A grid of samples. `transform`: six coefficients, of columns and rows to the file's x and y;
    `turns`: whether x is a longitude. Places are latitudes and longitudes, (2, n), also beyond 180
    degrees; those in the grid are rows and columns, (2, n), from the first sample."""

    _system: "Transformer | None" = None

    def __init__(
        self, shape: tuple[int, int], transform: Sequence[float], *, turns: bool = True
    ) -> None:
        self.shape = shape
        self._last = np.array(shape)[:, None] - 1
        self._to_file = np.array([*transform[:6], 0, 0, 1]).reshape(3, 3)
        self._from_file = np.linalg.inv(self._to_file)
        self._middle = self._to_file[0] @ (shape[1] / 2, shape[0] / 2, 1) if turns else None

    def to_grid(self, places: Floats) -> Floats:
        """Return places in the grid, also beyond it; NaN: its projection does not have them."""
        x, y = places[::-1]
        if self._system is not None:
            x, y = self._system.transform(x, y, direction="INVERSE")
        if self._middle is not None:
            x = turned(x, self._middle)
        level = np.stack([x, y, np.ones(x.shape)])
        # A sample is the height in the middle of its cell.
        grid: Floats = (self._from_file @ np.where(np.isinf(level), np.nan, level))[1::-1] - 0.5
        return grid

    def to_places(self, grid: Floats) -> Floats:
        """Return the latitudes and longitudes of places in the grid."""
        x, y, _ = self._to_file @ np.stack([*grid[::-1] + 0.5, np.ones(grid.shape[1])])
        if self._system is not None:
            x, y = self._system.transform(x, y)
        return np.stack([y, x])

    def is_near(self, corners: Floats) -> bool:
        """Whether the grid may have places between the corners: false only if all are far."""
        grid = self.to_grid(corners)
        low, high = grid.min(axis=1), grid.max(axis=1)
        return not (2 * low - high > self.shape).any() and not (2 * high - low < -1).any()

    def samples(self, grid: NDArray[np.int64]) -> Floats:
        """Return the samples at rows and columns, in the file's own datum."""
        raise NotImplementedError

    def to_sea_level(self, places: Floats, heights: Floats) -> Floats:
        """Return heights in the file's own datum above mean sea level."""
        return heights

    def heights_m(self, places: Floats, beside: _Beside | None = None) -> Floats:
        """Return the heights of the ground.

        `beside`: the same by other files, for samples next to the file's edge.
        """
        found = np.full(places.shape[1], np.nan)
        edge = _NEAR if beside is None else 1.0 - _NEAR
        grid = self.to_grid(places)
        at = ((grid >= -edge) & (grid <= self._last + edge)).all(axis=0)
        if at.any():
            own = self._between(grid[:, at].round(_DIGITS), beside)
            found[at] = self.to_sea_level(places[:, at], own)
        return np.where(np.isinf(found), np.nan, found)

    def _between(self, grid: Floats, beside: _Beside | None) -> Floats:
        """Return the bilinear means of the four samples around places, as far as they count."""
        total = np.zeros(grid.shape[1])
        for more in product((0, 1), (0, 1)):
            node = np.floor(grid) + np.array(more)[:, None]
            weight = (1 - abs(grid - node)).prod(axis=0)
            counts = weight > 0
            total[counts] += weight[counts] * self._values(node[:, counts], beside)
        return total

    def _values(self, grid: Floats, beside: _Beside | None) -> Floats:
        own = ((grid >= 0) & (grid <= self._last)).all(axis=0)
        values = np.full(grid.shape[1], np.nan)
        values[own] = self.samples(grid[:, own].astype(int))
        if beside is not None and not own.all():
            places = self.to_places(grid[:, ~own])
            # Into the datum of this file, in which the samples are put together.
            values[~own] = beside(places) - self.to_sea_level(places, np.zeros(places.shape[1]))
        return values


class Tile(ElevationFile):
    """A tile of one degree: rows from north to south, as big-endian 16-bit integers. Tiles side by
    side both have the samples of their common edge."""

    def __init__(self, path: Path, corner: tuple[int, int]) -> None:
        try:
            size = path.stat().st_size
            side = _SIDES.get(size)
            if side is None:
                expected = " or ".join(f"{each:,}" for each in _SIDES)
                raise TerrainError(f"{path}: has {size:,} bytes; an SRTM tile has {expected}")
            self._samples = np.memmap(path, ">i2", "r", shape=(side, side))
        except OSError as error:
            raise TerrainError(f"{path}: cannot be read: {error.strerror}") from None
        step, (south, west) = 1 / (side - 1), corner
        transform = (step, 0, west - step / 2, 0, -step, south + 1 + step / 2)
        super().__init__((side, side), transform)

    def samples(self, grid: NDArray[np.int64]) -> Floats:
        values = self._samples[tuple(grid)]
        return np.where(values == _VOID, np.nan, values)


class Raster(ElevationFile):
    """A GeoTIFF: its first band, with the scale, the offset and the unit that it says."""

    def __init__(self, path: Path) -> None:
        try:
            import rasterio  # noqa: PLC0415
            from rasterio.errors import RasterioError  # noqa: PLC0415
        except ImportError:
            raise TerrainError(
                f"{path}: GeoTIFF is read with rasterio: pip install 'm2pem[terrain]'"
            ) from None
        from pyproj import CRS  # noqa: PLC0415
        from pyproj.exceptions import ProjError  # noqa: PLC0415

        from m2pem.geo.datums import DatumError, heights_of, to_wgs84  # noqa: PLC0415

        try:
            self._data: DatasetReader = rasterio.open(path)
            unit = (self._data.units[0] or "").lower().translate(_SPACES)
            self._scale, self._offset = self._data.scales[0], self._data.offsets[0]
        except (RasterioError, OSError) as error:
            raise TerrainError(f"{path}: cannot be read as GeoTIFF: {error}") from None
        if self._data.crs is None or self._data.transform.is_identity:
            raise TerrainError(f"{path}: does not say its projection or place; georeference it")
        if self._data.colorinterp[0].name not in ("gray", "undefined"):
            raise TerrainError(f"{path}: is a picture: its first band holds colors, not heights")
        try:
            crs = CRS.from_wkt(self._data.crs.to_wkt(version="WKT2_2019"))
            unit_m, self._sea_level_m = heights_of(crs)
            level = crs.sub_crs_list[0] if crs.is_compound else crs.to_2d()
            self._system = to_wgs84(level)
        except (ProjError, DatumError) as error:
            remedy = "gdalwarp -t_srs EPSG:4326+5773 converts it"
            raise TerrainError(f"{path}: {error}; {remedy}") from None
        if unit and unit not in LENGTHS_IN_FILES:
            raise TerrainError(
                f"{path}: its heights are in '{unit}'; known are metres, feet and US survey feet"
            )
        self._unit_m = LENGTHS_IN_FILES[unit] if unit else unit_m
        super().__init__(self._data.shape, self._data.transform, turns=level.is_geographic)
        self._block = lru_cache(_BLOCKS)(self._read)

    def to_sea_level(self, places: Floats, heights: Floats) -> Floats:
        return np.asarray(np.frompyfunc(self._sea_level_m, 3, 1)(*places, heights), float)

    def samples(self, grid: NDArray[np.int64]) -> Floats:
        values = np.empty(grid.shape[1])
        numbers = np.ravel_multi_index(grid // _BLOCK, self.shape)
        for number in np.unique(numbers):
            at = numbers == number
            block = self._block(*map(int, np.unravel_index(number, self.shape)))
            values[at] = block[tuple(grid[:, at] % _BLOCK)]
        return values

    def _read(self, *block: int) -> Floats:
        from rasterio.errors import RasterioError  # noqa: PLC0415

        window = tuple((_BLOCK * each, _BLOCK * (each + 1)) for each in block)
        try:
            values = self._data.read(1, window=window, masked=True)
        except (RasterioError, OSError) as error:
            raise TerrainError(f"{self._data.name}: is damaged: {error}") from None
        heights = (values.data.astype(float) * self._scale + self._offset) * self._unit_m
        known = (heights > _LOWEST_M) & (heights < _HIGHEST_M) & ~np.isin(values.data, _VOIDS)
        return np.where(known & ~np.ma.getmaskarray(values), heights, np.nan)


class Terrain:
    """The elevation files of a folder, which are opened when a place of theirs is asked for.

    Heights may be asked for from several threads.

    Raises:
        TerrainError: the folder cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self._lock = Lock()
        self._tile, self._raster = cache(Tile), cache(Raster)
        try:
            files = [
                each for each in sorted(folder.iterdir()) if not _BESIDE_HEIGHTS.match(each.name)
            ]
        except OSError as error:
            remedy = unreadable_remedy(error)
            raise TerrainError(f"{folder}: cannot be read: {error.strerror}; {remedy}") from None
        self._tiles = {each.name.upper(): each for each in files if _TILE.fullmatch(each.name)}
        self._rasters = [each for each in files if each.suffix.lower() in _TIFF]
        if not self._tiles and not self._rasters:
            raise TerrainError(
                f"{folder}: has no elevation file; put SRTM tiles (N38W078.hgt) or GeoTIFF there"
            )

    def height_m(self, place: LatLon) -> float | None:
        """Return the height of the ground above mean sea level; None: it is not known.

        Raises:
            TerrainError: the file of that place is damaged, or GeoTIFF cannot be read here.
        """
        [height_m] = self.heights_m(np.array(place)[:, None])
        return None if np.isnan(height_m) else float(height_m)

    def heights_m(self, places: Floats) -> Floats:
        """Return the same for latitudes and longitudes, (2, n); NaN: it is not known."""
        with self._lock:
            return self._heights_m(_FILES_BESIDE, places)

    def files_of(self, places: Floats) -> list[ElevationFile]:
        """Return the files whose samples may count there, without those that cannot be used."""
        with self._lock:
            found: list[ElevationFile] = [*self._tiles_of(places)]
            for path in self._rasters:
                with suppress(TerrainError):
                    found.append(self._raster(path))
            corners = _corners(places)
            return [each for each in found if each.is_near(corners)]

    def _heights_m(self, files_beside: int, places: Floats) -> Floats:
        """Look into the files that have the places, then between those around them."""
        found = np.full(places.shape[1], np.nan)
        if not places.size:
            return found
        corners = _corners(places)
        lookups = (None, partial(self._heights_m, files_beside - 1)) if files_beside else (None,)
        files = chain(
            ((tile, None) for tile in self._tiles_of(places)),
            ((self._raster(path), beside) for beside, path in product(lookups, self._rasters)),
        )
        while (at := np.isnan(found)).any() and (look := next(files, None)):
            if look[0].is_near(corners):
                found[at] = look[0].heights_m(places[:, at], look[1])
        return found

    def _tiles_of(self, places: Floats) -> Iterator[ElevationFile]:
        """Yield the tiles around places; on an edge, those of both sides."""
        south, west = np.floor(places.min(axis=1) - _EDGE_DEG).astype(int).tolist()
        north, east = np.floor(places.max(axis=1) + _EDGE_DEG).astype(int).tolist()
        for lowest, leftmost in product(range(south, north + 1), range(west, east + 1)):
            corner = lowest, (leftmost + 180) % 360 - 180
            if path := self._tiles.get(tile_name(*corner).upper()):
                yield self._tile(path, corner)


def _corners(places: Floats) -> Floats:
    """Return the corners of the least rectangle with all places, (2, 4)."""
    (south, west), (north, east) = places.min(axis=1), places.max(axis=1)
    return np.array([[south, south, north, north], [west, east, west, east]])


def turned(longitudes: Floats, near: Floats | float) -> Floats:
    """Return the same longitudes at most 180 degrees from others."""
    return near + (longitudes - near + 180.0) % 360.0 - 180.0
