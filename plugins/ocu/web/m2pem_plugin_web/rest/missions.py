"""/api/missions, /api/templates: the folder of missions with all that was ever saved there."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Response
from fastapi import Path as InPath

from m2pem.api import MissionControl, file_digest
from m2pem_plugin_web.access.permissions import Commander, Viewer
from m2pem_plugin_web.missions.folder import MissionFolder, Summaries
from m2pem_plugin_web.missions.versions import version_of
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.drafts import MissionName, of_folder, source_of
from m2pem_plugin_web.rest.models import Answer, Body
from m2pem_plugin_web.templates import find, templates

BPMN = "application/xml"

VersionNumber = Annotated[int, InPath(ge=1, le=10**9)]


class MissionLineModel(Answer):
    """A mission of the folder. `by`: who saved it here, "" if it came in another way.

    `runnable`: `m2pem check` finds no errors in it.
    """

    name: str
    title: str
    version: str
    saved_at_us: int
    by: str
    runnable: bool


class SavedModel(Answer):
    """What was saved. `version`: a hash of its content."""

    name: str
    version: str
    saved_at_us: int
    by: str


class MissionModel(SavedModel):
    """A mission for the editor; `notes`: what that does not keep of the file."""

    xml: str
    notes: list[str]


class VersionModel(Answer):
    """One that was saved or found. `deleted`: it was the last before the mission was deleted."""

    number: int
    version: str
    saved_at_us: int
    by: str
    deleted: bool


class OldMissionModel(VersionModel):
    """An older one, for the editor."""

    name: str
    xml: str
    notes: list[str]


class SaveModel(Body):
    """`base`: the version that it was made of; null: it is a new mission."""

    xml: str
    base: str | None


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The routes of missions."""
    routes = APIRouter(prefix="/api/missions", tags=["missions"], responses=RESPONSES)
    summaries = Summaries(control, folder)

    @routes.get("")
    async def missions(_: Viewer) -> list[MissionLineModel]:
        """What is in the folder."""
        return [
            MissionLineModel.of(each.saved, title=each.title, runnable=each.runnable)
            for each in await of_folder(summaries.all)
        ]

    @routes.get("/{name}")
    async def mission(_: Viewer, name: MissionName) -> MissionModel:
        """A mission for the editor."""
        saved = await of_folder(folder.read, name)
        found = await asyncio.to_thread(control.editable, saved.source)
        return MissionModel.of(saved, xml=found.source.decode(), notes=found.notes)

    @routes.put("/{name}")
    async def save(person: Commander, name: MissionName, wanted: SaveModel) -> SavedModel:
        """Save a mission, also one with errors, but never over what is not its `base`: then 409,
        with what is there as `current`."""
        source = source_of(wanted.xml)
        await asyncio.to_thread(control.outline, source)
        if version_of(source) != wanted.base:  # before it may be approved
            await control.note_edit(file_digest(source), by=person.name)
        saved = await of_folder(folder.save, name, source, wanted.base, person.name)
        return SavedModel.of(saved)

    @routes.delete("/{name}", status_code=204)
    async def delete(person: Commander, name: MissionName) -> None:
        """Delete a mission; it is kept as a version."""
        await of_folder(folder.delete, name, person.name)

    @routes.get("/{name}/file", response_class=Response, responses={200: {"content": {BPMN: {}}}})
    async def file(_: Viewer, name: MissionName) -> Response:
        """The file as it is on the disk."""
        saved = await of_folder(folder.read, name)
        ascii_name = saved.path.name.encode("ascii", "replace").decode().replace("?", "_")
        disposition = f'attachment; filename="{ascii_name}"'
        return Response(saved.source, 200, {"content-disposition": disposition}, BPMN)

    @routes.get("/{name}/versions")
    async def versions(_: Viewer, name: MissionName) -> list[VersionModel]:
        """All that is kept of a mission, also of one that was deleted, the oldest first."""
        return [VersionModel.of(each) for each in await of_folder(folder.versions, name)]

    @routes.get("/{name}/versions/{number}")
    async def version(_: Viewer, name: MissionName, number: VersionNumber) -> OldMissionModel:
        """One of them, for the editor."""
        kept, source = await of_folder(folder.version, name, number)
        found = await asyncio.to_thread(control.editable, source)
        return OldMissionModel.of(kept, name=name, xml=found.source.decode(), notes=found.notes)

    return routes


class TemplateLineModel(Answer):
    """A mission to begin with; `doc` says what it does."""

    name: str
    title: str
    doc: str


class TemplateModel(Answer):
    """A mission to begin with, for the editor."""

    name: str
    xml: str


def template_router() -> APIRouter:
    """The routes of templates."""
    routes = APIRouter(prefix="/api/templates", tags=["templates"], responses=RESPONSES)

    @routes.get("")
    async def listed(_: Viewer) -> list[TemplateLineModel]:
        """What there is."""
        return [TemplateLineModel.of(each) for each in templates()]

    @routes.get("/{name}")
    async def template(_: Viewer, name: str) -> TemplateModel:
        """One of them."""
        found = find(name)
        if found is None:
            raise ProblemError(404, f"there is no template {name}")
        return TemplateModel.of(found)

    return routes
