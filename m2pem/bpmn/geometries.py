"""The routes, areas and points that a mission file has itself: `m2pem:geometry`, as GeoJSON."""

import json
import re

from lxml import etree

from m2pem.bpmn.context import ReadingContext
from m2pem.bpmn.rules.behaviors import BAD_GEOMETRY, MENDED_GEOMETRY
from m2pem.bpmn.xml import BPMN, M2PEM
from m2pem.geo.geojson import GeometryError, parse_geojson

_NAME = re.compile(r"[^\s/]+")


def read_geometries(context: ReadingContext, process: etree._Element, identifier: str) -> None:
    """Read the geometries of a process; they are known in the whole mission."""
    for outer in process.iterchildren(BPMN + "extensionElements"):
        for element in outer.iterchildren(M2PEM + "geometry"):
            _read(context, element, identifier)


def _read(context: ReadingContext, element: etree._Element, process: str) -> None:
    def refuse(message: str, remedy: str) -> None:
        context.findings.error(element, process, BAD_GEOMETRY, message, remedy)

    name = element.get("name", "")
    if not _NAME.fullmatch(name):
        refuse(
            f"a geometry has no name that tasks can use: {name!r}",
            "give it a name without white space and '/'",
        )
    elif name in context.geometries:
        refuse(f"two geometries are named '{name}'", "rename one, and the parameters that mean it")
    else:
        try:
            context.geometries[name] = parse_geojson(
                _object(element.text or ""),
                lambda said: context.findings.warning(
                    element, process, MENDED_GEOMETRY, f"geometry '{name}': {said}"
                ),
            )
        except GeometryError as error:
            refuse(f"geometry '{name}' {error}", "draw it again, or write GeoJSON (RFC 7946)")


def _object(text: str) -> dict[str, object]:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise GeometryError("is not a JSON object")
    return value
