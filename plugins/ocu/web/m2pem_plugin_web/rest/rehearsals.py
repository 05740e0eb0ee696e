"""/api/rehearsals: missions on a virtual clock, to be looked at like runs."""

import asyncio
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Query, Response
from pydantic import AwareDatetime, BaseModel, Field

from m2pem.api import Finding, MissionControl, MissionFile, SimulationResult
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.jobs import Job, Jobs, JobState
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.drafts import DraftModel, draft_of
from m2pem_plugin_web.rest.models import Answer, RecordPage, RunModel, run_model
from m2pem_plugin_web.rest.record_pages import new_view, page_of
from m2pem_plugin_web.rest.runs import LARGEST, MOST_RECORDS, RunMissionModel, file_models
from m2pem_plugin_web.rest.verifications import JobModel

LONGEST_ANSWERS = 1_000_000
EVERY_S = 0.5

_encode = msgspec.json.Encoder().encode


class RehearseModel(DraftModel):
    """What to rehearse. `answers`: the text of an answers file (docs/rehearsal.md).

    `start`: when it begins, ISO 8601 with a zone. `every_s`: of mission time, how often the
    telemetry says where the vehicles are; long rehearsals say so less often.
    """

    answers: Annotated[str, Field(max_length=LONGEST_ANSWERS)] | None = None
    start: Annotated[AwareDatetime, Field(strict=False)] | None = None
    every_s: Annotated[float, Field(ge=0.05, le=60, strict=False)] = EVERY_S


class RehearsalModel(Answer):
    """A rehearsal. `summary`: of its one run, r1, when it is done."""

    id: str
    by: str
    state: JobState
    summary: RunModel | None
    problem: str | None
    findings: list[Finding]


class SampleModel(BaseModel):
    """How vehicles and payloads were at a moment of mission time, in seconds."""

    t: float
    vehicles: dict[str, Any]
    payloads: dict[str, Any]


def router(
    control: MissionControl, folder: MissionFolder, jobs: Jobs[SimulationResult]
) -> APIRouter:
    """The routes of rehearsals."""
    routes = APIRouter(prefix="/api/rehearsals", tags=["rehearsals"], responses=RESPONSES)

    @routes.post("", status_code=202)
    async def begin(person: Operator, wanted: RehearseModel) -> JobModel:
        """Rehearse a mission with this fleet on a virtual clock."""
        draft = await draft_of(wanted, folder)
        options: dict[str, Any] = {
            "process": wanted.process,
            "data": wanted.data,
            "answers": wanted.answers.encode() if wanted.answers is not None else None,
            "telemetry_every_s": wanted.every_s,
        }
        if wanted.start is not None:
            options["start_us"] = _microseconds(wanted.start)

        async def work(_: str) -> SimulationResult:
            return await control.simulate(draft, **options)

        return JobModel(id=jobs.begin(person.name, work).id)

    @routes.get("/{identifier}")
    async def rehearsal(_: Viewer, identifier: str) -> RehearsalModel:
        """Return its state."""
        job = jobs.get(identifier)
        return RehearsalModel.of(
            job,
            summary=run_model(job.result.summary) if job.result is not None else None,
            problem=job.problem or None,
        )

    @routes.delete("/{identifier}", status_code=204)
    async def cancel(_: Operator, identifier: str) -> None:
        """End it; nothing happens to one that has ended."""
        await jobs.cancel(identifier)

    @routes.get("/{identifier}/records", response_model=RecordPage)
    async def records(
        _: Viewer,
        identifier: str,
        after: Annotated[int, Query(ge=0, le=LARGEST)] = 0,
        limit: Annotated[int, Query(ge=1, le=MOST_RECORDS)] = 1000,
    ) -> Response:
        """Its records after one of them: 0, or the `next` of the page before."""
        result = result_of(jobs.get(identifier))

        def page() -> bytes:
            view = new_view(result.summary, names=names_of(control, result.files))
            for stamped in result.records[:after]:
                view.apply(stamped)
            return page_of(result.records[after : after + limit], view, limit)

        # In a thread, as thousands of records take longer than the executive may wait.
        return Response(await asyncio.to_thread(page), media_type="application/json")

    @routes.get("/{identifier}/mission")
    async def mission(_: Viewer, identifier: str) -> RunMissionModel:
        """What was rehearsed: its file, and those that it calls into."""
        result = result_of(jobs.get(identifier))
        return RunMissionModel(
            name=result.summary.mission,
            process=result.summary.process,
            files=await file_models(control, result.files),
        )

    @routes.get("/{identifier}/telemetry", response_model=list[SampleModel])
    async def telemetry(_: Viewer, identifier: str) -> Response:
        """Where the vehicles were, over mission time."""
        samples: Sequence[Any] = [
            {"t": each.t_s, "vehicles": each.vehicles, "payloads": each.payloads}
            for each in result_of(jobs.get(identifier)).telemetry
        ]
        return Response(_encode(samples), media_type="application/json")

    return routes


def _microseconds(moment: datetime) -> int:
    since = moment.astimezone(UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds


def names_of(control: MissionControl, files: Iterable[MissionFile]) -> dict[str, str]:
    """Return the names of what the files define, by the ids that records have."""
    names = {}
    for file in files:
        outline = control.outline(file.source)
        prefix = f"{file.qualifier}:" if file.qualifier else ""
        defined = [(each.id, each.name) for each in outline.processes]
        defined += [(each.id, each.name) for each in outline.elements]
        defined += [(each.id, each.name) for each in (*outline.signals, *outline.messages)]
        names.update({f"{prefix}{id_}": name for id_, name in defined})
    return names


def result_of(job: Job[SimulationResult]) -> SimulationResult:
    """Return the result of a rehearsal.

    Raises:
        ProblemError: 409, it is not done.
    """
    if job.result is None:
        raise ProblemError(409, f"the rehearsal is {job.state}")
    return job.result
