"""/api/survey-patterns: routes that cover an area, for one vehicle or several."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field, model_validator

from m2pem.api import (
    KNOWN_CAMERAS,
    Area,
    GeometryError,
    ImagePlan,
    MissionControl,
    SurveyCamera,
    Surveyor,
    SurveyPattern,
    SurveyRoute,
    as_geojson,
    best_heading_rad,
    image_plan,
    lasts_s,
    survey_routes,
)
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.given_geometries import GivenGeometry, given_geometry
from m2pem_plugin_web.rest.models import Answer, Body, Name

Length = Annotated[float, Field(gt=0.0, le=100_000.0, strict=False)]
Millimetres = Annotated[float, Field(gt=0.0, le=1_000.0, strict=False)]
Pixels = Annotated[int, Field(gt=0, le=1_000_000)]
Overlap = Annotated[float, Field(ge=0.0, lt=1.0, strict=False)]


class KnownCameraModel(Answer):
    """A camera of a maker: the sensor, the lens and the images."""

    name: str
    sensor_width_mm: float
    sensor_height_mm: float
    focal_length_mm: float
    image_width_px: int
    image_height_px: int


class CameraModel(Body):
    """A camera that looks down; the width of its images lies across the track."""

    sensor_width_mm: Millimetres
    sensor_height_mm: Millimetres
    focal_length_mm: Millimetres
    image_width_px: Pixels
    image_height_px: Pixels
    front_overlap: Overlap = 0.75
    side_overlap: Overlap = 0.65


class PatternModel(Body):
    """A survey: with a `spacing_m`, or with a `camera` and a height above ground (`altitude_m`).

    `heading_deg`: of the passes, from true north; null: that with the fewest turns. `margin_m`: how
    far beyond the area is surveyed; below 0, within it. `corner`: where it begins. `vehicles`: who
    share it by their speeds; `speed_m_s`: of all of them, in place of their cruise speeds. One
    whose speed is not known gets the share of the slowest.
    """

    area: GivenGeometry
    spacing_m: Length | None = None
    camera: CameraModel | None = None
    altitude_m: Annotated[float, Field(ge=-1_000.0, le=100_000.0, strict=False)] | None = None
    altitude_frame: Literal["relative", "amsl", "terrain"] = "relative"
    heading_deg: Annotated[float, Field(ge=-360.0, le=360.0, strict=False)] | None = None
    margin_m: Annotated[float, Field(ge=-10_000.0, le=10_000.0, strict=False)] = 0.0
    turn_around_m: Annotated[float, Field(ge=0.0, le=10_000.0, strict=False)] = 0.0
    corner: Annotated[int, Field(ge=0, le=3)] = 0
    cross_hatch: bool = False
    keep_out: Annotated[tuple[GivenGeometry, ...], Field(max_length=100, strict=False)] = ()
    clearance_m: Annotated[float, Field(ge=0.0, le=10_000.0, strict=False)] = 0.0
    vehicles: Annotated[tuple[Name, ...], Field(max_length=100, strict=False)] = ()
    speed_m_s: Annotated[float, Field(gt=0.0, le=1_000.0, strict=False)] | None = None

    @model_validator(mode="after")
    def _one_spacing(self) -> "PatternModel":
        if (self.spacing_m is None) == (self.camera is None):
            raise ValueError("send spacing_m, or a camera; not both")
        if self.camera is not None and (self.altitude_m is None or self.altitude_frame == "amsl"):
            raise ValueError("a camera needs altitude_m above home or terrain")
        return self


class SurveyRouteModel(Answer):
    """The route of a vehicle, as a GeoJSON Feature.

    `vehicle` is "" where none was named. `time_s` is without turns, and null without a speed.
    `lasts_s`: how long the vehicle can go with a full battery and a reserve, null: not known.
    `battery_fraction`: of a full battery that the route takes, null: not known.
    """

    vehicle: str
    geojson: dict[str, Any]
    passes: int
    length_m: float
    surveyed_m: float
    time_s: float | None
    lasts_s: float | None
    battery_fraction: float | None
    images: int | None


class SurveyRoutesModel(BaseModel):
    """The routes; `problems`: vehicles whose routes take longer than they last.

    `best_heading_deg`: of the passes with the fewest turns, from 0 to below 180.
    """

    spacing_m: float
    best_heading_deg: float
    trigger_distance_m: float | None
    ground_resolution_m: float | None
    routes: list[SurveyRouteModel]
    problems: list[str]


def router(control: MissionControl) -> APIRouter:
    """The route of survey patterns."""
    routes = APIRouter(prefix="/api", tags=["geometries"], responses=RESPONSES)
    threads = BoundedThreads()

    @routes.get("/survey-cameras")
    async def cameras(_: Viewer) -> list[KnownCameraModel]:
        """Cameras of makers, for the `camera` of a survey pattern."""
        return [KnownCameraModel.of(each, name=name) for name, each in KNOWN_CAMERAS.items()]

    @routes.post("/survey-patterns")
    async def survey(_: Viewer, wanted: PatternModel) -> SurveyRoutesModel:
        """Routes that cover an area, and keep out of its holes and of other areas."""
        images = _images(wanted)
        spacing_m = images.spacing_m if images is not None else wanted.spacing_m or 0.0
        pattern = SurveyPattern(
            area=given_geometry(control, wanted.area, Area, "area"),
            spacing_m=spacing_m,
            heading_rad=None if wanted.heading_deg is None else math.radians(wanted.heading_deg),
            margin_m=wanted.margin_m,
            turn_around_m=wanted.turn_around_m,
            corner=wanted.corner,
            cross_hatch=wanted.cross_hatch,
            keep_out=[
                given_geometry(control, each, Area, f"keep_out[{index}]")
                for index, each in enumerate(wanted.keep_out)
            ],
            clearance_m=wanted.clearance_m,
            altitude_m=wanted.altitude_m,
            altitude_frame=wanted.altitude_frame,
        )
        surveyors = _surveyors(control, wanted)
        try:
            found, best_rad = await threads.run(_survey, pattern, surveyors)
        except GeometryError as error:
            raise ProblemError(422, str(error)) from None
        return SurveyRoutesModel(
            spacing_m=pattern.spacing_m,
            best_heading_deg=math.degrees(best_rad),
            trigger_distance_m=None if images is None else images.trigger_distance_m,
            ground_resolution_m=None if images is None else images.ground_resolution_m,
            routes=[_model(control, each, images, wanted.speed_m_s) for each in found],
            problems=list(_too_long(found)),
        )

    return routes


def _survey(
    pattern: SurveyPattern, surveyors: Sequence[Surveyor]
) -> tuple[list[SurveyRoute], float]:
    return survey_routes(pattern, surveyors), best_heading_rad(pattern)


def _images(wanted: PatternModel) -> ImagePlan | None:
    camera = wanted.camera
    if camera is None or wanted.altitude_m is None:
        return None
    try:
        return image_plan(
            SurveyCamera(
                camera.sensor_width_mm,
                camera.sensor_height_mm,
                camera.focal_length_mm,
                camera.image_width_px,
                camera.image_height_px,
            ),
            wanted.altitude_m,
            camera.front_overlap,
            camera.side_overlap,
        )
    except ValueError as error:
        raise ProblemError(422, str(error)) from None


def _surveyors(control: MissionControl, wanted: PatternModel) -> Sequence[Surveyor]:
    if not wanted.vehicles:
        return (Surveyor("", wanted.speed_m_s or 1.0),)
    vehicles = control.fleet().vehicles
    chosen = []
    for name in dict.fromkeys(wanted.vehicles):
        vehicle = next((each for each in vehicles.values() if each.id == name), None)
        if vehicle is None:
            raise ProblemError(404, f"vehicles: there is no vehicle {name!r}")
        chosen.append(vehicle)
    stated = [each.cruise_speed_m_s for each in chosen if each.cruise_speed_m_s is not None]
    otherwise = min(stated, default=1.0)
    surveyors = []
    for vehicle in chosen:
        speed_m_s = wanted.speed_m_s or vehicle.cruise_speed_m_s
        lasts = None
        if vehicle.endurance_s is not None and speed_m_s is not None:
            lasts = lasts_s(vehicle.endurance_s, None)
        surveyors.append(Surveyor(vehicle.id, speed_m_s or otherwise, lasts))
    return surveyors


def _too_long(found: Sequence[SurveyRoute]) -> Sequence[str]:
    return [
        f"{each.surveyor.name}: {each.length_m:.0f} m take {each.time_s / 60:.0f} min, it lasts "
        f"{each.surveyor.lasts_s / 60:.0f} min: take more vehicles, or a wider spacing"
        for each in found
        if each.surveyor.lasts_s is not None and each.time_s > each.surveyor.lasts_s
    ]


def _model(
    control: MissionControl,
    found: SurveyRoute,
    images: ImagePlan | None,
    speed_m_s: float | None,
) -> SurveyRouteModel:
    vehicles = control.fleet().vehicles.values()
    vehicle = next((each for each in vehicles if each.id == found.surveyor.name), None)
    endurance_s = None if vehicle is None else vehicle.endurance_s
    time_s: float | None = found.time_s
    if speed_m_s is None and (vehicle is None or vehicle.cruise_speed_m_s is None):
        time_s = None
    count = None
    if images is not None:
        count = math.ceil(found.surveyed_m / images.trigger_distance_m) + found.passes
    return SurveyRouteModel.of(
        found,
        vehicle=found.surveyor.name,
        geojson=as_geojson(found.route),
        time_s=time_s,
        lasts_s=found.surveyor.lasts_s,
        battery_fraction=None if endurance_s is None or time_s is None else time_s / endurance_s,
        images=count,
    )
