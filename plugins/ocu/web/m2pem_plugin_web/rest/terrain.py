"""/api/terrain: the ground along a route, from elevation files of this machine."""

from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import (
    TERRAIN_FOLDER,
    TOLERANCE_M,
    GeometryError,
    MissionControl,
    ProfilePoint,
    Route,
    Terrain,
    TerrainError,
    as_geojson,
    follow_terrain,
    lowest,
    not_covered,
    profile,
)
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.given_geometries import GivenGeometry, given_geometry
from m2pem_plugin_web.rest.models import Answer, Body


class ProfileModel(Body):
    """A route, by its name or as GeoJSON. `step_m`: more than 100 is 100. `home_m`: what relative
    altitudes count from, in metres above mean sea level; null: the ground at the first waypoint."""

    route: GivenGeometry
    step_m: Annotated[float, Field(ge=1.0, le=10_000.0, strict=False)] = 30.0
    home_m: Annotated[float, Field(ge=-1_000.0, le=10_000.0, strict=False)] | None = None


class ProfilePointModel(Answer):
    """A place along a route; heights are null where they are not known."""

    along_m: float
    latitude_deg: float
    longitude_deg: float
    ground_m: float | None
    altitude_m: float | None
    above_ground_m: float | None
    waypoint: int | None


class RouteProfileModel(BaseModel):
    """The places along a route; `lowest`: the index of that nearest to the ground.

    `clearance_m`: of aircraft, as the fleet file says; null: it says none. `missing`: what to do
    where no elevation file has a place of the route; "": all have one.
    """

    points: list[ProfilePointModel]
    lowest: int | None
    clearance_m: float | None
    missing: str


class FollowingModel(Body):
    """A route that shall follow the ground. `height_m`: above it; null: the altitude of each
    waypoint is its height. `tolerance_m`: how far from that it may be between two waypoints."""

    route: GivenGeometry
    height_m: Annotated[float, Field(ge=0.0, le=10_000.0, strict=False)] | None = None
    tolerance_m: Annotated[float, Field(ge=0.5, le=100.0, strict=False)] = TOLERANCE_M
    step_m: Annotated[float, Field(ge=1.0, le=10_000.0, strict=False)] = 30.0


class FollowedModel(BaseModel):
    """The route as a GeoJSON Feature, with altitudes above mean sea level."""

    geojson: dict[str, Any]


def router(control: MissionControl, folder: Path | None) -> APIRouter:
    """The routes of terrain. `folder`: of elevation files, None: the fleet file may name one."""
    routes = APIRouter(prefix="/api/terrain", tags=["geometries"], responses=RESPONSES)
    threads = BoundedThreads()
    found: list[Terrain] = []

    if folder is None and control.fleet().terrain_folder:
        folder = Path(control.fleet().terrain_folder)

    def opened() -> Terrain:
        if not found:
            found.append(Terrain(folder or Path()))
        return found[0]

    def profiled(route: Route, wanted: ProfileModel) -> list[ProfilePoint]:
        return profile(route, opened(), wanted.step_m, wanted.home_m)

    def followed(route: Route, wanted: FollowingModel) -> Route:
        return follow_terrain(route, opened(), wanted.height_m, wanted.step_m, wanted.tolerance_m)

    def check_folder() -> None:
        if folder is None:
            raise ProblemError(
                404,
                f"no elevation files: name their folder as {TERRAIN_FOLDER} at the start, or as "
                "'terrain: {folder: ...}' in the fleet file",
            )

    @routes.post("/profile")
    async def along(_: Viewer, wanted: ProfileModel) -> RouteProfileModel:
        """The ground, and the height above it, along a route."""
        check_folder()
        route = given_geometry(control, wanted.route, Route, "route")
        try:
            points = await threads.run(profiled, route, wanted)
        except TerrainError as error:
            raise ProblemError(503, str(error)) from None
        low = lowest(points)
        return RouteProfileModel(
            points=[
                ProfilePointModel.of(each, latitude_deg=each.place[0], longitude_deg=each.place[1])
                for each in points
            ],
            lowest=None if low is None else points.index(low),
            clearance_m=control.fleet().clearance_m,
            missing=next((not_covered(each.place) for each in points if each.ground_m is None), ""),
        )

    @routes.post("/follow")
    async def follow(_: Viewer, wanted: FollowingModel) -> FollowedModel:
        """The route at even heights above the ground, with waypoints where the ground needs it."""
        check_folder()
        route = given_geometry(control, wanted.route, Route, "route")
        try:
            made = await threads.run(followed, route, wanted)
        except GeometryError as error:
            raise ProblemError(422, str(error)) from None
        except TerrainError as error:
            raise ProblemError(503, str(error)) from None
        return FollowedModel(geojson=as_geojson(made))

    return routes
