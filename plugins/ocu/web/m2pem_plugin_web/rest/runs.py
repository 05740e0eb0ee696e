"""/api/runs: start them, list them, and read what happened in them."""

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel

from m2pem.api import Draft, MissionControl, MissionFile, RunStatus, RunSummary
from m2pem.errors import M2pemError, MissionError
from m2pem_plugin_web.access.permissions import Commander, Viewer
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.drafts import WrittenName, of_folder
from m2pem_plugin_web.rest.models import Body, Data, Name, RecordPage, RunModel, find_run, run_model
from m2pem_plugin_web.rest.record_pages import NAMED, RecordPages


async def shown(control: MissionControl, source: bytes) -> str:
    """A file in the form that the editor takes; as it is, if it has none."""
    try:
        found = await asyncio.to_thread(control.editable, source)
    except MissionError:
        return source.decode(errors="replace")
    return found.source.decode()


MOST_RUNS = 1000
MOST_RECORDS = 5000
LARGEST = 2**53 - 1
GOING_ON = frozenset((RunStatus.RUNNING, RunStatus.PAUSED))


class StartModel(Body):
    """What to start. `version`: of the mission, None for its newest; `process`: None, its main.

    `even_if_busy`: an operator has confirmed it although others have vehicles that it names.
    """

    mission: WrittenName
    version: str | None = None
    process: Name | None = None
    data: Data | None = None
    even_if_busy: bool = False


class StartedModel(BaseModel):
    """The id of the run that began."""

    run: str


class FileModel(BaseModel):
    """A file of BPMN, as the editor takes it.

    `qualifier`: what ids of its elements begin with in records, before ":".
    """

    name: str
    qualifier: str
    xml: str


class RunMissionModel(BaseModel):
    """What a run executes: its file, and those that it calls into."""

    name: str
    process: str
    files: list[FileModel]


def router(control: MissionControl, folder: MissionFolder, hub: Hub) -> APIRouter:
    """The routes of runs. `folder`: what missions are started from; `hub` follows what goes on."""
    routes = APIRouter(prefix="/api/runs", tags=["runs"], responses=RESPONSES)
    pages = RecordPages(control)

    @routes.post("", status_code=201)
    async def start(person: Commander, wanted: StartModel) -> StartedModel:
        """Start a mission."""
        source = await of_folder(folder.source, wanted.mission, wanted.version)
        draft = Draft(folder.file(wanted.mission), source)
        run = await control.start(
            draft,
            process=wanted.process,
            data=wanted.data,
            by=person.name,
            even_if_busy=wanted.even_if_busy,
        )
        return StartedModel(run=run)

    @routes.get("")
    async def runs(
        _: Viewer, limit: Annotated[int, Query(ge=1, le=MOST_RUNS)] = MOST_RUNS
    ) -> list[RunModel]:
        """The runs of the journal, the newest last; `limit` of them at most."""
        return [await run_now(control, each) for each in list(await control.runs())[-limit:]]

    @routes.get("/{run}")
    async def run(_: Viewer, run: str) -> RunModel:
        """Return the summary of a run."""
        return await run_now(control, await find_run(control, run))

    @routes.get("/{run}/records", response_model=RecordPage)
    async def records(
        _: Viewer,
        run: str,
        after: Annotated[int, Query(ge=0, le=LARGEST)] = 0,
        limit: Annotated[int, Query(ge=1, le=MOST_RECORDS)] = 1000,
        changes: bool = True,
    ) -> Response:
        """Records of a run after one of them: 0, or the `next` of the page before.

        A page ends with all records of an input, so that it may have more than `limit`. `changes`:
        false if what each changes in the view is not needed; the newest records of a run that goes
        on are then read without all those before.
        """
        live = hub.runs.get(run) if not changes else None
        if live is not None and after >= live.view.seq - NAMED:
            content = await pages.read_newest(live.view, after, limit)
        else:
            content = await pages.read(await find_run(control, run), after, limit)
        return Response(content, media_type="application/json")

    @routes.get("/{run}/mission")
    async def mission(_: Viewer, run: str, version: Name | None = None) -> RunMissionModel:
        """What a run executes now; a run that is over, what it had in the end. `version`: one that
        it has had, of which only the file of the mission itself is sent."""
        summary = await find_run(control, run)
        if version is not None:
            kept = await control.version_files(run, version)
            files = await file_models(control, [MissionFile(kept.file, "", kept.source)])
            return RunMissionModel(name=kept.file, process=summary.process, files=files)
        found = await control.mission(run)
        files = await file_models(control, found.files())
        return RunMissionModel(name=found.file, process=summary.process, files=files)

    return routes


async def run_now(control: MissionControl, summary: RunSummary) -> RunModel:
    """A run as JSON, with how long it has taken up to now."""
    took_s = None
    if summary.status in GOING_ON:
        with suppress(M2pemError):  # another executive drives it
            took_s = await control.mission_time_s(summary.run)
    return run_model(summary, took_s)


async def file_models(control: MissionControl, files: Iterable[MissionFile]) -> list[FileModel]:
    """Files as the page can draw them."""
    return [
        FileModel(name=each.name, qualifier=each.qualifier, xml=await shown(control, each.source))
        for each in files
    ]
