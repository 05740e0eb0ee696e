"""KML 2.3 and KMZ (OGC 12-007r2): its placemarks and tracks.

An altitude above home, which KML does not have, is written as above ground, and the extended data
`altitude_frame` says what it is; the extended data `speeds_m_s` are those of a route's waypoints.
"""

import json
import re
from collections.abc import Iterator, Sequence
from io import BytesIO
from typing import TypeAlias

from lxml import etree

from m2pem.geo.file_text import parsed_json
from m2pem.geo.geojson import (
    ALTITUDE_FRAMES,
    SPEEDS,
    GeometryError,
    checked,
    coordinate,
    with_speeds,
)
from m2pem.geo.geometry_files.archive import archive_of, member
from m2pem.geo.geometry_files.contents import Contents, FeatureProblemError, NamedGeometry
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_KML = "http://www.opengis.net/kml/2.2"
_FRAME_OF = {"relativeToGround": "terrain", "absolute": "amsl"}
_CLAMPED = frozenset({"", "clampToGround", "clampToSeaFloor"})
_MODE_OF = {"relative": "relativeToGround", "terrain": "relativeToGround", "amsl": "absolute"}
_SPACE_AFTER_COMMA = re.compile(r",\s+")
_SPACE_BEFORE_COMMA = re.compile(r"(?<!\s)\s+,")
"""Begins only where the space does: otherwise the time grows with the square of its length."""
_PARTS = ("MultiGeometry", "MultiTrack")
_SINGLE = ("Point", "LineString", "LinearRing", "Polygon", "Track", *_PARTS)
_ELSEWHERE = ("NetworkLink", "GroundOverlay", "PhotoOverlay")

Element: TypeAlias = etree._Element


def read_kmz(content: bytes, contents: Contents) -> None:
    """Collect the placemarks of the document in a KMZ archive.

    Raises:
        GeometryError: it is no archive, or has no document.
    """
    with archive_of(content) as archive:
        names = [name for name in archive.namelist() if name.lower().endswith(".kml")]
        if not names:
            raise FeatureProblemError("has no .kml", "save it again as .kml or .kmz")
        document = member(archive, "doc.kml" if "doc.kml" in names else names[0])
    read_kml(document, contents)


def read_kml(content: bytes, contents: Contents) -> None:
    """Collect the placemarks of a file: points, lines, rings, polygons and tracks.

    Raises:
        GeometryError: it is not KML.
    """
    root = _root(content)
    for element in root.iter(etree.Element):
        local = _local(element)
        if local == "Placemark":
            _read_placemark(element, contents)
        elif local in _ELSEWHERE:
            name = _text(element, "name")
            contents.warn(
                f"{local} {name!r}" if name else local,
                "what it refers to is not in this file",
                "save that as a file of its own" if local == "NetworkLink" else "",
            )


def _root(content: bytes) -> Element:
    # Before the parser: a document type could declare entities, and those could be huge.
    if b"<!DOCTYPE" in content[:100_000].upper() or b"<!ENTITY" in content[:100_000].upper():
        raise FeatureProblemError("has a document type", "save it as KML without one")
    parser = etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.parse(BytesIO(content), parser).getroot()
    except (etree.XMLSyntaxError, ValueError, OSError) as error:
        raise GeometryError(f"is not XML: {str(error)[:200]}") from None
    if root.getroottree().docinfo.internalDTD is not None:
        raise FeatureProblemError("has a document type", "save it as KML without one")
    if _local(root) not in ("kml", "Document", "Folder", "Placemark"):
        raise GeometryError(f"is not KML: its root is {_local(root)!r}, where 'kml' is expected")
    return root


def _read_placemark(placemark: Element, contents: Contents) -> None:
    name = _text(placemark, "name")
    line = placemark.sourceline or 0
    with contents.feature(f"placemark {name!r}" if name else f"placemark in line {line}"):
        frame = _data(placemark, "altitude_frame")
        if frame and frame not in ALTITUDE_FRAMES:
            known = ", ".join(ALTITUDE_FRAMES)
            raise FeatureProblemError(f"altitude_frame {frame!r} is not known", f"one of {known}")
        read = [_geometry(part, frame) for child in placemark for part in _parts(child)]
        if not read:
            raise GeometryError("has no point, line or polygon")
        speeds = _data(placemark, SPEEDS)
        for geometry in read:
            contents.add(name, with_speeds(geometry, parsed_json(speeds)) if speeds else geometry)


def _parts(element: Element) -> Iterator[Element]:
    """Yield the single geometries of an element, if it is one. Depth is bounded by the parser."""
    local = _local(element)
    if local in _PARTS:
        for child in element:
            yield from _parts(child)
    elif local in _SINGLE:
        yield element


def _geometry(element: Element, frame: str) -> Point | Route | Area:
    mode = _text(element, "altitudeMode")
    if not frame and mode not in _CLAMPED and mode not in _FRAME_OF:
        raise FeatureProblemError(
            f"altitudeMode {mode!r} is not known", f"one of clampToGround, {', '.join(_FRAME_OF)}"
        )
    keeps = bool(frame) or mode in _FRAME_OF
    frame = frame or _FRAME_OF.get(mode, "relative")
    local = _local(element)
    if local == "Polygon":
        rings = [
            _coordinates(ring, keeps)
            for boundary in ("outerBoundaryIs", "innerBoundaryIs")
            for ring in _rings(element, boundary)
        ]
        if not rings:
            raise GeometryError("a polygon has an outerBoundaryIs")
        closed = tuple(_closed(ring) for ring in rings)
        return Area(checked(closed), frame)
    positions = _track(element) if local == "Track" else _coordinates(element, keeps)
    if local == "Track" and mode in _CLAMPED:
        positions = [(latitude, longitude, None) for latitude, longitude, _ in positions]
    if local == "Point":
        if len(positions) != 1:
            raise GeometryError(f"a point has one position, not {len(positions)}")
        return Point(positions[0], frame)
    if not positions:
        raise GeometryError("has no position")
    return Route(tuple(positions), frame)


def _rings(polygon: Element, boundary: str) -> Iterator[Element]:
    for child in polygon:
        if _local(child) == boundary:
            yield from (ring for ring in child if _local(ring) == "LinearRing")


def _closed(ring: Sequence[Coordinate]) -> tuple[Coordinate, ...]:
    if len({corner[:2] for corner in ring}) < 3:
        raise GeometryError("a ring has at least three different corners")
    return tuple(ring) if ring[0][:2] == ring[-1][:2] else (*ring, ring[0])


def _coordinates(element: Element, keeps_altitude: bool) -> list[Coordinate]:
    words = _joined(_text(element, "coordinates")).split()
    positions = []
    for number, word in enumerate(words, start=1):
        parts = word.split(",")
        if not 2 <= len(parts) <= 3:
            raise FeatureProblemError(
                f"position {number}: {word[:60]!r} is no position", "write longitude,latitude"
            )
        positions.append(_position(parts, keeps_altitude, number))
    return positions


def _joined(text: str) -> str:
    """Return a list of positions without the space around commas, which some programs write."""
    return _SPACE_AFTER_COMMA.sub(",", _SPACE_BEFORE_COMMA.sub(",", text))


def _track(element: Element) -> list[Coordinate]:
    found = [child.text or "" for child in element if _local(child) == "coord"]
    positions = []
    for number, text in enumerate(found, start=1):
        parts = text.split()
        if not 2 <= len(parts) <= 3:
            raise GeometryError(f"position {number}: {text[:60]!r} is no position")
        positions.append(_position(parts, True, number))
    return positions


def _position(parts: Sequence[str], keeps_altitude: bool, number: int) -> Coordinate:
    try:
        longitude, latitude, *altitude = (float(part) for part in parts)
    except ValueError:
        raise GeometryError(f"position {number}: {','.join(parts)[:60]!r} is no number") from None
    altitude_m = altitude[0] if altitude and keeps_altitude else None
    return coordinate(latitude, longitude, altitude_m, f"position {number}")


def _local(element: Element) -> str:
    tag = element.tag
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


def _text(element: Element, child: str) -> str:
    found = next((each for each in element if _local(each) == child), None)
    return "" if found is None else (found.text or "").strip()


def _data(placemark: Element, name: str) -> str:
    for extended in placemark:
        if _local(extended) == "ExtendedData":
            for data in extended.iter(etree.Element):
                if data.get("name") == name:
                    return _text(data, "value") or (data.text or "").strip()
    return ""


def write_kml(geometries: Sequence[NamedGeometry]) -> bytes:
    """Return a KML document with a placemark for each geometry."""
    root = etree.Element(f"{{{_KML}}}kml", nsmap={None: _KML})  # type: ignore[dict-item]
    document = _child(root, "Document")
    for each in geometries:
        placemark = _child(document, "Placemark")
        _child(placemark, "name", each.name)
        data = {"altitude_frame": each.geometry.altitude_frame}
        if isinstance(each.geometry, Route) and each.geometry.speeds_m_s:
            data[SPEEDS] = json.dumps(each.geometry.speeds_m_s)
        extended = _child(placemark, "ExtendedData")
        for name, value in data.items():
            element = _child(extended, "Data")
            element.set("name", name)
            _child(element, "value", value)
        _write_geometry(placemark, each.geometry)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _write_geometry(placemark: Element, geometry: Point | Route | Area) -> None:
    mode = _MODE_OF[geometry.altitude_frame]
    if isinstance(geometry, Area):
        polygon = _child(placemark, "Polygon")
        _child(polygon, "altitudeMode", mode)
        for index, ring in enumerate(geometry.rings):
            boundary = _child(polygon, "innerBoundaryIs" if index else "outerBoundaryIs")
            _child(_child(boundary, "LinearRing"), "coordinates", _written(ring))
        return
    point = isinstance(geometry, Point)
    positions = (geometry.position,) if isinstance(geometry, Point) else geometry.waypoints
    element = _child(placemark, "Point" if point else "LineString")
    _child(element, "altitudeMode", mode)
    _child(element, "coordinates", _written(positions))


def _written(positions: Sequence[Coordinate]) -> str:
    return " ".join(
        ",".join(repr(number) for number in (longitude, latitude, altitude) if number is not None)
        for latitude, longitude, altitude in positions
    )


def _child(parent: Element, name: str, text: str | None = None) -> Element:
    child = etree.SubElement(parent, f"{{{_KML}}}{name}")
    child.text = text
    return child
