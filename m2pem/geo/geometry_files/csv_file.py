"""Tables of positions: columns are found by their names, rows of one name are one geometry."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from csv import Error, reader, writer
from dataclasses import dataclass
from functools import partial
from io import StringIO
from itertools import islice, zip_longest
from typing import TypeAlias

from m2pem.geo.geojson import (
    FILE_FRAMES,
    FRAME_KEYS,
    FRAMES,
    SPEEDS,
    GeometryError,
    checked,
    checked_frame,
    closed_ring,
    coordinate,
    decoded,
    kind_of,
    with_speeds,
)
from m2pem.geo.geometry_files.contents import MAX_POSITIONS, Contents, NamedGeometry
from m2pem.geo.positions import positions
from m2pem.mission.geometry import Area, Coordinate, Point, Route
from m2pem.units import LENGTHS_IN_FILES, UNITS, Dimension

_HEADER = ("name", "kind", "ring", "lat_deg", "lon_deg", "alt_m", "altitude_frame", "speed_m_s")
_NAMES = {
    **{name: name for name in ("lat", "lon", "alt", "name", "kind", "ring")},
    **dict.fromkeys(("latitude", "y", "breitengrad"), "lat"),
    **dict.fromkeys(("longitude", "lng", "long", "x", "längengrad"), "lon"),
    **dict.fromkeys(("route", "title", "label", "id"), "name"),
    "type": "kind",
    **dict.fromkeys(("frame", "altitudeframe", "altitudemode", "altmode"), "altitude_frame"),
    **dict.fromkeys(("speed", "velocity", "groundspeed"), "speed"),
}
"""What a column holds, by its name without unit, spaces and underscores."""

_ABOVE = {
    "": ("",),
    "relative": ("relative", "rel", "abovetakeoff", "abovehome"),
    "terrain": ("agl", "aboveground", "abovegroundlevel", "aboveterrain"),
    "amsl": ("amsl", "msl", "asl", "abovesealevel", "abovemeansealevel"),
    "ellipsoid": ("ellipsoid", "ellipsoidal", "hae", "aboveellipsoid"),
}
_HEIGHTS = {
    name: frame
    for frame, words in _ABOVE.items()
    for word in words
    for base in ("alt", "altitude", "height", "elevation", "elev", "ele", "hgt", "z", "")
    for name in (base + word, word + base)
    if name
}
"""The altitude frame that the name of a column of heights says; "": none."""

_MODES = {
    **{word: frame for frame, words in _ABOVE.items() for word in words if word},
    **{"absolute": "amsl", "relativetoground": "terrain"},
}
_LITCHI = {"0": "relative", "1": "terrain"}
"""The numbers in Litchi's column `altitudemode`, beside which speed 0 means the mission's."""

_SPEEDS = {
    **{unit.replace("/", "_"): scale for unit, scale in UNITS[Dimension.SPEED].items()},
    **dict.fromkeys(("mps", "meters_per_second", "metres_per_second"), 1.0),
    **dict.fromkeys(("kph", "kmh", "kmph"), 1 / 3.6),
    **dict.fromkeys(("kt", "kts", "knot", "knots"), UNITS[Dimension.SPEED]["kn"]),
    "fps": LENGTHS_IN_FILES["ft"],
}
_DEGREES = {
    **dict.fromkeys(("deg", "degree", "degrees", "°", "dd", "decimal", "decimal_degrees"), 1.0),
    **dict.fromkeys(("wgs84", "n", "e", "degrees_north", "degrees_east"), 1.0),
}
_UNITS = {"lat": _DEGREES, "lon": _DEGREES, "alt": LENGTHS_IN_FILES, "speed": _SPEEDS}
_FRAMES = f"in a column altitude_frame one of {', '.join(FILE_FRAMES)}; or leave it out"
_OF_FLIGHT = {
    re.compile(r"(?!.*wind_?s).*(speed|velocity|geschwindigkeit)|(.*_)?vel(_|$)"): (
        "write speed_m_s or speed_km_h; or leave it out"
    ),
    re.compile(r"(.*_)?(mode|datum|frame)$"): f"write {_FRAMES}",
    re.compile(
        r"(.*_)?(crs|srs|srid|epsg)$"
    ): "positions are WGS 84; convert them, or leave it out",
    re.compile(
        r"(.*_)?(alt(?!ern)|height|elev|hgt|agl|a?msl|asl|hae|ell(h|ips)|depth)|.*h(ö|oe)he"
    ): f"write alt_m or alt_ft, and {_FRAMES}",
}
"""Columns that say how to fly: the import stops if it cannot be read, and says what would be."""

MAX_COLUMNS = 1_000
_MOST_WORDS = 12
"""Of a header: what holds a unit or a height has less."""

_COMMANDS = re.compile(
    r"(poi|gimbal|action|photo|camera|curve|rotation|heading|yaw|turn|hover|stay|wait|delay|loiter"
    r"|hold|(mav_)?command|(mav_)?cmd|trigger|task)"
)
_COMMAND = re.compile(r"(mav[_ ])?(command|cmd)", re.I)
_NO_WAYPOINT = re.compile(
    r"(mav_cmd_)?(nav_)?(vtol_)?"
    r"(land(ing)?|take[ _-]?off|rt[lh]|return([ _]to)?([ _]\w+)?|spline\w*)",
    re.I,
)
_WAYPOINTS = frozenset({"", "16", "16.0", "wp", "waypoint", "nav_waypoint", "mav_cmd_nav_waypoint"})
_KINDS = ("route", "area", "point")


@dataclass(frozen=True, slots=True)
class Column:
    """A column by its place in the header, and its name ("lat", "lon", "alt" and so on).

    `scale` makes its values SI. `frame`: what heights are above, and `unit`: their unit, where the
    header says so.
    """

    index: int
    name: str
    scale: float = 1.0
    frame: str = ""
    unit: str = ""


_Cells: TypeAlias = dict[str, str]
"""The texts of a row by the names of their columns."""


def read_csv(content: bytes, contents: Contents) -> None:
    """Collect the geometries of a table.

    Rows of the same `name` make one geometry of its `kind`; without a kind, that of the contents,
    or several make a route and one a point. `ring` counts the rings of an area: 0 is the outer one.
    `speed_m_s`: from a waypoint of a route on; empty: as fast as before.

    Raises:
        GeometryError: it is not CSV, or has no columns of positions.
    """
    text = decoded(content)
    delimiter = _delimiter(text)
    if text.count("\n") > MAX_POSITIONS:
        contents.expect(islice(_rows(text, delimiter), 1, None))
    rows = _rows(text, delimiter)
    line, header = next(rows, (1, [""]))
    columns, commands = _columns(header, f"line {line}", contents)
    groups: dict[str, list[tuple[int, list[str]]]] = {}
    for number, row in rows:
        if len(row) != len(header):
            raise GeometryError(
                f"line {number}: has {len(row)} columns where the header has {len(header)}"
            )
        for index in commands:
            text, is_command = row[index], _COMMAND.fullmatch(header[index])
            if _NO_WAYPOINT.fullmatch(text) or (is_command and text.lower() not in _WAYPOINTS):
                raise GeometryError(
                    f"line {number}: {header[index]} {text[:40]!r} is no waypoint",
                    "leave its row out, and draw it as a task of the mission",
                )
        name = row[columns["name"].index] if "name" in columns else ""
        groups.setdefault(name, []).append((number, row))
    if not groups:
        raise GeometryError("has no row below its header")
    is_litchi = any(each.lower().startswith("curvesize") for each in header)
    for name, group in groups.items():
        if contents.is_full:
            break
        # What is wrong with a row says its line.
        with contents.feature(f"line {group[0][0]} {name!r}" if name else ""):
            # One after the other: with all rows as mappings a table takes three times the memory.
            rows_of_it = ((number, _cells(row, columns, is_litchi)) for number, row in group)
            contents.add(name, _geometry(rows_of_it, columns, name, contents))


def _cells(row: Sequence[str], columns: Mapping[str, Column], is_litchi: bool) -> _Cells:
    cells = {name: row[column.index] for name, column in columns.items()}
    if "alt" in columns and columns["alt"].frame:
        cells["altitude_frame"] = columns["alt"].frame
    elif text := cells.get("altitude_frame"):
        word = "".join(_words(text))
        frame = _LITCHI.get(word) if is_litchi else None
        cells["altitude_frame"] = frame or _MODES.get(word, text)
    if is_litchi and cells.get("speed") in ("0", "0.0"):
        del cells["speed"]
    return cells


def write_csv(geometries: Sequence[NamedGeometry]) -> bytes:
    """Return a table with the columns name, kind, ring, lat_deg, lon_deg, alt_m, altitude_frame,
    and speed_m_s if a route has speeds."""
    table = StringIO()
    out = writer(table, lineterminator="\n")
    speeds = (getattr(each.geometry, "speeds_m_s", ()) for each in geometries)
    width = len(_HEADER) if any(speeds) else len(_HEADER) - 1
    out.writerow(_HEADER[:width])
    for each in geometries:
        geometry, kind = each.geometry, kind_of(each.geometry)
        rings = geometry.rings if isinstance(geometry, Area) else [tuple(positions(geometry))]
        for number, ring in enumerate(rings):
            line = geometry if isinstance(geometry, Route) else Route(ring, geometry.altitude_frame)
            for place, frame, speed in zip_longest(ring, line.frames, line.speeds_m_s):
                out.writerow((each.name, kind, number, *place, frame, speed)[:width])
    return table.getvalue().encode()


def _rows(text: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows with their lines, without spaces around their cells.

    Raises:
        GeometryError: it is not CSV.
    """
    lines = reader(StringIO(text), strict=True, skipinitialspace=True, delimiter=delimiter)
    try:
        for row in lines:
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith("#"):
                yield lines.line_num, cells
    except Error as error:
        raise GeometryError(f"line {lines.line_num}: is not CSV: {error}") from None


def _delimiter(text: str) -> str:
    first = next((line for line in text.splitlines() if line.strip(" ,;\t")), "")
    return max(",;\t", key=first.count)


def _columns(
    header: Sequence[str], where: str, contents: Contents
) -> tuple[dict[str, Column], list[int]]:
    """Return the columns that are read, by their name, and the indices of those that command."""
    if len(header) > MAX_COLUMNS:
        raise GeometryError(f"{where}: has more than {MAX_COLUMNS} columns", "leave some out")
    columns: dict[str, Column] = {}
    left, commands, stops = [], [], []
    for index, text in enumerate(header):
        column, words = _column(index, text)
        if column is None:
            hint = next((hint for sign, hint in _OF_FLIGHT.items() if sign.match(words)), "")
            if _COMMANDS.match(words):
                commands.append(index)
            elif hint:
                stops.append((f"{where}: column {text[:60]!r} cannot be read", hint))
            else:
                left.append(text)
        elif column.name in columns and column.name in ("name", "kind", "ring"):
            left.append(text)
        elif column.name in columns:
            both = f"{header[columns[column.name].index]!r} and {text!r}"
            stops.append((f"{where}: columns {both} hold the same", "leave one of them out"))
        else:
            columns[column.name] = column
    for needed in ("lat", "lon"):
        if needed not in columns:
            raise GeometryError(
                f"{where}: there is no column '{needed}' among {', '.join(header)[:200]!r}",
                "the header is, for example, name,lat_deg,lon_deg,alt_m",
            )
    if "altitude_frame" in columns and "alt" in columns and columns["alt"].frame:
        stops.append((f"{where}: two columns say what heights are above", "leave one of them out"))
    if stops:
        raise GeometryError(*stops[0])
    if "alt" in columns:
        column, text = columns["alt"], header[columns["alt"].index]
        if not column.unit:
            message = f"column {text!r} has no unit: taken as metres"
            contents.warn(where, message, "write, say, alt_ft")
        if "ele" in text.lower() and not (column.frame or "altitude_frame" in columns):
            message = f"column {text!r} is taken as heights above home"
            contents.warn(where, message, f"write {_FRAMES}")
    if left:
        contents.warn(where, f"columns that are not read: {', '.join(left)[:200]}")
    if commands:
        names = ", ".join(dict.fromkeys(header[each].rstrip("0123456789") for each in commands))
        what = f"columns that command more than a place are not read: {names[:400]}"
        contents.warn(where, what, "draw it in the mission")
    return columns, commands


def warn_of_fields(names: Iterable[str], where: str, contents: Contents) -> None:
    """Warn of fields beside geometries that say how to fly, and are not read."""
    known = (SPEEDS, FRAMES, *FRAME_KEYS)
    found = [
        name
        for name in dict.fromkeys(names)
        if name.lower() not in known
        and any(sign.match("_".join(_words(name[:200]))) for sign in (_COMMANDS, *_OF_FLIGHT))
    ]
    if found:
        what = f"fields that say how to fly are not read: {', '.join(found)[:200]}"
        contents.warn(where, what, "give the geometry its heights, or draw it in the mission")


def _column(index: int, text: str) -> tuple[Column | None, str]:
    """Return what a column holds, if it can be read, and the words of its name joined by `_`."""
    words = _words(text[:200])[:_MOST_WORDS]
    spans = [(at, at + size) for size in (3, 2, 1) for at in range(1, len(words) - size + 1)]
    for start, end in (*spans, (len(words), len(words))):
        key, unit = "".join(words[:start] + words[end:]), "_".join(words[start:end])
        name = "alt" if key in _HEIGHTS else _NAMES.get(key, "")
        scales = _UNITS.get(name, {})
        if name and (unit in scales or (not unit and name != "speed")):
            frame = _HEIGHTS[key] if name == "alt" else ""
            return Column(index, name, scales.get(unit, 1.0), frame, unit), "_".join(words)
    return None, "_".join(words)


def _words(text: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).lower()
    return [each for each in re.split(r"[\s_/.,()\[\]-]+", spaced) if each]


def _geometry(
    rows: Iterable[tuple[int, _Cells]], columns: Mapping[str, Column], name: str, contents: Contents
) -> Point | Route | Area:
    kind, default = "", contents.kind
    frames: list[str] = []
    rings: dict[str, list[Coordinate]] = {}
    speeds = []
    for number, cells in rows:
        where = f"line {number}"
        given = cells.get("kind", "").lower() or kind
        if given and given not in _KINDS:
            raise GeometryError(
                f"{where}: kind {given!r} is not known", f"one of {', '.join(_KINDS)}"
            )
        frames.append(checked_frame(cells.get("altitude_frame") or "relative", f"{where}: "))
        is_mixed = frames[-1] != frames[0] and (given or default) in ("area", "point")
        if (kind and given != kind) or is_mixed:
            raise GeometryError(
                f"{where}: kind or altitude_frame differs from the rows before",
                "rows of one name have the same ones, but the altitude_frame of a route",
            )
        kind = given
        latitude, longitude, altitude, speed = (
            _number(cells, columns, name, where) for name in ("lat", "lon", "alt", "speed")
        )
        place = coordinate(latitude, longitude, altitude, where)
        rings.setdefault(cells.get("ring", ""), []).append(place)
        speeds.append(speed)
    places = [place for ring in rings.values() for place in ring]
    kind = kind or default or ("route" if len(places) > 1 or any(speeds) else "point")
    geometry: Point | Route | Area
    if kind == "area":
        geometry = Area(
            checked(tuple(map(closed_ring, rings.values())), partial(contents.warn, name)),
            frames[0],
        )
    elif kind == "point":
        if len(places) > 1:
            raise GeometryError(f"has {len(places)} positions; a point is one")
        geometry = Point(places[0], frames[0])
    else:
        geometry = Route.of(places, frames)
    return with_speeds(geometry, speeds) if any(each is not None for each in speeds) else geometry


def _number(cells: _Cells, columns: Mapping[str, Column], name: str, where: str) -> float | None:
    """Return a value of a row in SI; None: it has none, which no latitude and longitude may.

    Raises:
        GeometryError: it is not a number.
    """
    text = cells.get(name)
    if text is None or (not text and name in ("alt", "speed")):
        return None
    try:
        return float(text) * columns[name].scale
    except ValueError:
        hint = "; decimals are written with a point" if "," in text else ""
        raise GeometryError(f"{where}: {name} {text!r} is not a number{hint}") from None
