"""/api/geometries: routes, areas and points, of the fleet's file and from operators."""

import asyncio
from collections.abc import Sequence
from typing import Annotated, Any, Literal, cast

from fastapi import APIRouter, Query, Request
from fastapi import Path as InPath
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field

from m2pem.api import (
    Area,
    FileFormat,
    GeometryError,
    MissionControl,
    NamedGeometry,
    Point,
    Route,
    Severity,
    as_geojson,
    kind_of,
    parse_geojson,
    read_geometry_file,
    write_geometry_file,
)
from m2pem.errors import M2pemError
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.missions.names import LONGEST, PATTERN
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import Body, Name, find_run

Kind = Literal["route", "area", "point"]
GeometryName = Annotated[str, InPath(min_length=1, max_length=LONGEST, pattern=PATTERN)]
GeometryText = Annotated[str, Field(min_length=1, max_length=LONGEST, pattern=PATTERN)]
Altitude = Annotated[float | None, Field(ge=-1_000.0, le=100_000.0)]

FILES_AT_ONCE = 2
"""Files that are read or written at the same time, in threads."""

MAX_FILE_NAME = 255
FILE_BODY = {
    "required": True,
    "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
}
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


class GeometryModel(BaseModel):
    """A route, area or point (GeoJSON). `altitude_frame`: what its altitudes are above."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    kind: Kind
    geometry: dict[str, Any]
    altitude_frame: str
    source: Literal["fleet", "operator"] = Field(
        validation_alias="from", serialization_alias="from"
    )
    by: str
    at_us: int | None


class HandOverModel(Body):
    """A GeoJSON geometry or Feature; `run`: for that run alone, null: for all, now and later."""

    geometry: dict[str, Any]
    run: Name | None = None


class ReadGeometryModel(BaseModel):
    """A geometry of a file, as a GeoJSON Feature with `name` and `altitude_frame`."""

    name: str
    kind: Kind
    geojson: dict[str, Any]


class FileProblemModel(BaseModel):
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
    """The routes of geometries."""
    routes = APIRouter(prefix="/api/geometries", tags=["geometries"], responses=RESPONSES)
    turn = asyncio.Semaphore(FILES_AT_ONCE)

    @routes.get("")
    async def geometries(_: Viewer) -> list[GeometryModel]:
        """All that missions may name, by name. An operator's is instead of the fleet's."""
        found = {each.name: _model(each.name, each.geometry) for each in _of_fleet(control)}
        for name, given in control.geometries().items():
            geometry = parse_geojson(given.geometry)
            found[name] = _model(name, geometry, given.by, given.at_us)
        return [found[name] for name in sorted(found)]

    @routes.post("/read", openapi_extra={"requestBody": FILE_BODY})
    async def read(
        _: Viewer,
        request: Request,
        name: Annotated[str, Query(min_length=1, max_length=MAX_FILE_NAME)],
    ) -> GeometryFileModel:
        """The routes, areas and points of a file, whose bytes are the body; nothing is saved."""
        content = await request.body()
        async with turn:
            found = await asyncio.to_thread(read_geometry_file, name, content)
        return GeometryFileModel(
            geometries=[_read_model(each) for each in found.geometries],
            problems=[
                FileProblemModel(
                    severity=each.severity,
                    file=name,
                    feature=each.feature,
                    message=each.message,
                    remedy=each.remedy,
                )
                for each in found.problems
            ],
        )

    @routes.get("/export", response_class=Response, responses=FILE_RESPONSE)
    async def export(
        _: Viewer,
        file_format: Annotated[FileFormat, Query(alias="format")],
        names: Annotated[list[str] | None, Query(max_length=1000)] = None,
        altitude_m: Annotated[Altitude, Query()] = None,
    ) -> Response:
        """Geometries that missions may name as a file; all, unless `names` are given."""
        known = {each.name: each for each in _of_fleet(control)}
        for name, given in control.geometries().items():
            known[name] = NamedGeometry(name, parse_geojson(given.geometry))
        for name in names or ():
            if name not in known:
                raise ProblemError(404, f"there is no route, area or point {name!r}")
        chosen = [known[name] for name in dict.fromkeys(names or sorted(known))]
        async with turn:
            return await _as_file(file_format, chosen, altitude_m)

    @routes.post("/export", response_class=Response, responses=FILE_RESPONSE)
    async def export_drawn(_: Viewer, wanted: ExportModel) -> Response:
        """Drawings, which need not be saved, as a file."""
        drawn = []
        for each in wanted.geometries:
            try:
                drawn.append(NamedGeometry(each.name, parse_geojson(each.geojson)))
            except GeometryError as error:
                raise ProblemError(422, f"{each.name}: {error}") from None
        async with turn:
            return await _as_file(wanted.format, drawn, wanted.altitude_m)

    @routes.put("/{name}", status_code=204)
    async def hand_over(person: Operator, name: GeometryName, wanted: HandOverModel) -> None:
        """Hand over a geometry: missions that name it have it at once."""
        try:
            parse_geojson(wanted.geometry)
        except M2pemError as error:
            raise ProblemError(422, f"geometry {error}") from None
        if wanted.run is not None:
            await find_run(control, wanted.run)
        await control.set_geometry(name, wanted.geometry, run=wanted.run, by=person.name)

    return routes


def _of_fleet(control: MissionControl) -> list[NamedGeometry]:
    return [
        NamedGeometry(name, geometry)
        for name, geometry in control.fleet().geometries.items()
        if isinstance(geometry, Route | Area | Point)
    ]


def _read_model(read: NamedGeometry) -> ReadGeometryModel:
    feature = as_geojson(read.geometry)
    feature["properties"] = {"name": read.name, **feature["properties"]}
    return ReadGeometryModel(name=read.name, kind=_kind(read.geometry), geojson=feature)


async def _as_file(
    file_format: FileFormat, geometries: Sequence[NamedGeometry], altitude_m: float | None
) -> Response:
    try:
        content = await asyncio.to_thread(write_geometry_file, file_format, geometries, altitude_m)
    except GeometryError as error:
        raise ProblemError(422, f".{file_format}: {error}") from None
    said = {"content-disposition": f'attachment; filename="geometries.{file_format}"'}
    return Response(content, media_type=MEDIA_TYPES[file_format], headers=said)


def _kind(geometry: Route | Area | Point) -> Kind:
    return cast("Kind", kind_of(geometry))


def _model(
    name: str, geometry: Route | Area | Point, by: str = "", at_us: int | None = None
) -> GeometryModel:
    return GeometryModel(
        name=name,
        kind=_kind(geometry),
        geometry=as_geojson(geometry)["geometry"],
        altitude_frame=geometry.altitude_frame,
        source="fleet" if at_us is None else "operator",
        by=by,
        at_us=at_us,
    )
