"""Elevation files: SRTM tiles (.hgt), and GeoTIFF in any projection (the extra `terrain`).

A file has samples at the nodes of its grid, and heights between four of them. Where some of the
four are beyond its edge, they come from the files beside it.
"""

import math
import mmap
import re
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.errors import M2pemError
from m2pem.units import LENGTHS_IN_FILES

if TYPE_CHECKING:
    from rasterio.io import DatasetReader

_TILE = re.compile(r"([NS])(\d{2})([EW])(\d{3})", re.IGNORECASE)
_SIDES = {2 * side * side: side for side in (1201, 3601)}
"""Samples of a side of a tile, by its bytes: 3 and 1 seconds of arc apart."""

_SPACES = str.maketrans(" -", "__")
_VOID = -32768
_VOIDS = (_VOID, -32767, -9999)
"""Samples without a value in files that do not say so."""

_LOWEST_M, _HIGHEST_M = -12_000, 9_000
"""No ground is beyond."""

_DIGITS = 6
"""Of a place between samples: what is nearer to one of them is at it, whatever rounding did."""

_Sample = Callable[[int, int], float | None]
_Beside = Callable[[float, float], float | None]


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


class Tile:
    """A tile of one degree: rows from north to south, as big-endian 16-bit integers. Tiles side by
    side both have the samples of their common edge."""

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
        """Return the height of the ground above mean sea level; None: it is not known."""
        last = self._side - 1
        row = (1 - (latitude_deg - self._corner[0])) * last
        column = (longitude_deg - self._corner[1]) * last
        if not (0 <= row <= last and 0 <= column <= last):
            return None
        return _between(row, column, self._sample)

    def _sample(self, row: int, column: int) -> float | None:
        (value,) = struct.unpack_from(">h", self._samples, 2 * (row * self._side + column))
        return None if value == _VOID else float(value)


class Raster:
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
            unit_m, self._to_sea_level = heights_of(crs)
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
        self._turns = (0.0, 360.0, -360.0) if level.is_geographic else (0.0,)

    def height_m(
        self, latitude_deg: float, longitude_deg: float, beside: _Beside | None = None
    ) -> float | None:
        """Return the height of the ground above mean sea level; None: it is not known.

        `beside`: the same by other files, for samples next to the file's edge.
        """
        x, y = self._system.transform(longitude_deg, latitude_deg, direction="INVERSE")
        if not (math.isfinite(x) and math.isfinite(y)):
            return None
        for turn in self._turns:
            column, row = self._to_pixel @ (x + turn, y)
            # A sample is the height in the middle of its cell.
            found = self._at(round(row - 0.5, _DIGITS), round(column - 0.5, _DIGITS), beside)
            if found is not None:
                altitude_m = self._to_sea_level(latitude_deg, longitude_deg, found)
                return altitude_m if math.isfinite(altitude_m) else None
        return None

    def _at(self, row: float, column: float, beside: _Beside | None) -> float | None:
        """Return the height between the four samples around a place, in the file's own datum."""
        rows, columns = self._data.height, self._data.width
        if 0 <= row <= rows - 1 and 0 <= column <= columns - 1:
            return _between(row, column, self._sample)
        if beside is None or not (-1 < row < rows and -1 < column < columns):
            return None

        def sample(at_row: int, at_column: int) -> float | None:
            if 0 <= at_row < rows and 0 <= at_column < columns:
                return self._sample(at_row, at_column)
            x, y = self._data.transform @ (at_column + 0.5, at_row + 0.5)
            longitude_deg, latitude_deg = self._system.transform(x, y)
            altitude_m = beside(latitude_deg, longitude_deg)
            if altitude_m is None:
                return None
            # Into the datum of this file, in which the samples are put together.
            return altitude_m - self._to_sea_level(latitude_deg, longitude_deg, 0.0)

        return _between(row, column, sample)

    def _sample(self, row: int, column: int) -> float | None:
        from rasterio.errors import RasterioError  # noqa: PLC0415

        try:
            values = self._data.read(1, window=((row, row + 1), (column, column + 1)), masked=True)
        except (RasterioError, OSError) as error:
            raise TerrainError(f"{self._data.name}: is damaged: {error}") from None
        value = float(values.data[0, 0])
        height_m: float = (value * self._scale + self._offset) * self._unit_m
        known = value not in _VOIDS and _LOWEST_M < height_m < _HIGHEST_M and not values.mask.any()
        return height_m if known else None


def _between(row: float, column: float, sample: _Sample) -> float | None:
    """Return the bilinear mean of the four samples around a place; None: one is not known."""
    total = 0.0
    for at_row, weight_row in _weights(row):
        for at_column, weight_column in _weights(column):
            value = sample(at_row, at_column)
            if value is None:
                return None
            total += weight_row * weight_column * value
    return total


def _weights(index: float) -> Iterator[tuple[int, float]]:
    """Yield the samples before and after a place, as far as they count."""
    before = math.floor(index)
    yield before, 1 - (index - before)
    if index > before:
        yield before + 1, index - before
