"""Shapefiles (Esri), each layer with its .dbf and .prj, in a ZIP archive."""

import struct
from io import BytesIO
from math import isnan
from pathlib import PurePosixPath
from typing import Any

import shapefile

from m2pem.geo.geojson import GeometryError, stated_frame
from m2pem.geo.geometry_files.archive import Archive, archive_of, member
from m2pem.geo.geometry_files.contents import MAX_FEATURES, Contents
from m2pem.geo.geometry_files.csv_file import warn_of_fields
from m2pem.geo.geometry_files.geojson_file import read_feature
from m2pem.geo.geometry_files.reference_system import ReferenceSystem, system_named, system_of_wkt

_NAME_FIELDS = ("name", "title", "label", "id")

_WITH_Z = frozenset(
    {shapefile.POINTZ, shapefile.POLYLINEZ, shapefile.POLYGONZ, shapefile.MULTIPOINTZ}
)
_NO_DATA = -9999.0
"""A Z value of it or below is none: Esri's is below -1e38 (white paper of 1998, page 2), other
programs write -9999, -32768 or -99999."""


def read_shapefiles(content: bytes, contents: Contents) -> None:
    """Collect the shapes of all layers in an archive.

    Raises:
        GeometryError: it is no archive, or has no layer.
    """
    with archive_of(content) as archive:
        layers = [name for name in archive.namelist() if name.lower().endswith(".shp")]
        if not layers:
            raise GeometryError("has no .shp", "put .shp, .dbf, .shx and .prj into it")
        for name in layers:
            with contents.feature(name):
                _read_layer(archive, name, contents)


def _read_layer(archive: Archive, name: str, contents: Contents) -> None:
    parts = {
        suffix: _part(archive, name, suffix) for suffix in (".shp", ".shx", ".dbf", ".prj", ".cpg")
    }
    projection = (parts[".prj"] or b"").decode("utf-8-sig", "replace").strip()
    if not projection:
        contents.warn(name, "has no .prj: taken as WGS 84 longitude and latitude")
    system = system_of_wkt(projection) if projection else system_named("EPSG:4326")
    contents.expect(range(_position_count(parts[".shp"] or b"")))
    streams: dict[str, Any] = {
        suffix[1:]: BytesIO(content)
        for suffix, content in parts.items()
        if content is not None and suffix in (".shp", ".shx", ".dbf")
    }
    encoding = (parts[".cpg"] or b"").decode("ascii", "replace").strip() or "utf-8"
    try:
        with shapefile.Reader(**streams, encoding=encoding, encodingErrors="replace") as layer:
            if parts[".dbf"] is not None:
                warn_of_fields((field[0] for field in layer.fields), name, contents)
            _read_shapes(layer, name, system, contents, parts[".dbf"] is not None)
    except GeometryError:
        raise
    except Exception as error:  # of damaged files, pyshp raises what struct, codecs and it raise
        raise GeometryError(f"is damaged: {type(error).__name__}: {str(error)[:200]}") from None
    system.warn_of_accuracy(contents, name)


def _read_shapes(
    layer: "shapefile.Reader",
    name: str,
    system: ReferenceSystem,
    contents: Contents,
    has_records: bool,
) -> None:
    for index in range(len(layer)):
        if index > MAX_FEATURES:
            raise GeometryError(f"has more than {MAX_FEATURES} shapes", "split the layer")
        shape = layer.shape(index)
        values = layer.record(index).as_dict() if has_records else {}
        lower = {str(key).lower(): value for key, value in values.items()}
        title = next(
            (str(lower[key]).strip() for key in _NAME_FIELDS if lower.get(key) not in (None, "")),
            "",
        )
        where = f"{name} shape {index + 1}" + (f" {title!r}" if title else "")
        if shape.shapeType == shapefile.NULL:
            contents.warn(where, "has no geometry")
            continue
        frame = stated_frame(values)
        if not frame and shape.shapeType in _WITH_Z:
            of = f" of {system.name!r} are converted to" if system.has_heights else " are taken as"
            contents.warn(
                name,
                f"its Z values{of} altitudes above mean sea level",
                "a field alt_frame may say relative or terrain",
            )
        with contents.feature(where):
            geometry = _geometry(shape, where, contents)
            if shape.shapeType in _WITH_Z and not system.has_heights:
                frame = frame or "amsl"
            properties = {"name": title, "altitude_frame": frame}
            feature = {"type": "Feature", "properties": properties, "geometry": geometry}
            read_feature(feature, where, contents, system)


def _geometry(shape: "shapefile.Shape", where: str, contents: Contents) -> dict[str, Any]:
    """Return a shape as GeoJSON in its own reference system.

    By index: pyshp 3.1.6 leaves the Z values out of `__geo_interface__`, and a line may pass a
    place twice at different heights.
    """
    kind = shape.shapeType
    places = [[x, y] for x, y, *_ in shape.points]
    if kind in _WITH_Z:
        missing = []
        for number, (place, z) in enumerate(zip(places, shape.z, strict=True), start=1):
            if isnan(z) or z <= _NO_DATA:
                missing.append(str(number))
            else:
                place.append(z)
        if missing:
            contents.warn(where, f"has no height at position {', '.join(missing)[:200]}")
    if any(each is not None for each in getattr(shape, "m", ())):
        contents.warn(where, "its measures (M values) are not read")
    if kind in shapefile.Point_shapeTypes:
        return {"type": "Point", "coordinates": places[0] if places else []}
    if kind in shapefile.MultiPoint_shapeTypes:
        return {"type": "MultiPoint", "coordinates": places}
    if kind not in (*shapefile.Polyline_shapeTypes, *shapefile.Polygon_shapeTypes):
        remedy = "export points, multi-points, lines or polygons"
        raise GeometryError(f"is a {shape.shapeTypeName}", remedy)
    ends = [*shape.parts[1:], len(places)]
    parts = [places[start:end] for start, end in zip(shape.parts, ends, strict=True)]
    if kind in shapefile.Polyline_shapeTypes:
        return {"type": "MultiLineString", "coordinates": parts}
    # pyshp decides by x and y which ring is a hole of which, and returns the lists that it got.
    flat = [[(x, y) for x, y, *_ in part] for part in parts]
    part_of = {id(ring): part for ring, part in zip(flat, parts, strict=True)}
    polygons = shapefile.organize_polygon_rings(flat)
    rings = [[part_of[id(ring)] for ring in polygon] for polygon in polygons]
    return {"type": "MultiPolygon", "coordinates": rings}


def _position_count(shp: bytes) -> int:
    """Return how many positions a .shp holds, by the headers of its records."""
    count, at = 0, 100
    try:
        while at + 12 <= len(shp):
            (words,) = struct.unpack_from(">i", shp, at + 4)
            (kind,) = struct.unpack_from("<i", shp, at + 8)
            if kind in shapefile.Point_shapeTypes:
                count += 1
            elif kind in shapefile.MultiPoint_shapeTypes:
                count += max(0, struct.unpack_from("<i", shp, at + 44)[0])
            elif kind != shapefile.NULL:
                count += max(0, struct.unpack_from("<i", shp, at + 48)[0])
            at += 8 + 2 * max(words, 2)
    except struct.error:
        pass  # it ends within a record: the reader says so
    return count


def _part(archive: Archive, name: str, suffix: str) -> bytes | None:
    wanted = PurePosixPath(name).with_suffix(suffix).as_posix().lower()
    found = next((each for each in archive.namelist() if each.lower() == wanted), None)
    return None if found is None else member(archive, found)
