"""Reads the file of one route, area or point, which a fleet names."""

from collections.abc import Callable, Mapping
from pathlib import Path

from m2pem.findings import Severity, unreadable_remedy
from m2pem.geo.geojson import GeometryError, decoded, is_wgs84, kind_of, parse_geojson, parsed_json
from m2pem.geo.geometry_files import KEEP_OUT, READ_SUFFIXES, FileProblem, read_geometry_file
from m2pem.mission.geometry import Area, Point, Route
from m2pem.units import article

__all__ = ["GeometryError", "parse_geojson", "read_geometry"]

MAX_BYTES = 5_000_000
_SHOWN = 3
"""Errors of a file that a message has; of more, it has the number."""

_OF_ONE = (".geojson", ".json")
"""Files that are expected to hold one geometry; of the others one of the kind that is asked for."""


def read_geometry(
    path: Path, kind: str, warn: Callable[[FileProblem], object] | None = None
) -> Point | Route | Area:
    """Read `path` as a geometry of `kind`: "route", "area" or "point".

    `warn`: takes what is doubtful of it, such as what was left out.

    Raises:
        GeometryError: unreadable, not what its suffix says, or another kind of geometry; the
            message begins with the path (and the line, where there is one).
    """
    try:
        geometry = _read(path, kind, warn)
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None
    if kind_of(geometry) != kind:
        found = article(kind_of(geometry))
        raise GeometryError(f"{path}: holds {found}; {article(kind)} is expected")
    return geometry


def _read(
    path: Path, kind: str, warn: Callable[[FileProblem], object] | None
) -> Point | Route | Area:
    if path.suffix.lower() not in READ_SUFFIXES:
        raise GeometryError(f"has another suffix than {', '.join(READ_SUFFIXES)}")
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        remedy = unreadable_remedy(error)
        raise GeometryError(f"cannot be read: {error.strerror}; {remedy}") from None
    if len(content) > MAX_BYTES:
        raise GeometryError(f"is larger than {MAX_BYTES:,} bytes")
    if path.suffix.lower() not in _OF_ONE:
        return _only_one(path, content, kind, warn)
    value = parsed_json(decoded(content))
    if not isinstance(value, Mapping):
        raise GeometryError("a JSON object is expected")
    if not is_wgs84(value.get("crs")):
        return _only_one(path, content, kind, warn)
    said: list[str] = []
    geometry = parse_geojson(value, said.append)
    if warn is not None:
        for each in said:
            warn(FileProblem(Severity.WARNING, "", each, kind=kind))
    return geometry


def _only_one(
    path: Path, content: bytes, kind: str, warn: Callable[[FileProblem], object] | None
) -> Point | Route | Area:
    file = read_geometry_file(path.name, content, kind)
    problems = [each for each in file.problems if each.kind in ("", kind)]
    if errors := [str(each) for each in problems if each.severity is Severity.ERROR]:
        more = f" (and {len(errors) - _SHOWN} more)" if len(errors) > _SHOWN else ""
        raise GeometryError(" / ".join(errors[:_SHOWN]) + more)
    found = [each for each in file.geometries if kind_of(each.geometry) == kind]
    if len(found) > 1:  # a plan's fence is inside of its inclusion polygon
        found = [each for each in found if not each.name.startswith(KEEP_OUT)] or found
    if len(found) != 1:
        names = ", ".join(each.name for each in found[:5])
        listed = f" ({names})" if names else ""
        raise GeometryError(f"has {len(found)} {kind}s{listed}; exactly one is expected")
    if warn is not None:
        for each in problems:
            warn(each)
    return found[0].geometry
