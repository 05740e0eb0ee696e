"""Shapefiles (Esri), each layer with its .dbf and .prj, in a ZIP archive."""

from io import BytesIO
from pathlib import PurePosixPath
from typing import Any

import shapefile

from m2pem.geo.geojson import GeometryError
from m2pem.geo.geometry_files.archive import Archive, archive_of, member
from m2pem.geo.geometry_files.contents import MAX_FEATURES, Contents, FeatureProblemError
from m2pem.geo.geometry_files.geojson_file import read_feature

_NAME_FIELDS = ("name", "title", "label", "id")
_FRAME_FIELDS = ("altitude_frame", "alt_frame", "altitude_f")
"""Names of fields have at most ten characters."""

_WITH_Z = frozenset(
    {shapefile.POINTZ, shapefile.POLYLINEZ, shapefile.POLYGONZ, shapefile.MULTIPOINTZ}
)
_REPROJECT = "export the layer as WGS 84 (EPSG:4326)"


def read_shapefiles(content: bytes, contents: Contents) -> None:
    """Collect the shapes of all layers in an archive.

    Raises:
        GeometryError: it is no archive, or has no layer.
    """
    with archive_of(content) as archive:
        layers = [name for name in archive.namelist() if name.lower().endswith(".shp")]
        if not layers:
            raise FeatureProblemError("has no .shp", "put .shp, .dbf, .shx and .prj into it")
        for name in layers:
            with contents.feature(name):
                _read_layer(archive, name, contents)


def _read_layer(archive: Archive, name: str, contents: Contents) -> None:
    parts = {
        suffix: _part(archive, name, suffix) for suffix in (".shp", ".shx", ".dbf", ".prj", ".cpg")
    }
    projection = (parts[".prj"] or b"").decode("utf-8", "replace").strip()
    if not projection:
        contents.warn(name, "has no .prj: taken as WGS 84 longitude and latitude")
    elif not _is_wgs84(projection):
        found = projection.partition('"')[2].partition('"')[0]
        raise FeatureProblemError(f"its coordinates are of {found[:80]!r}, not WGS 84", _REPROJECT)
    streams: dict[str, Any] = {
        suffix[1:]: BytesIO(content)
        for suffix, content in parts.items()
        if content is not None and suffix in (".shp", ".shx", ".dbf")
    }
    encoding = (parts[".cpg"] or b"").decode("ascii", "replace").strip() or "utf-8"
    try:
        with shapefile.Reader(**streams, encoding=encoding, encodingErrors="replace") as layer:
            _read_shapes(layer, name, contents)
    except GeometryError:
        raise
    except Exception as error:  # of damaged files, pyshp raises what struct, codecs and it raise
        raise GeometryError(f"is damaged: {type(error).__name__}: {str(error)[:200]}") from None


def _read_shapes(layer: "shapefile.Reader", name: str, contents: Contents) -> None:
    warned = False
    for index in range(len(layer)):
        if index > MAX_FEATURES:
            raise FeatureProblemError(f"has more than {MAX_FEATURES} shapes", "split the layer")
        shape = layer.shape(index)
        values = layer.record(index).as_dict() if layer.dbf is not None else {}
        lower = {str(key).lower(): value for key, value in values.items()}
        title = next(
            (str(lower[key]).strip() for key in _NAME_FIELDS if lower.get(key) not in (None, "")),
            "",
        )
        where = f"{name} shape {index + 1}" + (f" {title!r}" if title else "")
        if shape.shapeType == shapefile.NULL:
            contents.warn(where, "has no geometry")
            continue
        frame = next((str(lower[key]) for key in _FRAME_FIELDS if lower.get(key)), None)
        if frame is None and shape.shapeType in _WITH_Z:
            frame = "amsl"
            if not warned:
                warned = True
                contents.warn(
                    name,
                    "its Z values are taken as altitudes above mean sea level",
                    "a field alt_frame may say relative or terrain",
                )
        properties = {"name": title, **({"altitude_frame": frame} if frame else {})}
        geometry = _with_altitudes(shape)
        read_feature(
            {"type": "Feature", "properties": properties, "geometry": geometry}, where, contents
        )


def _with_altitudes(shape: "shapefile.Shape") -> Any:
    """Return a shape as GeoJSON; pyshp leaves the Z values of lines and polygons out."""
    geometry = shape.__geo_interface__
    if shape.shapeType not in _WITH_Z:
        return geometry
    altitudes = dict(zip(((x, y) for x, y, *_ in shape.points), shape.z, strict=False))

    def place(value: Any) -> Any:
        if value and isinstance(value[0], list | tuple):
            return [place(each) for each in value]
        altitude = altitudes.get(tuple(value[:2]))
        return list(value[:2]) if altitude is None else [*value[:2], altitude]

    return {**geometry, "coordinates": place(geometry["coordinates"])}


def _part(archive: Archive, name: str, suffix: str) -> bytes | None:
    wanted = PurePosixPath(name).with_suffix(suffix).as_posix().lower()
    found = next((each for each in archive.namelist() if each.lower() == wanted), None)
    return None if found is None else member(archive, found)


def _is_wgs84(projection: str) -> bool:
    text = projection.upper().replace(" ", "").replace("_", "")
    return text.startswith(("GEOGCS", "GEOGCRS", "GEODCRS")) and (
        "WGS84" in text or "WGS1984" in text or "WORLDGEODETICSYSTEM1984" in text
    )
