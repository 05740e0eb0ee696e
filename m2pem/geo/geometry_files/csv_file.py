"""Tables of positions: columns are found by their names, rows of one name are one geometry."""

from collections.abc import Mapping, Sequence
from csv import writer
from io import StringIO
from itertools import zip_longest

from m2pem.geo.csv_waypoints import (
    METRES,
    OTHER_NAMES,
    Column,
    csv_frame,
    csv_position,
    csv_rows,
    positions_as,
)
from m2pem.geo.file_text import decoded
from m2pem.geo.geojson import GeometryError, checked, kind_of, with_speeds
from m2pem.geo.geometry_files.contents import Contents, FeatureProblemError, NamedGeometry
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_SPEED = "speed_m_s"
_HEADER = ("name", "kind", "ring", "lat_deg", "lon_deg", "alt_m", "altitude_frame")
_NAMES = {
    **{name: name for name in ("lat", "lon", "alt", "name", "kind", "ring", "altitude_frame")},
    **OTHER_NAMES,
    **dict.fromkeys(("y", "breitengrad"), "lat"),
    **dict.fromkeys(("x", "längengrad"), "lon"),
    **dict.fromkeys(("elevation", "z"), "alt"),
    **dict.fromkeys(("route", "title", "label", "id"), "name"),
    "type": "kind",
    "frame": "altitude_frame",
}
_KINDS = ("route", "area", "point")


def read_csv(content: bytes, contents: Contents) -> None:
    """Collect the geometries of a table.

    Rows of the same `name` make one geometry of its `kind`; without a kind, several make a route
    and one a point. `ring` counts the rings of an area: 0 is the outer one. `speed_m_s`: from a
    waypoint of a route on; empty: as fast as before.

    Raises:
        GeometryError: it is not CSV, or has no columns of positions.
    """
    text = decoded(content)
    rows = csv_rows(text, _delimiter(text))
    line, header = next(rows, (1, [""]))
    columns = _columns(header, f"line {line}", contents)
    groups: dict[str, list[tuple[str, Mapping[str, tuple[str, Column]]]]] = {}
    for number, row in rows:
        if len(row) != len(header):
            raise GeometryError(
                f"line {number}: has {len(row)} columns where the header has {len(header)}"
            )
        cells = {column.name: (row[index], column) for index, column in columns.items()}
        name = cells["name"][0] if "name" in cells else ""
        groups.setdefault(name, []).append((f"line {number}", cells))
    for name, group in groups.items():
        with contents.feature(f"{group[0][0]} {name!r}" if name else group[0][0]):
            contents.add(name, _geometry(group))


def write_csv(geometries: Sequence[NamedGeometry]) -> bytes:
    """Return a table with the columns name, kind, ring, lat_deg, lon_deg, alt_m, altitude_frame,
    and speed_m_s if a route has speeds."""
    table = StringIO()
    out = writer(table, lineterminator="\n")
    have_speeds = any(_speeds(each.geometry) for each in geometries)
    out.writerow((*_HEADER, _SPEED) if have_speeds else _HEADER)
    for each in geometries:
        geometry = each.geometry
        kind, frame = kind_of(geometry), geometry.altitude_frame
        for ring, positions in enumerate(_rings(geometry)):
            for position, speed in zip_longest(positions, _speeds(geometry)):
                row = (each.name, kind, ring, *position, frame, speed)
                out.writerow(row if have_speeds else row[:-1])
    return table.getvalue().encode()


def _speeds(geometry: Point | Route | Area) -> Sequence[float | None]:
    return geometry.speeds_m_s if isinstance(geometry, Route) else ()


def _rings(geometry: Point | Route | Area) -> Sequence[Sequence[Coordinate]]:
    if isinstance(geometry, Area):
        return geometry.rings
    return ((geometry.position,),) if isinstance(geometry, Point) else (geometry.waypoints,)


def _delimiter(text: str) -> str:
    first = next((line for line in text.splitlines() if line.strip(" ,;\t")), "")
    return max(",;\t", key=first.count)


def _columns(header: Sequence[str], where: str, contents: Contents) -> dict[int, Column]:
    """Return the columns that are used, by their place in a row."""
    columns: dict[int, Column] = {}
    left: list[str] = []
    for index, text in enumerate(header):
        column = _column(text, where, contents)
        if column is None or column.name in (each.name for each in columns.values()):
            left.append(text)
        else:
            columns[index] = column
    names = [column.name for column in columns.values()]
    for needed in ("lat", "lon"):
        if needed not in names:
            raise FeatureProblemError(
                f"{where}: there is no column '{needed}' among {', '.join(header)[:200]!r}",
                "the header is, for example, name,lat_deg,lon_deg,alt_m",
            )
    if left:
        contents.warn(where, f"columns that are not read: {', '.join(left)[:200]}")
    return columns


def _column(text: str, where: str, contents: Contents) -> Column | None:
    if text.strip().lower() == _SPEED:
        return Column(_SPEED)
    lower = text.lower().removesuffix("]").removesuffix(")").replace(" [", "_").replace(" (", "_")
    if lower in _NAMES:
        name, unit = _NAMES[lower], ""
    else:
        head, _, unit = lower.rpartition("_")
        name = _NAMES.get(head, "")
        if name not in ("lat", "lon", "alt"):
            return None
    if name == "alt":
        if not unit:
            contents.warn(
                where, f"column {text!r} has no unit: taken as metres", "write, say, alt_ft"
            )
        elif unit not in METRES:
            return None
        return Column(name, METRES[unit or "m"])
    return Column(name) if unit in ("", "deg", "degrees", "wgs84") else None


def _geometry(
    group: Sequence[tuple[str, Mapping[str, tuple[str, Column]]]],
) -> Point | Route | Area:
    kind = ""
    frame = ""
    rings: dict[str, list[Coordinate]] = {}
    speeds = []
    for where, cells in group:
        given = _cell(cells, "kind").lower() or kind
        if given and given not in _KINDS:
            raise FeatureProblemError(
                f"{where}: kind {given!r} is not known", f"one of {', '.join(_KINDS)}"
            )
        its_frame = csv_frame(cells, where)
        if (kind and given != kind) or (frame and its_frame != frame):
            raise FeatureProblemError(
                f"{where}: kind or altitude_frame differs from the rows before",
                "rows of one name have the same ones",
            )
        kind, frame = given, its_frame
        rings.setdefault(_cell(cells, "ring"), []).append(csv_position(cells, where))
        speeds.append(_speed(_cell(cells, _SPEED), where))
    if kind == "area" and len(rings) > 1:
        areas = [positions_as(ring, frame, "area") for ring in rings.values()]
        return Area(
            checked(tuple(area.rings[0] for area in areas if isinstance(area, Area))), frame
        )
    positions = [position for ring in rings.values() for position in ring]
    geometry = positions_as(positions, frame, kind or ("route" if len(positions) > 1 else "point"))
    return with_speeds(geometry, speeds) if any(each is not None for each in speeds) else geometry


def _speed(text: str, where: str) -> float | None:
    if not text.strip():
        return None
    try:
        return float(text)
    except ValueError:
        raise GeometryError(f"{where}: {_SPEED} {text[:20]!r} is not a number") from None


def _cell(cells: Mapping[str, tuple[str, Column]], name: str) -> str:
    return cells[name][0] if name in cells else ""
