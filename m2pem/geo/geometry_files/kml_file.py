"""KML 2.3 and KMZ (OGC 12-007r2): its placemarks and tracks.

An altitude above home, which KML does not have, is written as above ground, and the extended data
`altitude_frame` says what it is; the extended data `speeds_m_s` and `altitude_frames` are those of
a route's waypoints.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain
from posixpath import dirname, join, normpath
from urllib.parse import unquote

from lxml import etree
from lxml.builder import ElementMaker

from m2pem.geo.geojson import (
    FRAMES,
    KML_CLAMPED,
    KML_FRAMES,
    SPEEDS,
    GeometryError,
    as_geojson,
    checked,
    checked_frame,
    closed_ring,
    parsed_json,
    with_frames,
    with_speeds,
)
from m2pem.geo.geometry_files.archive import archive_of, member
from m2pem.geo.geometry_files.contents import Contents, NamedGeometry
from m2pem.geo.geometry_files.csv_file import warn_of_fields
from m2pem.geo.geometry_files.kml_elements import (
    POSITION,
    Element,
    child_text,
    coordinates,
    kml_root,
    local_name,
    position,
)
from m2pem.geo.geometry_files.wpml import has_waylines, read_waylines
from m2pem.mission.geometry import Area, Coordinate, Point, Route

_KML = "http://www.opengis.net/kml/2.2"
_element: Callable[..., Element] = ElementMaker(namespace=_KML, nsmap={None: _KML})
_MODE_OF = {"relative": "relativeToGround", "terrain": "relativeToGround", "amsl": "absolute"}
_PARTS = ("MultiGeometry", "MultiTrack")
_SINGLE = ("Point", "LineString", "LinearRing", "Polygon", "Track", "Model", *_PARTS)
_PICTURE = ("is a picture, which is not read", "")
_NOT_READ = {
    "NetworkLink": ("what it refers to is not in this file", "save that as a separate file"),
    "GroundOverlay": _PICTURE,
    "PhotoOverlay": _PICTURE,
    "Tour": ("is a flight of the viewer's camera, which is not read", ""),
    "Update": ("its changes of other features are not made", "save the changed features"),
}


def read_kmz(content: bytes, contents: Contents) -> None:
    """Collect the placemarks of the document in a KMZ archive, and of documents that it links.

    Of a drone maker's archive (WPML) its `waylines.wpml` is read, which has them as they are flown.

    Raises:
        GeometryError: it is no archive, or has no document.
    """
    with archive_of(content) as archive:
        members = [name for name in archive.namelist() if name.lower().endswith(".kml")]
        waylines = [each for each in archive.namelist() if each.lower().endswith("waylines.wpml")]
        if not members and not waylines:
            raise GeometryError("has no .kml", "save it again as .kml or .kmz")
        first = (waylines or [each for each in members if each == "doc.kml"] or members)[0]
        documents = [first]
        for name in documents:  # which grows by what they link
            with contents.feature("" if name == first else name):
                linked = _read(member(archive, name), contents, members, name)
                documents += [each for each in linked if each not in documents]
        left = [each for each in members if each not in documents and not waylines]
        if left:
            message = f"is not read: {first} does not link it"
            contents.warn(", ".join(left)[:200], message, "save it as a file")


def read_kml(content: bytes, contents: Contents) -> None:
    """Collect the placemarks of a file: points, lines, rings, polygons and tracks.

    Raises:
        GeometryError: it is not KML.
    """
    _read(content, contents, (), "")


def _read(content: bytes, contents: Contents, members: Sequence[str], base: str) -> list[str]:
    """Return which of the archive's members it links, once each."""
    root = kml_root(content)
    texts = (element.text or "" for element in root.iter("{*}coordinates"))
    places = (each for text in texts for each in POSITION.finditer(text))
    contents.expect(chain(root.iter("{*}coord"), places))
    linked: dict[str, None] = {}
    if has_waylines(root):
        read_waylines(root, contents)
        return []
    fields = (str(each.get("name", "")) for each in root.iter("{*}Data", "{*}SimpleData"))
    warn_of_fields(fields, base, contents)
    for element in root.iter(*(f"{{*}}{name}" for name in ("Placemark", *_NOT_READ))):
        local = local_name(element)
        if contents.is_full:
            break
        if any(True for _ in element.iterancestors("{*}Update")):
            continue
        if local == "Placemark":
            _read_placemark(element, contents)
            continue
        href = next(element.iter("{*}href"), None) if local == "NetworkLink" else None
        text = "" if href is None else unquote((href.text or "").strip()).partition("#")[0]
        target = normpath(join(dirname(base), text))
        if target in members:
            linked[target] = None
        else:
            name = child_text(element, "name")
            contents.warn(f"{local} {name!r}" if name else local, *_NOT_READ[local])
    return list(linked)


def _read_placemark(placemark: Element, contents: Contents) -> None:
    name = child_text(placemark, "name")
    line = placemark.sourceline or 0
    where = f"placemark {name!r}" if name else f"placemark in line {line}"
    with contents.feature(where):
        frame = _data(placemark, "altitude_frame")
        if frame:
            checked_frame(frame)
        parts = [part for child in placemark for part in _parts(child)]
        read = [_geometry(part, frame, where, contents) for part in parts]
        if not read:
            raise GeometryError("has no point, line or polygon")
        speeds, frames = _data(placemark, SPEEDS), _data(placemark, FRAMES)
        for each in read:
            geometry = with_frames(each, parsed_json(frames)) if frames else each
            contents.add(name, with_speeds(geometry, parsed_json(speeds)) if speeds else geometry)


def _parts(element: Element) -> Iterator[Element]:
    """Yield the single geometries of an element, if it is one. Depth is bounded by the parser."""
    local = local_name(element)
    if local in _PARTS:
        for child in element:
            yield from _parts(child)
    elif local in _SINGLE:
        yield element


def _geometry(
    element: Element, own_frame: str, where: str, contents: Contents
) -> Point | Route | Area:
    local = local_name(element)
    mode = _mode(element)
    if local == "Model":
        raise GeometryError("a Model is not read", "give its place as a Point")
    if not own_frame and mode not in ("", *KML_CLAMPED, *KML_FRAMES):
        is_known = "is above the sea floor" if mode == "relativeToSeaFloor" else "is not known"
        raise GeometryError(
            f"altitudeMode {mode!r} {is_known}", f"one of clampToGround, {', '.join(KML_FRAMES)}"
        )
    keeps = bool(own_frame) or mode in KML_FRAMES
    frame = own_frame or KML_FRAMES.get(mode, "relative")
    if local == "Polygon":
        rings = [
            _raised(element, coordinates(ring, keeps))
            for boundary in ("outerBoundaryIs", "innerBoundaryIs")
            for ring in element.iterfind(f"{{*}}{boundary}/{{*}}LinearRing")
        ]
        if not rings:
            raise GeometryError("a polygon has an outerBoundaryIs")
        return Area(checked(tuple(map(closed_ring, rings)), partial(contents.warn, where)), frame)
    if local == "Track":
        positions = _track(element, keeps, where, contents)
    else:
        positions = _raised(element, coordinates(element, keeps))
    if local == "Point":
        if len(positions) != 1:
            raise GeometryError(f"a point has one position, not {len(positions)}")
        return Point(positions[0], frame)
    if not positions:
        raise GeometryError("has no position")
    missing = [str(n) for n, each in enumerate(positions, start=1) if each[2] is None]
    if not own_frame and 0 < len(missing) < len(positions):
        contents.warn(where, f"has no altitude at position {', '.join(missing)[:200]}")
    return Route(tuple(positions), frame)


def _mode(element: Element) -> str:
    """Return its altitude mode (`gx:` or not): its own, or that of the parts of its parent."""
    parent = element.getparent()
    of_all = parent is not None and local_name(parent) in _PARTS
    mode = child_text(element, "altitudeMode")
    return mode or (_mode(parent) if of_all and parent is not None else "")


def _raised(element: Element, positions: list[Coordinate]) -> list[Coordinate]:
    """Add the `gx:altitudeOffset` of an element, in metres, to what altitudes there are."""
    text = child_text(element, "altitudeOffset")
    if not text:
        return positions
    try:
        offset_m = float(text)
    except ValueError:
        raise GeometryError(f"altitudeOffset {text[:20]!r} is not a number") from None
    return [(lat, lon, None if alt is None else alt + offset_m) for lat, lon, alt in positions]


def _track(
    element: Element, keeps_altitude: bool, where: str, contents: Contents
) -> list[Coordinate]:
    """Return the samples of a track. An empty one means that there was no fix: GDAL 3.12.4 reads it
    as 0, 0, 0."""
    positions = []
    for number, child in enumerate(element.iterchildren("{*}coord"), start=1):
        text = child.text or ""
        parts = text.split()
        if not parts:
            contents.warn(where, f"position {number}: is empty, and left out")
            continue
        if not 2 <= len(parts) <= 3:
            raise GeometryError(f"position {number}: {text[:60]!r} is no position")
        positions.append(position(parts, keeps_altitude, number))
    return positions


def _data(placemark: Element, name: str) -> str:
    found = placemark.find(f"{{*}}ExtendedData//*[@name='{name}']")
    return "" if found is None else child_text(found, "value") or (found.text or "").strip()


def write_kml(geometries: Sequence[NamedGeometry]) -> bytes:
    """Return a KML document with a placemark for each geometry."""
    document = _element("Document")
    for each in geometries:
        extended = _element("ExtendedData")
        for name, value in as_geojson(each.geometry)["properties"].items():
            text = value if isinstance(value, str) else json.dumps(value)
            extended.append(_element("Data", _element("value", text), name=name))
        title = _element("name", each.name)
        document.append(_element("Placemark", title, extended, _written(each.geometry)))
    root = _element("kml", document)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _written(geometry: Point | Route | Area) -> Element:
    frame = geometry.altitude_frame
    if isinstance(geometry, Area):
        outer, *holes = (_element("LinearRing", _coordinates(ring)) for ring in geometry.rings)
        inner = (_element("innerBoundaryIs", hole) for hole in holes)
        mode = _altitude_mode(geometry.rings[0], frame)
        return _element("Polygon", mode, _element("outerBoundaryIs", outer), *inner)
    if isinstance(geometry, Point):
        place = [geometry.position]
        return _element("Point", _altitude_mode(place, frame), _coordinates(place))
    places = geometry.waypoints
    # One mode holds for all of a line; where it is clamped to the ground, it follows it.
    mode = _altitude_mode([] if geometry.altitude_frames else places, frame)
    return _element("LineString", _element("tessellate", "1"), mode, _coordinates(places))


def _altitude_mode(positions: Sequence[Coordinate], frame: str) -> Element:
    has_altitude = any(altitude_m is not None for _, _, altitude_m in positions)
    return _element("altitudeMode", _MODE_OF[frame] if has_altitude else "clampToGround")


def _coordinates(positions: Sequence[Coordinate]) -> Element:
    places = (
        ",".join(repr(each) for each in (longitude, latitude, altitude) if each is not None)
        for latitude, longitude, altitude in positions
    )
    return _element("coordinates", " ".join(places))
