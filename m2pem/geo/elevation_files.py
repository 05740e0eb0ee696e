"""Elevation files of this machine: SRTM tiles (.hgt), and GeoTIFF in any projection (the extra
`terrain`). Heights are in metres above mean sea level (EGM96).

A file has samples at the nodes of its grid, and heights between four of them. Where some of the
four are beyond its edge, they come from the files beside it. Arrays of latitudes and longitudes are
in WGS-84 degrees, those of heights in metres above mean sea level, NaN where they are not known.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, lru_cache, partial
from itertools import product
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
    from rasterio.io import DatasetReader

TERRAIN_FOLDER = "M2PEM_TERRAIN"
"""The variable of the environment with the folder of elevation files."""

_TILE = re.compile(r"([NS])(\d{2})([EW])(\d{3})", re.IGNORECASE)
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

_Beside = Callable[[Floats, Floats], Floats]


class TerrainError(M2pemError):
    """An elevation file cannot be used; the message says which, why, and what would be right."""

    exit_status = 2


def corner_of(file: Path) -> tuple[int, int] | None:
    """Return the latitude and longitude of a tile's south-west corner; None: it is no tile."""
    found = _TILE.fullmatch(file.stem)
    if found is None or file.suffix.lower() != ".hgt":
        return None
    north, latitude, east, longitude = found.groups()
    return (
        int(latitude) * (1 if north.upper() == "N" else -1),
        int(longitude) * (1 if east.upper() == "E" else -1),
    )


class ElevationFile:
    """A grid of samples. `turns`: what may be added to a longitude to find it in the file."""

    rows: int
    columns: int
    turns: tuple[float, ...] = (0.0, 360.0, -360.0)

    def to_grid(self, latitudes: Floats, longitudes: Floats) -> tuple[Floats, Floats]:
        """Return the rows and columns of places, in samples; some may be beyond the grid."""
        raise NotImplementedError

    def to_places(self, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
        """Return the latitudes and longitudes of places in the grid."""
        raise NotImplementedError

    def samples(self, rows: Floats, columns: Floats) -> Floats:
        """Return the samples of whole rows and columns of the grid, in the file's own datum."""
        raise NotImplementedError

    def to_sea_level(self, latitudes: Floats, longitudes: Floats, heights: Floats) -> Floats:
        """Return heights in the file's own datum above mean sea level."""
        return heights

    def heights_m(
        self, latitudes: Floats, longitudes: Floats, beside: _Beside | None = None
    ) -> Floats:
        """Return the heights of the ground.

        `beside`: the same by other files, for samples next to the file's edge.
        """
        found = np.full(latitudes.shape, np.nan)
        edge = _NEAR if beside is None else 1.0 - _NEAR
        for turn in self.turns:
            row, column = self.to_grid(latitudes, longitudes + turn)
            at = (row >= -edge) & (row <= self.rows - 1 + edge) & np.isnan(found)
            at &= (column >= -edge) & (column <= self.columns - 1 + edge)
            if at.any():
                own = self._between(row[at].round(_DIGITS), column[at].round(_DIGITS), beside)
                found[at] = self.to_sea_level(latitudes[at], longitudes[at], own)
        found[np.isinf(found)] = np.nan
        return found

    def _between(self, row: Floats, column: Floats, beside: _Beside | None) -> Floats:
        """Return the bilinear means of the four samples around places, as far as they count."""
        total = np.zeros(row.shape)
        for more_rows, more_columns in product((0, 1), (0, 1)):
            at_row, at_column = np.floor(row) + more_rows, np.floor(column) + more_columns
            weight = (1 - abs(row - at_row)) * (1 - abs(column - at_column))
            counts = weight > 0
            values = self._values(at_row[counts], at_column[counts], beside)
            total[counts] += weight[counts] * values
        return total

    def _values(self, row: Floats, column: Floats, beside: _Beside | None) -> Floats:
        own = (row >= 0) & (row < self.rows) & (column >= 0) & (column < self.columns)
        values = np.full(row.shape, np.nan)
        values[own] = self.samples(row[own], column[own])
        if beside is not None and not own.all():
            places = self.to_places(row[~own], column[~own])
            # Into the datum of this file, in which the samples are put together.
            values[~own] = beside(*places) - self.to_sea_level(*places, np.zeros(places[0].shape))
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
        self.rows = self.columns = side
        self._corner = corner

    def to_grid(self, latitudes: Floats, longitudes: Floats) -> tuple[Floats, Floats]:
        south, west = self._corner
        last = self.rows - 1
        return (south + 1 - latitudes) * last, (longitudes - west) * last

    def to_places(self, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
        south, west = self._corner
        last = self.rows - 1
        return south + 1 - rows / last, west + columns / last

    def samples(self, rows: Floats, columns: Floats) -> Floats:
        values = self._samples[rows.astype(int), columns.astype(int)]
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
        self._to_pixel = ~self._data.transform
        self.rows, self.columns = self._data.height, self._data.width
        if not level.is_geographic:
            self.turns = (0.0,)
        self._block = lru_cache(_BLOCKS)(self._read)

    def to_grid(self, latitudes: Floats, longitudes: Floats) -> tuple[Floats, Floats]:
        x, y = self._system.transform(longitudes, latitudes, direction="INVERSE")
        columns, rows = self._to_pixel @ (x, y)
        # A sample is the height in the middle of its cell.
        return rows - 0.5, columns - 0.5

    def to_places(self, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
        x, y = self._data.transform @ (columns + 0.5, rows + 0.5)
        longitudes, latitudes = self._system.transform(x, y)
        return latitudes, longitudes

    def to_sea_level(self, latitudes: Floats, longitudes: Floats, heights: Floats) -> Floats:
        convert = np.frompyfunc(self._sea_level_m, 3, 1)
        return np.asarray(convert(latitudes, longitudes, heights), float)

    def samples(self, rows: Floats, columns: Floats) -> Floats:
        values = np.empty(rows.shape)
        blocks = np.stack([rows, columns]).astype(int) // _BLOCK
        numbers = blocks[0] * self.columns + blocks[1]
        for number in np.unique(numbers):
            at, corner = numbers == number, np.array(divmod(int(number), self.columns)) * _BLOCK
            block = self._block(*corner.tolist())
            values[at] = block[
                (rows[at] - corner[0]).astype(int), (columns[at] - corner[1]).astype(int)
            ]
        return values

    def _read(self, row: int, column: int) -> Floats:
        """Return the block that begins there."""
        from rasterio.errors import RasterioError  # noqa: PLC0415

        ends = min(row + _BLOCK, self.rows), min(column + _BLOCK, self.columns)
        try:
            values = self._data.read(1, window=((row, ends[0]), (column, ends[1])), masked=True)
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
        [height_m] = self.heights_m(np.array(place[:1]), np.array(place[1:2]))
        return None if np.isnan(height_m) else float(height_m)

    def heights_m(self, latitudes: Floats, longitudes: Floats) -> Floats:
        """Return the same for many places; NaN: it is not known."""
        with self._lock:
            return (
                latitudes
                if not latitudes.size
                else self._heights_m(_FILES_BESIDE, latitudes, longitudes)
            )

    def files_of(self, latitudes: Floats, longitudes: Floats) -> list[ElevationFile]:
        """Return the files whose samples may count at places; one that cannot be used is left
        out."""
        with self._lock:
            found: list[ElevationFile] = list(self._tiles_of(latitudes, longitudes))
            for path in self._rasters:
                with suppress(TerrainError):
                    found.append(self._raster(path))
            return found

    def _heights_m(self, files_beside: int, latitudes: Floats, longitudes: Floats) -> Floats:
        """Look into the files that have the places, then between those around them."""
        longitudes = (longitudes + 180.0) % 360.0 - 180.0
        found = np.full(latitudes.shape, np.nan)

        def look(file: ElevationFile, beside: Callable[[Floats, Floats], Floats] | None) -> None:
            at = np.isnan(found)
            found[at] = file.heights_m(latitudes[at], longitudes[at], beside)

        for tile in self._tiles_of(latitudes, longitudes):
            look(tile, None)
        lookups = (None, partial(self._heights_m, files_beside - 1)) if files_beside else (None,)
        for beside, path in product(lookups, self._rasters):
            if not np.isnan(found).any():
                break
            look(self._raster(path), beside)
        return found

    def _tiles_of(self, latitudes: Floats, longitudes: Floats) -> Iterator[Tile]:
        """Yield the tiles around places; on an edge, those of both sides."""
        lowest, highest = (
            [int(np.floor(end(each) + near)) for each in (latitudes, longitudes)]
            for end, near in ((np.min, -_EDGE_DEG), (np.max, _EDGE_DEG))
        )
        for south, west in product(*map(range, lowest, (each + 1 for each in highest))):
            corner = south, (west + 180) % 360 - 180
            if corner in self._tiles:
                yield self._tile(self._tiles[corner], corner)
