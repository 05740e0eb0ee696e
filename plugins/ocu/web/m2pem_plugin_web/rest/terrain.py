"""/api/terrain: the ground along a route, from elevation files of this machine."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import (
    TERRAIN_FOLDER,
    MissionControl,
    ProfilePoint,
    Route,
    Terrain,
    TerrainError,
    lowest,
    profile,
)
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.given_geometries import GivenGeometry, given_geometry
from m2pem_plugin_web.rest.models import Body


class ProfileModel(Body):
    """A route, by its name or as GeoJSON. `home_m`: what relative altitudes count from, in metres
    above mean sea level; null: the ground at the first waypoint."""

    route: GivenGeometry
    step_m: Annotated[float, Field(ge=1.0, le=10_000.0, strict=False)] = 30.0
    home_m: Annotated[float, Field(ge=-1_000.0, le=10_000.0, strict=False)] | None = None


class ProfilePointModel(BaseModel):
    """A place along a route; heights are null where they are not known."""

    along_m: float
    latitude_deg: float
    longitude_deg: float
    ground_m: float | None
    altitude_m: float | None
    above_ground_m: float | None
    waypoint: int | None


class RouteProfileModel(BaseModel):
    """The places along a route; `lowest`: the index of that nearest to the ground."""

    points: list[ProfilePointModel]
    lowest: int | None


def router(control: MissionControl, folder: Path | None) -> APIRouter:
    """The route of profiles. `folder`: of elevation files, None: there is none."""
    routes = APIRouter(prefix="/api/terrain", tags=["geometries"], responses=RESPONSES)
    threads = BoundedThreads()
    found: list[Terrain] = []

    def profiled(route: Route, wanted: ProfileModel) -> list[ProfilePoint]:
        if not found:
            found.append(Terrain(folder or Path()))
        return profile(route, found[0], wanted.step_m, wanted.home_m)

    @routes.post("/profile")
    async def along(_: Viewer, wanted: ProfileModel) -> RouteProfileModel:
        """The ground, and the height above it, along a route."""
        if folder is None:
            raise ProblemError(
                404, f"no elevation files: name their folder as {TERRAIN_FOLDER} at the start"
            )
        route = given_geometry(control, wanted.route, Route, "route")
        try:
            points = await threads.run(profiled, route, wanted)
        except TerrainError as error:
            raise ProblemError(503, str(error)) from None
        low = lowest(points)
        return RouteProfileModel(
            points=[
                ProfilePointModel(
                    along_m=each.along_m,
                    latitude_deg=each.place[0],
                    longitude_deg=each.place[1],
                    ground_m=each.ground_m,
                    altitude_m=each.altitude_m,
                    above_ground_m=each.above_ground_m,
                    waypoint=each.waypoint,
                )
                for each in points
            ],
            lowest=None if low is None else points.index(low),
        )

    return routes
