"""Routes, areas and points as CSV: a table of positions whose header names each column's unit.

lat_deg,lon_deg,alt_m
38.1075,-77.3192,0
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO

from m2pem.geo.geojson import (
    FILE_FRAMES,
    GeometryError,
    above_sea_level,
    checked,
    coordinate,
    with_frames,
)
from m2pem.mission.geometry import Area, Coordinate, Point, Route
from m2pem.suggestions import suggest
from m2pem.units import UNITS, Dimension

_EXAMPLE = "lat_deg,lon_deg,alt_m"
_QUANTITIES = {"lat": "deg", "lon": "deg", "alt": "m"}
OTHER_NAMES = {
    "latitude": "lat",
    "longitude": "lon",
    "lng": "lon",
    "long": "lon",
    "altitude": "alt",
    "height": "alt",
}
METRES = UNITS[Dimension.DISTANCE]
_RADIANS = UNITS[Dimension.ANGLE]


def parse_csv(text: str, kind: str) -> Point | Route | Area:
    """Read a table of positions as a geometry of `kind`: "route", "area" or "point".

    The first line names the columns, in any order: `lat_deg` and `lon_deg` (WGS-84), and if wanted
    `alt_m` (another unit of length may stand there: `alt_ft`) and `altitude_frame` (the same in all
    rows, but of a route; `relative`, to home, if left out). Lines that are empty or begin with `#`
    are skipped. The corners of an area need not repeat the first one.

    Raises:
        GeometryError: a column without its unit, or of another; a row that cannot be read.
    """
    rows = csv_rows(text)
    columns = _columns(*next(rows, (1, [""])))
    positions: list[Coordinate] = []
    frames: list[str] = []
    for line, row in rows:
        if len(row) != len(columns):
            raise GeometryError(
                f"line {line}: has {len(row)} columns where the header has {len(columns)}"
            )
        cells = {column.name: (cell, column) for cell, column in zip(row, columns, strict=True)}
        positions.append(csv_position(cells, f"line {line}"))
        frames.append(csv_frame(cells, f"line {line}"))
        if kind != "route" and frames[-1] != frames[0]:
            raise GeometryError(
                f"line {line}: altitude_frame is {frames[-1]!r}, but {frames[0]!r} before"
            )
    geometry = positions_as(positions, next(iter(frames), "relative"), kind)
    if isinstance(geometry, Route):
        geometry = with_frames(geometry, frames)
    return above_sea_level(geometry)


@dataclass(frozen=True, slots=True)
class Column:
    """A column's name ("lat", "lon", "alt" or "altitude_frame") and what makes its values SI.

    `frame`: what heights are above, and `unit`: their unit, where the header says so.
    """

    name: str
    scale: float = 1.0
    frame: str = ""
    unit: str = ""


def csv_rows(text: str, delimiter: str = ",") -> Iterator[tuple[int, list[str]]]:
    """Yield the rows with their lines, without spaces around their cells.

    Raises:
        GeometryError: it is not CSV.
    """
    reader = csv.reader(StringIO(text), strict=True, skipinitialspace=True, delimiter=delimiter)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith("#"):
                yield reader.line_num, cells
    except csv.Error as error:
        raise GeometryError(f"line {reader.line_num}: is not CSV: {error}") from None


def _columns(line: int, header: Sequence[str]) -> list[Column]:
    if len(header) == 1 and any(separator in header[0] for separator in ";\t|"):
        raise GeometryError(f"line {line}: columns are separated by commas: {_EXAMPLE}")
    columns = [_column(name, f"line {line}") for name in header]
    names = [column.name for column in columns]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise GeometryError(f"line {line}: two columns hold '{twice}'")
    for needed in ("lat", "lon"):
        if needed not in names:
            raise GeometryError(
                f"line {line}: there is no column '{needed}_deg'; "
                f"the header is, for example, {_EXAMPLE}"
            )
    return columns


def _column(header: str, where: str) -> Column:
    if header == "altitude_frame":
        return Column(header)
    quantity, _, unit = header.partition("_")
    if quantity not in _QUANTITIES:
        known = [f"{name}_{unit}" for name, unit in _QUANTITIES.items()] + ["altitude_frame"]
        other = OTHER_NAMES.get(quantity.lower(), quantity.lower())
        right = f"{other}_{_QUANTITIES[other]}" if other in _QUANTITIES else ""
        hint = f"did you mean '{right}'?" if right else suggest(header, known, "columns")
        raise GeometryError(f"{where}: column '{header}' is not known; {hint}")
    expected = _QUANTITIES[quantity]
    if not unit:
        raise GeometryError(f"{where}: column '{header}' has no unit; write '{header}_{expected}'")
    if quantity == "alt":
        if unit not in METRES:
            hint = suggest(unit, METRES, "units of length")
            raise GeometryError(f"{where}: column '{header}': {unit!r} is no length; {hint}")
        return Column(quantity, METRES[unit])
    if unit != expected:
        also = ": convert it" if unit in _RADIANS else ""
        raise GeometryError(
            f"{where}: column '{header}': positions are in degrees, '{quantity}_deg'{also}"
        )
    return Column(quantity)


def csv_position(cells: Mapping[str, tuple[str, Column]], where: str) -> Coordinate:
    """Return the position of a row. `cells`: by the names of their columns.

    Raises:
        GeometryError: latitude, longitude or altitude is not a number, or is out of range.
    """
    numbers: dict[str, float | None] = {"alt": None}
    for name in ("lat", "lon", "alt"):
        text, column = cells.get(name, ("", None))
        if column is None or (name == "alt" and not text):
            continue
        try:
            numbers[name] = float(text) * column.scale
        except ValueError:
            hint = "; decimals are written with a point" if "," in text else ""
            raise GeometryError(f"{where}: {name} {text!r} is not a number{hint}") from None
    return coordinate(numbers["lat"], numbers["lon"], numbers["alt"], where)


def csv_frame(cells: Mapping[str, tuple[str, Column]], where: str) -> str:
    """Return the altitude frame of a row; "relative" if it names none.

    Raises:
        GeometryError: the frame is not known.
    """
    frame = cells["altitude_frame"][0] if "altitude_frame" in cells else ""
    if frame and frame not in FILE_FRAMES:
        hint = suggest(frame, FILE_FRAMES, "frames")
        raise GeometryError(f"{where}: altitude_frame {frame!r} is not known; {hint}")
    return frame or "relative"


def positions_as(positions: Sequence[Coordinate], frame: str, kind: str) -> Point | Route | Area:
    """Return positions as a geometry of `kind`: "route", "area" or "point".

    Raises:
        GeometryError: too few positions, too many of a point, or the ring bounds no area.
    """
    if not positions:
        raise GeometryError("has no position below its header")
    if kind == "point":
        if len(positions) > 1:
            raise GeometryError(f"has {len(positions)} positions; a point is one")
        return Point(positions[0], frame)
    if kind == "area":
        ring = positions if positions[0][:2] == positions[-1][:2] else [*positions, positions[0]]
        if len({corner[:2] for corner in ring}) < 3:
            raise GeometryError("an area has at least three different corners")
        return Area(checked((tuple(ring),)), frame)
    return Route(tuple(positions), frame)
