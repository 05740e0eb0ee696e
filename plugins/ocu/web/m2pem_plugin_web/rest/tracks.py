"""/api/runs/{run}/telemetry: where the vehicles of a run were, as far as it was kept here."""

import asyncio
from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import find_run
from m2pem_plugin_web.rest.rehearsals import SampleModel
from m2pem_plugin_web.tracks.recorder import Recorder
from m2pem_plugin_web.tracks.track import page_of

LATEST_S = 1e12
MOST_SAMPLES = 5000

_encode = msgspec.json.Encoder().encode


class DetectionModel(BaseModel):
    """A detection. `t_s`: mission time; `time_us`: since the Unix epoch, as the device says."""

    number: int
    t_s: float
    type: str
    source: str
    position: dict[str, float | None]
    time_us: int


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
    """The route of tracks."""
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

    return routes
