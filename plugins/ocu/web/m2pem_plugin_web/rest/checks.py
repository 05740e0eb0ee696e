"""/api/checks, /api/editable: what is wrong with a drawing, and drawings for the editor."""

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from m2pem.api import Draft, MissionControl, Outline
from m2pem.errors import MissionError
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.missions.names import PathNames
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.drafts import DraftModel, draft_of, source_of
from m2pem_plugin_web.rest.models import Body, FindingModel, finding_models

AT_ONCE = 2
"""Files that are checked at the same time, in threads."""


class ProcessModel(BaseModel):
    """A process; `starts`: a run begins with it, unless another is named."""

    id: str
    name: str
    executable: bool
    starts: bool


class ElementModel(BaseModel):
    """Something drawn, or a flow; `parent`: what it is in, a subprocess or its process."""

    id: str
    name: str
    type: str
    process: str
    parent: str


class TriggerModel(BaseModel):
    """A signal or message; `operators`: whether they are expected to send it."""

    id: str
    name: str
    operators: bool


class DataNameModel(BaseModel):
    """A name of the data store; `from`: the id of what writes it, "" if nothing does."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    source: str = Field(validation_alias="from", serialization_alias="from")


class OutlineModel(BaseModel):
    """What a file has, as far as it can be read."""

    processes: list[ProcessModel]
    elements: list[ElementModel]
    names: list[DataNameModel]
    signals: list[TriggerModel]
    messages: list[TriggerModel]


class CheckModel(BaseModel):
    """All findings of `m2pem check`; `outline` null: it is no BPMN."""

    findings: list[FindingModel]
    outline: OutlineModel | None


class EditModel(Body):
    """A file; `layout`: forget how it was drawn, and lay it out again."""

    xml: str
    layout: bool = False


class EditableModel(BaseModel):
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
        outline = await threads.run(_outline, control, draft)
        return CheckModel(findings=finding_models(called.findings(findings)), outline=outline)

    @routes.post("/editable")
    async def editable(_: Viewer, wanted: EditModel) -> EditableModel:
        """A file for the editor: with a diagram of everything in it."""
        source = source_of(wanted.xml)
        found = await threads.run(control.editable, source, anew=wanted.layout)
        return EditableModel(xml=found.source.decode(), notes=list(found.notes))

    return routes


def _outline(control: MissionControl, draft: Draft) -> OutlineModel | None:
    try:
        found = control.outline(draft)
    except MissionError:
        return None
    return outline_model(found)


def outline_model(outline: Outline) -> OutlineModel:
    """An outline as JSON."""
    return OutlineModel(
        processes=[
            ProcessModel(id=p.id, name=p.name, executable=p.executable, starts=p.starts)
            for p in outline.processes
        ],
        elements=[
            ElementModel(id=e.id, name=e.name, type=e.type, process=e.process, parent=e.parent)
            for e in outline.elements
        ],
        names=[DataNameModel(name=n.name, source=n.source) for n in outline.names],
        signals=[
            TriggerModel(id=s.id, name=s.name, operators=s.operators) for s in outline.signals
        ],
        messages=[
            TriggerModel(id=m.id, name=m.name, operators=m.operators) for m in outline.messages
        ],
    )
