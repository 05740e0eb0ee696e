"""/api/geometry-files/read and export: files of routes, areas and points."""

from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field

from m2pem.api import (
    FileFormat,
    GeometryError,
    MissionControl,
    NamedGeometry,
    Severity,
    as_geojson,
    parse_geojson,
    read_geometry_file,
    write_geometry_file,
)
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.missions.names import LONGEST, PATTERN
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.geometries import Kind, geometries_of_fleet, geometry_kind
from m2pem_plugin_web.rest.models import Answer, Body

GeometryText = Annotated[str, Field(min_length=1, max_length=LONGEST, pattern=PATTERN)]
Altitude = Annotated[float | None, Field(ge=-1_000.0, le=100_000.0)]

FILES_AT_ONCE = 2
"""Files that are read or written at the same time, in threads."""

MAX_FILE_NAME = 255
FILE_BODY = {
    "required": False,
    "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
}
"""An empty file has no body, and is read: the answer says what is wrong with it."""

MEDIA_TYPES = {
    FileFormat.GEOJSON: "application/geo+json",
    FileFormat.KML: "application/vnd.google-earth.kml+xml",
    FileFormat.CSV: "text/csv",
    FileFormat.PLAN: "application/json",
    FileFormat.WAYPOINTS: "text/plain",
}
FILE_RESPONSE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file.",
        "content": {
            kind: {"schema": {"type": "string", "format": "binary"}}
            for kind in sorted(set(MEDIA_TYPES.values()))
        },
    }
}


class ReadGeometryModel(BaseModel):
    """A geometry of a file, as a GeoJSON Feature with `name` and `altitude_frame`."""

    name: str
    kind: Kind
    geojson: dict[str, Any]


class FileProblemModel(Answer):
    """What is wrong with a file. `error`: the feature was left out; `warning`: it was read.

    `feature`: how people find it in the file; "" means the whole file.
    """

    severity: Severity
    file: str
    feature: str
    message: str
    remedy: str


class GeometryFileModel(BaseModel):
    """What was read of a file; nothing of it is saved."""

    geometries: list[ReadGeometryModel]
    problems: list[FileProblemModel]


class DrawnModel(Body):
    """A drawing that is exported: a GeoJSON geometry or Feature."""

    name: GeometryText
    geojson: dict[str, Any]


class ExportModel(Body):
    """Drawings as a file. `altitude_m`: of waypoints without one, where a format needs one."""

    format: Annotated[FileFormat, Field(strict=False)]
    geometries: Annotated[list[DrawnModel], Field(min_length=1, max_length=1000)]
    altitude_m: Altitude = None


def router(control: MissionControl) -> APIRouter:
    """The routes of files."""
    routes = APIRouter(prefix="/api/geometry-files", tags=["geometries"], responses=RESPONSES)
    threads = BoundedThreads(FILES_AT_ONCE)

    @routes.post("/read", openapi_extra={"requestBody": FILE_BODY})
    async def read(
        _: Viewer,
        request: Request,
        name: Annotated[str, Query(min_length=1, max_length=MAX_FILE_NAME)],
    ) -> GeometryFileModel:
        """The routes, areas and points of a file, whose bytes are the body; nothing is saved."""
        content = await request.body()
        found = await threads.run(read_geometry_file, name, content)
        return GeometryFileModel(
            geometries=[_read_model(each) for each in found.geometries],
            problems=[FileProblemModel.of(each, file=name) for each in found.problems],
        )

    @routes.get("/export", response_class=Response, responses=FILE_RESPONSE)
    async def export(
        _: Viewer,
        file_format: Annotated[FileFormat, Query(alias="format")],
        names: Annotated[list[str] | None, Query(max_length=1000)] = None,
        altitude_m: Annotated[Altitude, Query()] = None,
    ) -> Response:
        """Geometries that missions may name as a file; all, unless `names` are given."""
        known = {each.name: each for each in geometries_of_fleet(control)}
        for name, given in control.geometries().items():
            known[name] = NamedGeometry(name, parse_geojson(given.geometry))
        for name in names or ():
            if name not in known:
                raise ProblemError(404, f"there is no route, area or point {name!r}")
        chosen = [known[name] for name in dict.fromkeys(names or sorted(known))]
        return await _as_file(threads, file_format, chosen, altitude_m)

    @routes.post("/export", response_class=Response, responses=FILE_RESPONSE)
    async def export_drawn(_: Viewer, wanted: ExportModel) -> Response:
        """Drawings, which need not be saved, as a file."""
        drawn = []
        for each in wanted.geometries:
            try:
                drawn.append(NamedGeometry(each.name, parse_geojson(each.geojson)))
            except GeometryError as error:
                raise ProblemError(422, f"{each.name}: {error}") from None
        return await _as_file(threads, wanted.format, drawn, wanted.altitude_m)

    return routes


def _read_model(read: NamedGeometry) -> ReadGeometryModel:
    feature = as_geojson(read.geometry)
    feature["properties"] = {"name": read.name, **feature["properties"]}
    return ReadGeometryModel(name=read.name, kind=geometry_kind(read.geometry), geojson=feature)


async def _as_file(
    threads: BoundedThreads,
    file_format: FileFormat,
    geometries: Sequence[NamedGeometry],
    altitude_m: float | None,
) -> Response:
    try:
        content = await threads.run(write_geometry_file, file_format, geometries, altitude_m)
    except GeometryError as error:
        raise ProblemError(422, f".{file_format}: {error}") from None
    said = {"content-disposition": f'attachment; filename="geometries.{file_format}"'}
    return Response(content, media_type=MEDIA_TYPES[file_format], headers=said)
