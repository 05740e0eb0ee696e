"""GeoJSON (RFC 7946) with any number of features."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from m2pem.geo.file_text import decoded, parsed_json
from m2pem.geo.geojson import GeometryError, as_geojson, check_crs, parse_geojson
from m2pem.geo.geometry_files.contents import Contents, NamedGeometry

MAX_DEPTH = 10
"""How deep collections of geometries may nest."""

_PARTS = {"MultiLineString": "LineString", "MultiPolygon": "Polygon"}
_NAME_KEYS = ("name", "Name", "NAME", "title", "label", "id", "ID")


def read_geojson(content: bytes, contents: Contents) -> None:
    """Collect all features of a file: lines and multi-points as routes, polygons as areas.

    Raises:
        GeometryError: it is not GeoJSON.
    """
    value = parsed_json(decoded(content))
    if not isinstance(value, Mapping) or not isinstance(value.get("type"), str):
        raise GeometryError("is not GeoJSON: an object with 'type' is expected")
    check_crs(value)
    if value["type"] != "FeatureCollection":
        read_feature(value, "", contents)
        return
    features = value.get("features")
    if not isinstance(features, list):
        raise GeometryError("features: a list of features is expected")
    for index, feature in enumerate(features):
        where = f"features[{index}]"
        name = _name(feature)
        read_feature(feature, f"{where} {name!r}" if name else where, contents)


def read_feature(feature: object, where: str, contents: Contents) -> None:
    """Collect the geometries of a Feature, or of a geometry alone; problems are of `where`."""
    with contents.feature(where):
        if not isinstance(feature, Mapping):
            raise GeometryError("is not GeoJSON: an object with 'type' is expected")
        is_feature = feature.get("type") == "Feature"
        geometry = feature.get("geometry") if is_feature else feature
        properties = feature.get("properties") if is_feature else None
        if geometry is None:
            raise GeometryError("has no geometry")
        parts = _parts(geometry)
        read = [
            parse_geojson({"type": "Feature", "properties": properties, "geometry": part})
            for part in parts
        ]
        for part in read:
            contents.add(_name(feature), part)


def write_geojson(geometries: Sequence[NamedGeometry]) -> bytes:
    """Return a FeatureCollection in UTF-8; each feature has its `name`."""
    features = []
    for each in geometries:
        feature = as_geojson(each.geometry)
        feature["properties"] = {"name": each.name, **feature["properties"]}
        features.append(feature)
    collection = {"type": "FeatureCollection", "features": features}
    return (json.dumps(collection, ensure_ascii=False, indent=1) + "\n").encode()


def _parts(geometry: object, depth: int = 0) -> list[Any]:
    """Return the single geometries of a geometry."""
    if not isinstance(geometry, Mapping) or depth > MAX_DEPTH:
        return [geometry]
    kind = geometry.get("type")
    if kind == "GeometryCollection":
        members = geometry.get("geometries")
        if not isinstance(members, list):
            raise GeometryError("geometries: a list of geometries is expected")
        return [part for member in members for part in _parts(member, depth + 1)]
    if kind in _PARTS:
        members = geometry.get("coordinates")
        if not isinstance(members, list | tuple):
            raise GeometryError("coordinates: a list is expected")
        return [{"type": _PARTS[str(kind)], "coordinates": member} for member in members]
    return [geometry]


def _name(feature: object) -> str:
    if not isinstance(feature, Mapping):
        return ""
    properties = feature.get("properties")
    for source in (properties, feature):
        if isinstance(source, Mapping):
            for key in _NAME_KEYS:
                if isinstance(source.get(key), str | int) and str(source[key]).strip():
                    return str(source[key]).strip()
    return ""
