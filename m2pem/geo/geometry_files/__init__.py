"""Files of many geometries, as other programs read and write them.

`read_geometry_file` reads any of `READ_SUFFIXES`; `write_geometry_file` writes any `FileFormat`.
"""

from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import PurePath
from typing import TypeAlias

from m2pem.geo.geojson import GeometryError
from m2pem.geo.geometry_files.contents import Contents
from m2pem.geo.geometry_files.contents import FileProblem as FileProblem
from m2pem.geo.geometry_files.contents import GeometryFile as GeometryFile
from m2pem.geo.geometry_files.contents import NamedGeometry as NamedGeometry
from m2pem.geo.geometry_files.csv_file import read_csv, write_csv
from m2pem.geo.geometry_files.geojson_file import read_geojson, write_geojson
from m2pem.geo.geometry_files.kml_file import read_kml, read_kmz, write_kml
from m2pem.geo.geometry_files.mission_commands import KEEP_OUT as KEEP_OUT
from m2pem.geo.geometry_files.mission_plans import (
    read_plan,
    read_waypoints,
    write_plan,
    write_waypoints,
)

MAX_BYTES = 10_000_000

Reader: TypeAlias = Callable[[bytes, Contents], None]


def _read_shapefiles(content: bytes, contents: Contents) -> None:
    # Loaded when needed: few files are shapefiles, and every command line reads fleets.
    from m2pem.geo.geometry_files.shapefile_zip import read_shapefiles  # noqa: PLC0415

    read_shapefiles(content, contents)


_READERS: Mapping[str, Reader] = {
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".kml": read_kml,
    ".kmz": read_kmz,
    ".wpml": read_kml,
    ".csv": read_csv,
    ".plan": read_plan,
    **dict.fromkeys((".waypoints", ".mission", ".txt"), read_waypoints),
    ".zip": _read_shapefiles,
}

READ_SUFFIXES = tuple(_READERS)


class FileFormat(StrEnum):
    """A format that is written; each is the suffix of its files without the point."""

    GEOJSON = "geojson"
    KML = "kml"
    CSV = "csv"
    PLAN = "plan"
    WAYPOINTS = "waypoints"


_HINTS = {
    ".shp": "put it into one .zip with its .dbf, .shx and .prj",
    ".gpx": "convert it to .kml or .geojson",
    ".gpkg": "export the layer as .geojson",
}


def read_geometry_file(name: str, content: bytes, kind: str = "") -> GeometryFile:
    """Read all routes, areas and points of a file. `name`: of the file; its suffix says what it is.
    `kind`: of rows of a table that does not say it, "route", "area" or "point".

    A feature that cannot be read is left out whole, and is a problem. Nothing is raised for bad
    input.
    """
    path = PurePath(name)
    contents = Contents(path.stem, kind)
    with contents.feature(""):
        suffix = path.suffix.lower()
        reader = _READERS.get(suffix)
        if reader is None:
            known = ", ".join(READ_SUFFIXES)
            raise GeometryError(
                f"has the suffix {suffix!r}" if suffix else "its name has no suffix",
                _HINTS.get(suffix, f"one of {known} is read"),
            )
        if len(content) > MAX_BYTES:
            raise GeometryError(
                f"is larger than {MAX_BYTES / 1_000_000:g} MB", "split it, or simplify its lines"
            )
        reader(content, contents)
    return contents.whole()


def write_geometry_file(
    file_format: FileFormat, geometries: Sequence[NamedGeometry], altitude_m: float | None = None
) -> bytes:
    """Return geometries as a file.

    `altitude_m`: of waypoints that have none, for the formats whose waypoints need one.

    Raises:
        GeometryError: the format cannot hold these geometries; the message says why.
    """
    if not geometries:
        raise GeometryError("there is nothing to write: choose a route, area or point")
    if file_format is FileFormat.KML:
        return write_kml(geometries)
    if file_format is FileFormat.CSV:
        return write_csv(geometries)
    if file_format is FileFormat.PLAN:
        return write_plan(geometries, altitude_m)
    if file_format is FileFormat.WAYPOINTS:
        return write_waypoints(geometries, altitude_m)
    return write_geojson(geometries)
