"""Routes and areas of a request: by the name under which missions know them, or as GeoJSON."""

from typing import Any, TypeVar

from m2pem.api import Area, GeometryError, MissionControl, Route, parse_geojson
from m2pem_plugin_web.problems import ProblemError
from m2pem_plugin_web.rest.models import Name

GivenGeometry = Name | dict[str, Any]

G = TypeVar("G", Route, Area)
_WORDS: dict[type, tuple[str, str]] = {Route: ("a", "route"), Area: ("an", "area")}


def given_geometry(
    control: MissionControl, given: str | dict[str, Any], kind: type[G], where: str
) -> G:
    """Return a geometry of a kind. `where`: the field of the request, for errors.

    Raises:
        ProblemError: 404, none has that name; 422, it is no GeoJSON, or of another kind.
    """
    article, word = _WORDS[kind]
    found: object
    if isinstance(given, str):
        handed_over = control.geometries().get(given)
        found = control.fleet().geometries.get(given)
        if handed_over is not None:
            found = parse_geojson(handed_over.geometry)
        if found is None:
            raise ProblemError(404, f"{where}: there is no {word} {given!r}")
    else:
        try:
            found = parse_geojson(given)
        except GeometryError as error:
            raise ProblemError(422, f"{where}: {error}") from None
    if not isinstance(found, kind):
        raise ProblemError(422, f"{where}: {article} {word} is expected")
    return found
