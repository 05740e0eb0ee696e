"""Where the vehicles of a run were, and what was detected, as far as it was kept here."""

import asyncio
from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response
from fastapi import Path as InPath
from pydantic import BaseModel

from m2pem.api import MissionControl, RunId
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import find_run
from m2pem_plugin_web.rest.rehearsals import SampleModel
from m2pem_plugin_web.tracks.camera_pictures import MEDIA_TYPES
from m2pem_plugin_web.tracks.detections import MOST_DETECTIONS
from m2pem_plugin_web.tracks.recorder import Recorder
from m2pem_plugin_web.tracks.track import page_of

LATEST_S = 1e12
MOST_SAMPLES = 5000

_encode = msgspec.json.Encoder().encode


class DetectionModel(BaseModel):
    """A detection. `t_s`: mission time; `time_us`: since the Unix epoch, as the device says.
    `camera`: the camera that was asked for a picture; "": there is none. `picture`: the number
    with which the picture is had; `picture_after_s`: how many seconds later that had come.
    `no_picture`: why there is none. With neither of the two, it is not known or still asked for."""

    number: int
    t_s: float
    type: str
    source: str
    position: dict[str, float | None]
    time_us: int
    camera: str = ""
    picture: int | None = None
    picture_after_s: float = 0.0
    no_picture: str = ""


class TrackSampleModel(SampleModel):
    """Also what was detected since the sample before. A later entry of the same `number` replaces
    the one before. `more_detections`: how many there are that the track has no entry of."""

    detections: tuple[DetectionModel, ...] = ()
    more_detections: int = 0


class TelemetryPage(BaseModel):
    """`samples`: each with those alone that say something new. `next`: what to ask for `after`
    next; null: there are no more now. `problem`: why there are gaps, null if nothing went wrong."""

    samples: list[TrackSampleModel]
    next: float | None
    problem: str | None


def router(control: MissionControl, recorder: Recorder) -> APIRouter:
    """The routes of tracks, and of pictures of what was detected."""
    routes = APIRouter(prefix="/api/runs", tags=["runs"], responses=RESPONSES)

    @routes.get("/{run}/telemetry", response_model=TelemetryPage)
    async def telemetry(
        _: Viewer,
        run: str,
        after: Annotated[float | None, Query(ge=0, le=LATEST_S, allow_inf_nan=False)] = None,
        limit: Annotated[int, Query(ge=1, le=MOST_SAMPLES)] = 1000,
    ) -> Response:
        """Where vehicles and payloads were after a mission time, the `next` of the page before.

        A page ends with all of a moment, so that it may have more than `limit`.
        """
        summary = await find_run(control, run)
        await recorder.flush(run)
        try:
            page = await asyncio.to_thread(
                page_of, recorder.store, run, summary.started_us, after, limit
            )
        except OSError as error:
            raise ProblemError(503, f"where vehicles were in {run}: {error.strerror}") from error
        content = {
            "samples": page.samples,
            "next": page.after,
            "problem": recorder.problems.get(run),
        }
        return Response(_encode(content), media_type="application/json")

    @routes.get(
        "/{run}/detections/{number}/picture",
        response_class=Response,
        responses={200: {"content": {each: {} for each in MEDIA_TYPES.values()}}},
    )
    async def picture(
        _: Viewer, run: str, number: Annotated[int, InPath(ge=1, le=MOST_DETECTIONS)]
    ) -> Response:
        """The picture of what was detected: `picture` of its entry in the telemetry."""
        await find_run(control, run)
        try:
            found = await asyncio.to_thread(recorder.pictures.get, RunId(run), number)
        except OSError as error:
            raise ProblemError(503, f"pictures of {run}: {error.strerror}") from error
        if found is None:
            raise ProblemError(404, f"{run} has no picture {number}")
        return Response(found.content, media_type=MEDIA_TYPES[found.suffix])

    return routes
