"""Elements of KML: its tree, their names without prefixes, and positions."""

import re
from collections.abc import Sequence
from io import BytesIO
from typing import TypeAlias

from lxml import etree

from m2pem.geo.geojson import GeometryError, coordinate
from m2pem.mission.geometry import Coordinate

Element: TypeAlias = etree._Element

POSITION = re.compile(r"[^\s,]+(?:\s*+,\s*+[^\s,]+)*")
_SPACE_AFTER_COMMA = re.compile(r",\s+")
_SPACE_BEFORE_COMMA = re.compile(r"(?<!\s)\s+,")
"""Begins only where the space does: otherwise the time grows with the square of its length."""

_BEFORE_ROOT = re.compile(
    rb"(?:\xef\xbb\xbf)?(?>(?:\s+|<\?.*?\?>|<!--.*?-->)*)<[\w.:-]+", re.DOTALL
)
_USED_PREFIX = re.compile(rb"[<\s]([A-Za-z_][\w.-]*+):[A-Za-z_]")
_MOST_PREFIXES = 50
_ROOTS = (
    *("kml", "Document", "Folder", "Placemark", "NetworkLink", "NetworkLinkControl", "Tour"),
    *("GroundOverlay", "PhotoOverlay", "ScreenOverlay"),
)


def kml_root(content: bytes) -> Element:
    """Return the root of a document.

    A prefix may be undeclared, as some programs write gx, xsi and wpml: names count without it.

    Raises:
        GeometryError: it is no XML, has a document type, or is another XML than KML.
    """
    # Before the parser: a document type could declare entities, and those could be huge.
    if b"<!DOCTYPE" in content[:100_000].upper() or b"<!ENTITY" in content[:100_000].upper():
        raise GeometryError("has a document type", "save it as KML without one")
    try:
        root = _parsed(content)
    except (etree.XMLSyntaxError, ValueError, OSError) as error:
        try:
            root = _parsed(_with_prefixes(content))
        except (etree.XMLSyntaxError, ValueError, OSError):
            raise GeometryError(f"is not XML: {str(error)[:200]}") from None
    if root.getroottree().docinfo.internalDTD is not None:
        raise GeometryError("has a document type", "save it as KML without one")
    if local_name(root) not in _ROOTS:
        found = local_name(root)
        raise GeometryError(f"is not KML: its root is {found!r}, where 'kml' is expected")
    return root


def _parsed(content: bytes) -> Element:
    parser = etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    return etree.parse(BytesIO(content), parser).getroot()


def _with_prefixes(content: bytes) -> bytes:
    """Declare at the root what is used and not declared there. lxml's `recover` would do more: it
    also takes a document that is cut off, without a word after 100 errors."""
    start = _BEFORE_ROOT.match(content)
    if start is None:
        return content
    tag = content[start.end() : content.find(b">", start.end())]
    used = set()
    for each in _USED_PREFIX.finditer(content):
        used.add(each[1])
        if len(used) > _MOST_PREFIXES:
            return content
    declared = b"".join(
        b' xmlns:%b="urn:prefix:%b"' % (each, each)
        for each in used - {b"xml", b"xmlns"}
        if not re.search(rb"xmlns:%b\s*=" % re.escape(each), tag)
    )
    return content[: start.end()] + declared + content[start.end() :]


def local_name(element: Element) -> str:
    """Return its name without namespace; "" of what is no element."""
    tag = element.tag
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


def child_text(element: Element, child: str) -> str:
    """Return the text of its first child of a name, without space around it; "" without one."""
    return (element.findtext(f"{{*}}{child}") or "").strip()


def coordinates(element: Element, keeps_altitude: bool) -> list[Coordinate]:
    """Return the positions of its `coordinates`; some programs write space around their commas.

    Raises:
        GeometryError: one is no position.
    """
    text = _SPACE_BEFORE_COMMA.sub(",", child_text(element, "coordinates"))
    positions = []
    for number, word in enumerate(_SPACE_AFTER_COMMA.sub(",", text).split(), start=1):
        parts = word.split(",")
        if not 2 <= len(parts) <= 3:
            raise GeometryError(
                f"position {number}: {word[:60]!r} is no position", "write longitude,latitude"
            )
        positions.append(position(parts, keeps_altitude, number))
    return positions


def position(parts: Sequence[str], keeps_altitude: bool, number: int) -> Coordinate:
    """Return the position of longitude, latitude and perhaps altitude.

    Raises:
        GeometryError: it is none; the message names its number.
    """
    try:
        longitude, latitude, *altitude = (float(part) for part in parts)
    except ValueError:
        raise GeometryError(f"position {number}: {','.join(parts)[:60]!r} is no number") from None
    altitude_m = altitude[0] if altitude and keeps_altitude else None
    return coordinate(latitude, longitude, altitude_m, f"position {number}")
