"""GeoJSON (RFC 7946) with any number of features."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from m2pem.geo.geojson import (
    FRAMES,
    GeometryError,
    as_geojson,
    check_crs,
    decoded,
    is_wgs84,
    parse_geojson,
    parsed_json,
    stated_frame,
)
from m2pem.geo.geometry_files.contents import Contents, NamedGeometry
from m2pem.geo.geometry_files.csv_file import warn_of_fields

if TYPE_CHECKING:
    from m2pem.geo.geometry_files.reference_system import ReferenceSystem

MAX_DEPTH = 10
"""How deep collections of geometries may nest."""

_PARTS = {"MultiLineString": "LineString", "MultiPolygon": "Polygon"}
_NUMBER = r"\s*+-?\d[\d.eE+-]*+\s*+"
_POSITION = re.compile(rf"\[{_NUMBER},{_NUMBER}(?:,{_NUMBER})?\]")
_NAME_KEYS = ("name", "Name", "NAME", "title", "label", "id", "ID")


def read_geojson(content: bytes, contents: Contents) -> None:
    """Collect all features of a file: lines and multi-points as routes, polygons as areas.

    Raises:
        GeometryError: it is not GeoJSON.
    """
    text = decoded(content)
    # Before they are parsed: half a million positions are 150 MB of lists.
    contents.expect(_POSITION.finditer(text))
    value = parsed_json(text)
    if not isinstance(value, Mapping) or not isinstance(value.get("type"), str):
        raise GeometryError("is not GeoJSON: an object with 'type' is expected")
    system = None
    if not is_wgs84(value.get("crs")):
        # Loaded when needed: every command line reads fleets, few files have another system.
        from m2pem.geo.geometry_files.reference_system import system_named  # noqa: PLC0415

        system = system_named(value["crs"])
        value = {**value, "crs": None}
    if value["type"] == "FeatureCollection":
        _read_features(value, contents, system)
    else:
        read_feature(value, "", contents, system)
    if system is not None:
        system.warn_of_accuracy(contents, "")


def _read_features(
    value: Mapping[str, Any], contents: Contents, system: "ReferenceSystem | None"
) -> None:
    features = value.get("features")
    if not isinstance(features, list):
        raise GeometryError("features: a list of features is expected")
    given = [each.get("properties") for each in features if isinstance(each, Mapping)]
    names = (str(key) for each in given if isinstance(each, Mapping) for key in each)
    warn_of_fields(names, "", contents)
    for index, feature in enumerate(features):
        if contents.is_full:
            break
        where = f"features[{index}]"
        name = _name(feature)
        read_feature(feature, f"{where} {name!r}" if name else where, contents, system)


def read_feature(
    feature: object, where: str, contents: Contents, system: "ReferenceSystem | None" = None
) -> None:
    """Collect the geometries of a Feature, or of a geometry alone; problems are of `where`.

    `system`: that of its positions, if it is not WGS 84.
    """
    with contents.feature(where):
        if not isinstance(feature, Mapping):
            raise GeometryError("is not GeoJSON: an object with 'type' is expected")
        check_crs(feature)
        is_feature = feature.get("type") == "Feature"
        geometry = feature.get("geometry") if is_feature else feature
        properties = feature.get("properties") if is_feature else None
        if geometry is None:
            raise GeometryError("has no geometry")
        parts = _parts(geometry)
        if system is not None:
            given = properties if isinstance(properties, Mapping) else {}
            frame = stated_frame(given) or str(given.get(FRAMES) or "")
            parts = [
                {**each, "coordinates": _in_wgs84(each.get("coordinates"), system, frame)}
                if isinstance(each, Mapping)
                else each
                for each in parts
            ]
            if system.has_heights and not frame:
                properties = {**given, "altitude_frame": "amsl"}
        read = [
            parse_geojson(
                {"type": "Feature", "properties": properties, "geometry": part},
                partial(contents.warn, where),
            )
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


def _in_wgs84(value: Any, system: "ReferenceSystem", frame: str) -> Any:
    """Return positions, in lists of any depth, in WGS 84; what is none stays as it is."""
    if _is_position(value):
        return system.to_wgs84([value], frame)[0]
    if not isinstance(value, list):
        return value
    if value and all(map(_is_position, value)):
        return system.to_wgs84(value, frame)
    return [_in_wgs84(each, system, frame) for each in value]


def _is_position(value: object) -> bool:
    return (
        isinstance(value, list)
        and len(value) in (2, 3)
        and all(isinstance(each, int | float) and abs(each) < 1e300 for each in value)
    )


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
