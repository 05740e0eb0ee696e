"""/api/geometries: routes, areas and points, of the fleet's file and from operators."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter
from fastapi import Path as InPath
from pydantic import BaseModel, ConfigDict, Field

from m2pem.api import Area, MissionControl, Point, Route, as_geojson, parse_geojson
from m2pem.errors import M2pemError
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.missions.names import LONGEST, PATTERN
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import Body, Name, find_run

Kind = Literal["route", "area", "point"]
GeometryName = Annotated[str, InPath(min_length=1, max_length=LONGEST, pattern=PATTERN)]


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


def router(control: MissionControl) -> APIRouter:
    """The routes of geometries."""
    routes = APIRouter(prefix="/api/geometries", tags=["geometries"], responses=RESPONSES)

    @routes.get("")
    async def geometries(_: Viewer) -> list[GeometryModel]:
        """All that missions may name, by name. An operator's is instead of the fleet's."""
        found = {
            name: _model(name, geometry)
            for name, geometry in control.fleet().geometries.items()
            if isinstance(geometry, Route | Area | Point)
        }
        for name, given in control.geometries().items():
            geometry = parse_geojson(given.geometry)
            found[name] = _model(name, geometry, given.by, given.at_us)
        return [found[name] for name in sorted(found)]

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


def _model(
    name: str, geometry: Route | Area | Point, by: str = "", at_us: int | None = None
) -> GeometryModel:
    kind: Kind = "area"
    if isinstance(geometry, Route):
        kind = "route"
    elif isinstance(geometry, Point):
        kind = "point"
    return GeometryModel(
        name=name,
        kind=kind,
        geometry=as_geojson(geometry)["geometry"],
        altitude_frame=geometry.altitude_frame,
        source="fleet" if at_us is None else "operator",
        by=by,
        at_us=at_us,
    )
