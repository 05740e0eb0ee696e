"""/api/geometries: routes, areas and points, of the fleet's file and from operators."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, cast

from fastapi import APIRouter
from fastapi import Path as InPath
from pydantic import Field

from m2pem.api import (
    Area,
    GeometryVersion,
    MissionControl,
    NamedGeometry,
    Point,
    Route,
    as_geojson,
    kind_of,
    parse_geojson,
)
from m2pem.errors import M2pemError
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.missions.names import LONGEST, PATTERN
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import Answer, Body, Name, find_run

Kind = Literal["route", "area", "point"]
GeometryName = Annotated[str, InPath(min_length=1, max_length=LONGEST, pattern=PATTERN)]


class GeometryModel(Answer):
    """A route, area or point (GeoJSON). `altitude_frame`: what its altitudes are above.

    `speeds_m_s`: of a route, how fast vehicles leave each waypoint, null: as fast as before; []:
    no waypoint has a speed. `altitude_frames`: of a route whose waypoints have different ones, that
    of each; []: `altitude_frame` holds for all.
    """

    name: str
    kind: Kind
    geometry: dict[str, Any]
    altitude_frame: str
    source: Literal["fleet", "operator"] = Field(serialization_alias="from")
    by: str
    at_us: int | None
    speeds_m_s: list[float | None] = Field(default=[])
    altitude_frames: list[str] = Field(default=[])


class HandOverModel(Body):
    """A GeoJSON geometry or Feature; `run`: for that run alone, null: for all, now and later.

    `force`: also if it replaces one that runs under way use.
    """

    geometry: dict[str, Any]
    run: Name | None = None
    force: bool = False


class RestoreModel(Body):
    """`force`: also if it replaces one that runs under way use."""

    force: bool = False


class VersionModel(Answer):
    """A version of a drawing; `kind` and `geometry` null: it was deleted then."""

    number: int
    kind: Kind | None
    geometry: dict[str, Any] | None
    altitude_frame: str
    by: str
    at_us: int


def router(control: MissionControl) -> APIRouter:
    """The routes of geometries."""
    routes = APIRouter(prefix="/api/geometries", tags=["geometries"], responses=RESPONSES)

    @routes.get("")
    async def geometries(_: Viewer) -> list[GeometryModel]:
        """All that missions may name, by name. An operator's is instead of the fleet's."""
        found = {
            each.name: _model(each.name, each.geometry) for each in geometries_of_fleet(control)
        }
        for name, given in control.geometries().items():
            geometry = parse_geojson(given.geometry)
            found[name] = _model(name, geometry, given.by, given.at_us)
        return [found[name] for name in sorted(found)]

    @routes.put("/{name}", status_code=204)
    async def hand_over(person: Operator, name: GeometryName, wanted: HandOverModel) -> None:
        """Hand over a geometry: missions that name it have it at once.

        409 and `runs`: it would replace one that these runs use; `force` does it all the same.
        """
        try:
            parse_geojson(wanted.geometry)
        except M2pemError as error:
            raise ProblemError(422, f"geometry {error}") from None
        if wanted.run is not None:
            await find_run(control, wanted.run)
        elif not wanted.force:
            await _refuse_used(control, name, wanted.geometry)
        await control.set_geometry(name, wanted.geometry, run=wanted.run, by=person.name)

    @routes.delete("/{name}", status_code=204)
    async def delete(person: Operator, name: GeometryName) -> None:
        """Delete a drawing of operators. Runs under way keep it, and its versions are kept."""
        if name not in control.geometries():
            raise ProblemError(404, f"no operator has handed over a geometry {name!r}")
        await control.delete_geometry(name, by=person.name)

    @routes.get("/{name}/versions")
    async def versions(_: Viewer, name: GeometryName) -> list[VersionModel]:
        """The versions of a drawing that were handed over for all runs, the newest last."""
        return [_version_model(each) for each in await control.geometry_versions(name)]

    @routes.post("/{name}/versions/{number}/restore", status_code=204)
    async def restore(
        person: Operator, name: GeometryName, number: int, wanted: RestoreModel
    ) -> None:
        """Hand a former version over again; 409 and `runs` as for another one of that name."""
        found = {each.number: each for each in await control.geometry_versions(name)}
        version = found.get(number)
        if version is None or version.geometry is None:
            raise ProblemError(404, f"{name} has no version {number} with a geometry")
        if not wanted.force:
            await _refuse_used(control, name, version.geometry)
        await control.set_geometry(name, version.geometry, by=person.name)

    return routes


async def _refuse_used(control: MissionControl, name: str, geometry: Mapping[str, Any]) -> None:
    """Refuse to replace a geometry by another one while runs use it.

    Raises:
        ProblemError: 409, with the `runs`.
    """
    handed_over = control.geometries().get(name)
    present: object = control.fleet().geometries.get(name)
    if handed_over is not None:
        present = parse_geojson(handed_over.geometry)
    if present is None or present == parse_geojson(geometry):
        return
    runs = list(await control.geometry_users(name))
    if runs:
        raise ProblemError(
            409,
            f"{name} is named by the mission of {', '.join(runs)}: tasks there that have not begun "
            "get the new one; send force to replace it, or hand it over for one run",
            runs=runs,
        )


def _version_model(version: GeometryVersion) -> VersionModel:
    geometry = None if version.geometry is None else parse_geojson(version.geometry)
    return VersionModel.of(
        version,
        kind=None if geometry is None else geometry_kind(geometry),
        geometry=None if geometry is None else as_geojson(geometry)["geometry"],
        altitude_frame="relative" if geometry is None else geometry.altitude_frame,
    )


def _model(
    name: str, geometry: Route | Area | Point, by: str = "", at_us: int | None = None
) -> GeometryModel:
    return GeometryModel(
        name=name,
        kind=geometry_kind(geometry),
        geometry=as_geojson(geometry)["geometry"],
        altitude_frame=geometry.altitude_frame,
        source="fleet" if at_us is None else "operator",
        by=by,
        at_us=at_us,
        speeds_m_s=list(geometry.speeds_m_s) if isinstance(geometry, Route) else [],
        altitude_frames=list(geometry.altitude_frames) if isinstance(geometry, Route) else [],
    )


def geometries_of_fleet(control: MissionControl) -> list[NamedGeometry]:
    """Return the routes, areas and points of the fleet file."""
    return [
        NamedGeometry(name, geometry)
        for name, geometry in control.fleet().geometries.items()
        if isinstance(geometry, Route | Area | Point)
    ]


def geometry_kind(geometry: Route | Area | Point) -> Kind:
    """Return what people call a geometry."""
    return cast("Kind", kind_of(geometry))
