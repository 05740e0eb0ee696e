"""/api/checks, /api/editable: what is wrong with a drawing, and drawings for the editor."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import (
    Draft,
    Finding,
    MissionControl,
    OutlineElement,
    OutlineProcess,
    OutlineTrigger,
)
from m2pem.errors import MissionError
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.missions.names import PathNames
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.drafts import DraftModel, draft_of, source_of
from m2pem_plugin_web.rest.models import Answer, Body

AT_ONCE = 2
"""Files that are checked at the same time, in threads."""


class DataNameModel(Answer):
    """A name of the data store; `from`: the id of what writes it, "" if nothing does."""

    name: str
    source: str = Field(serialization_alias="from")


class OutlineModel(Answer):
    """What a file has, as far as it can be read."""

    processes: list[OutlineProcess]
    elements: list[OutlineElement]
    names: list[DataNameModel]
    signals: list[OutlineTrigger]
    messages: list[OutlineTrigger]


class CheckModel(BaseModel):
    """All findings of `m2pem check`; `outline` null: it is no BPMN."""

    findings: list[Finding]
    outline: OutlineModel | None


class EditModel(Body):
    """A file; `layout`: forget how it was drawn, and lay it out again."""

    xml: str
    layout: bool = False


class EditableModel(Answer):
    """The same mission as the editor takes it; `notes`: what it does not keep."""

    xml: str
    notes: list[str]


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The routes of checks."""
    routes = APIRouter(prefix="/api", tags=["checks"], responses=RESPONSES)
    threads = BoundedThreads(AT_ONCE)
    called = PathNames(folder.path)

    @routes.post("/checks")
    async def check(_: Viewer, wanted: DraftModel) -> CheckModel:
        """Check a mission against the fleet, and list what is in it."""
        draft = await draft_of(wanted, folder)
        findings = await threads.run(
            control.check, draft, process=wanted.process, data=wanted.data or ()
        )
        return CheckModel(
            findings=list(called.findings(findings)),
            outline=await threads.run(_outline, control, draft),
        )

    @routes.post("/editable")
    async def editable(_: Viewer, wanted: EditModel) -> EditableModel:
        """A file for the editor: with a diagram of everything in it."""
        source = source_of(wanted.xml)
        found = await threads.run(control.editable, source, anew=wanted.layout)
        return EditableModel.of(found, xml=found.source.decode())

    return routes


def _outline(control: MissionControl, draft: Draft) -> OutlineModel | None:
    try:
        found = control.outline(draft)
    except MissionError:
        return None
    return OutlineModel.of(found)
