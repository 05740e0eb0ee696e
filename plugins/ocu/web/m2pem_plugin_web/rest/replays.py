"""/api/runs/{run}/replay and /api/rehearsals/{id}/replay: what is over, opened at any moment."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Literal

import msgspec
from fastapi import APIRouter, Query, Response
from fastapi import Path as InPath
from pydantic import BaseModel

from m2pem.api import MissionControl, SimulationResult
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.jobs import Jobs
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.replay.replay import Replay
from m2pem_plugin_web.replay.replays import Making, Replays
from m2pem_plugin_web.replay.source import ListSource
from m2pem_plugin_web.rest.models import RecordModel, find_run
from m2pem_plugin_web.rest.rehearsals import names_of, result_of
from m2pem_plugin_web.rest.runs import GOING_ON, LARGEST

LATEST_S = 1e12

_encode = msgspec.json.Encoder().encode

Find = Callable[[str], Awaitable[Replay | Making]]


class BarModel(BaseModel):
    """A bar of the time line; `to` null: it had not ended. `count`: how many it stands for."""

    id: str
    kind: str
    row: str
    label: str
    process: str
    element: str
    to: float | None
    end: str
    reason: str
    count: int


class BarsModel(BaseModel):
    """Bars of a time window. `thinned`: some are merged, and a smaller window has more."""

    spans: list[BarModel]
    thinned: bool


class ReplayModel(BaseModel):
    """`state` "making": records up to `done` of `records` are indexed; all else comes when it is
    "ready". `page`: records of a page, of which `times` has the mission time after each full one.
    `rows`, `spans`, `thinned`: of the time line. `notable`: the last answers and faults."""

    state: Literal["making", "ready"]
    records: int
    done: int | None = None
    end: float | None = None
    page: int | None = None
    times: list[float] | None = None
    rows: list[str] | None = None
    spans: list[BarModel] | None = None
    thinned: bool | None = None
    notable: list[RecordModel] | None = None


class ReplayPage(BaseModel):
    """`view`: of the run before the first of these records, whose `changes` lead on from it."""

    view: dict[str, Any]
    records: list[RecordModel]


def router(
    control: MissionControl, replays: Replays, rehearsals: Jobs[SimulationResult]
) -> APIRouter:
    """The routes of replays."""
    routes = APIRouter(prefix="/api", responses=RESPONSES)

    async def of_run(run: str) -> Replay | Making:
        summary = await find_run(control, run)
        if summary.status in GOING_ON:
            raise ProblemError(409, f"{run} goes on: it can be replayed when it has ended")
        return await replays.of_run(summary)

    async def of_rehearsal(identifier: str) -> Replay | Making:
        result = result_of(rehearsals.get(identifier))
        key = f"rehearsal {identifier}"
        known = replays.opened(key)
        if known is not None:
            return known
        names = names_of(control, result.files)
        return await replays.of_records(key, ListSource(result.summary, result.records, names))

    async def ready(find: Find, name: str) -> Replay:
        replay = await find(name)
        if isinstance(replay, Making):
            raise ProblemError(409, f"the replay of {name} is not ready yet: look at its state")
        return replay

    def add(path: str, tag: str, find: Find, known: Callable[[str], Replay | None]) -> None:
        @routes.get(path, tags=[tag], response_model=ReplayModel)
        async def head(_: Viewer, name: Annotated[str, InPath()]) -> Response:
            """What a replay begins with, or how far its index is."""
            found = await find(name)
            content: dict[str, Any] = (
                {"state": "making", "records": found.records, "done": found.done}
                if isinstance(found, Making)
                else {"state": "ready", **found.head()}
            )
            return Response(_encode(content), media_type="application/json")

        @routes.get(f"{path}/pages/{{number}}", tags=[tag], response_model=ReplayPage)
        async def page(
            _: Viewer,
            name: Annotated[str, InPath()],
            number: Annotated[int, InPath(ge=0, le=LARGEST)],
        ) -> Response:
            """A page of records, from 0 on, and the view of the run before it."""
            replay = known(name) or await ready(find, name)
            if number and number * replay.index.page >= replay.index.seq:
                raise ProblemError(404, f"the replay of {name} has no page {number}")
            return Response(await replay.page(number), media_type="application/json")

        @routes.get(f"{path}/spans", tags=[tag], response_model=BarsModel)
        async def spans(
            _: Viewer,
            name: Annotated[str, InPath()],
            from_s: Annotated[float, Query(ge=0, le=LATEST_S, allow_inf_nan=False)] = 0,
            to_s: Annotated[float, Query(ge=0, le=LATEST_S, allow_inf_nan=False)] = LATEST_S,
        ) -> Response:
            """The bars of a time window, in seconds of mission time."""
            replay = known(name) or await ready(find, name)
            return Response(await replay.bars(from_s, to_s), media_type="application/json")

    add("/runs/{name}/replay", "runs", of_run, replays.opened)
    add(
        "/rehearsals/{name}/replay",
        "rehearsals",
        of_rehearsal,
        lambda name: replays.opened(f"rehearsal {name}"),
    )
    return routes
