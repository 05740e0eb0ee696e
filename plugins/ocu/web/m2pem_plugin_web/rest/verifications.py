"""/api/verifications: proofs that take their time; who ordered one comes back for its answer."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import Finding, MissionControl, SearchLimits, SearchProgress
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.jobs import Jobs, JobState
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.drafts import DraftModel, draft_of
from m2pem_plugin_web.rest.models import Answer

LONGEST_S = 3600.0
MOST_STATES = 10_000_000
LONGEST_SPEC = 1_000_000
MOST_ASSUMPTIONS = 20
Assumption = Annotated[str, Field(max_length=1_000)]

Report = Mapping[str, Any]


class VerifyModel(DraftModel):
    """What to prove. `spec`: the text of a file of requirements. `timers`: whether those that begin
    together come in any order, or in that of their times. `assume`: what all runs are taken to do,
    such as `no-failures`. `all_pools`: whether all pools of a collaboration begin together.
    `exhaustive`: a large search goes on after a violation."""

    spec: Annotated[str, Field(max_length=LONGEST_SPEC)] | None = None
    strict: bool = False
    timers: Literal["any", "in-order"] = "any"
    assume: Annotated[list[Assumption], Field(max_length=MOST_ASSUMPTIONS, default_factory=list)]
    all_pools: bool = False
    seconds: Annotated[float, Field(gt=0, le=LONGEST_S, strict=False)] = 600.0
    states: Annotated[int, Field(ge=1, le=MOST_STATES)] = 2_000_000
    exhaustive: bool = False


class JobModel(BaseModel):
    """Where to come back to."""

    id: str


class VerificationModel(Answer):
    """A verification. `report`: as docs/verification.schema.json says, when it is done."""

    id: str
    by: str
    state: JobState
    progress: SearchProgress
    report: dict[str, Any] | None
    problem: str | None
    findings: list[Finding]


def router(control: MissionControl, folder: MissionFolder, jobs: Jobs[Report]) -> APIRouter:
    """The routes of verifications."""
    routes = APIRouter(prefix="/api/verifications", tags=["verifications"], responses=RESPONSES)
    progress: dict[str, SearchProgress] = {}

    @routes.post("", status_code=202)
    async def begin(person: Operator, wanted: VerifyModel) -> JobModel:
        """Verify a mission with this fleet, as `m2pem verify` does."""
        draft = await draft_of(wanted, folder)

        async def work(identifier: str) -> Report:
            def progressed(searched: SearchProgress) -> None:
                progress[identifier] = searched

            try:
                return await control.verify(
                    draft,
                    process=wanted.process,
                    data=wanted.data,
                    spec=wanted.spec,
                    strict=wanted.strict,
                    timers_in_order=wanted.timers == "in-order",
                    assume=wanted.assume,
                    all_pools=wanted.all_pools,
                    limits=SearchLimits(wanted.states, wanted.seconds, wanted.exhaustive),
                    on_progress=progressed,
                )
            finally:
                progress.pop(identifier, None)

        return JobModel(id=jobs.begin(person.name, work).id)

    @routes.get("/{identifier}")
    async def verification(_: Viewer, identifier: str) -> VerificationModel:
        """Return its state."""
        job = jobs.get(identifier)
        report = dict(job.result) if job.result is not None else None
        found = progress.get(identifier, SearchProgress(0.0))
        if report is not None:
            covered = report["coverage"]
            found = SearchProgress(covered["seconds"], covered["states"])
        return VerificationModel.of(job, progress=found, report=report, problem=job.problem or None)

    @routes.delete("/{identifier}", status_code=204)
    async def cancel(_: Operator, identifier: str) -> None:
        """End it; nothing happens to one that has ended."""
        await jobs.cancel(identifier)

    return routes
