"""/api/runs/{run}/revision: a running mission goes on with a new version of its file; and the
versions that it has had."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter
from pydantic import Field, model_validator

from m2pem.api import (
    Draft,
    Finding,
    MissionControl,
    MissionSource,
    RevisionEffect,
    RevisionPreview,
    RevisionRefusal,
    RunVersion,
)
from m2pem_plugin_web.access.permissions import Commander, Operator, Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.drafts import WrittenName, of_folder, source_of
from m2pem_plugin_web.rest.incidents import OutlookModel, outlook_model
from m2pem_plugin_web.rest.models import Answer, Body, Name, find_run, known_run

MOST_MOVES = 1000


class NewVersionModel(Body):
    """A new version: a mission of the folder. `version`: of that mission, None for its newest.

    `xml`: the new version itself, which is not saved; it is called as `mission`, and may use the
    other files of the folder. `had`: in place of all these, a version that the run has had.

    `moves`: by element, the element or sequence flow that its token goes to first; "": it ends.
    """

    mission: WrittenName | None = None
    version: str | None = None
    xml: str | None = None
    had: Name | None = None
    moves: Annotated[dict[Name, str], Field(max_length=MOST_MOVES)] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_of_both(self) -> "NewVersionModel":
        if (self.mission is None) == (self.had is None):
            raise ValueError("send a mission, or a version that the run has had")
        if [self.xml, self.version, self.had].count(None) < 2:
            raise ValueError(
                "send xml, or a version of a mission of the folder, or one that the run has had: "
                "only one of them"
            )
        return self


class RevisionModel(NewVersionModel):
    """As for a plan. `plan`: that which was seen. `even_if_stuck`: an operator has confirmed that
    the mission cannot complete after it."""

    plan: Name
    even_if_stuck: bool = False


class PlanModel(Answer):
    """What a revision would do. `possible`: nothing speaks against it but what may be confirmed;
    `approval`: who must approve the new version before, "" if that is not needed. `busy`: what new
    and changed tasks name and others have now, with what happens then."""

    plan: str
    version: str
    previous: str
    possible: bool
    changes: list[str]
    effects: list[RevisionEffect]
    refusals: list[RevisionRefusal]
    findings: list[Finding]
    outlook: OutlookModel | None
    approval: str
    busy: list[str]


def plan_model(preview: RevisionPreview) -> PlanModel:
    """Return a plan as JSON."""
    outlook = None if preview.outlook is None else outlook_model(preview.outlook)
    return PlanModel.of(preview, possible=preview.is_possible, outlook=outlook)


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The routes of revisions. `folder`: where new versions are."""
    routes = APIRouter(prefix="/api/runs", tags=["runs"], responses=RESPONSES)

    async def new_version(run: str, wanted: NewVersionModel) -> MissionSource:
        if wanted.mission is None:
            assert wanted.had is not None
            return await control.version_files(run, wanted.had)
        if wanted.xml is not None:
            source = source_of(wanted.xml)
        else:
            source = await of_folder(folder.source, wanted.mission, wanted.version)
        return Draft(await of_folder(folder.file, wanted.mission), source)

    @routes.get("/{run}/versions")
    async def versions(_: Viewer, run: str) -> Sequence[RunVersion]:
        """Each version of its mission that a run has had, the present one last."""
        await find_run(control, run)
        return await control.versions(run)

    @routes.post("/{run}/revision/plan")
    async def plan(_: Operator, run: str, wanted: NewVersionModel) -> PlanModel:
        """What it would do to a run to go on with a new version of its mission."""
        async with known_run(control, run):
            version = await new_version(run, wanted)
            found = await control.plan_revision(run, version, moves=wanted.moves)
        return plan_model(found)

    @routes.post("/{run}/revision", status_code=204)
    async def revise(person: Commander, run: str, wanted: RevisionModel) -> None:
        """Go on with a new version of a run's mission, by a plan that was seen."""
        async with known_run(control, run):
            await control.revise(
                run,
                await new_version(run, wanted),
                wanted.plan,
                moves=wanted.moves,
                by=person.name,
                even_if_stuck=wanted.even_if_stuck,
            )

    return routes
