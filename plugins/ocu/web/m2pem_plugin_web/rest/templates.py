"""/api/templates: missions to begin with."""

from fastapi import APIRouter
from pydantic import BaseModel

from m2pem_plugin_web.access.people import Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.templates import find, templates


class TemplateLineModel(BaseModel):
    """A mission to begin with; `doc` says what it does."""

    name: str
    title: str
    doc: str


class TemplateModel(BaseModel):
    """A mission to begin with, for the editor."""

    name: str
    xml: str


def router() -> APIRouter:
    """The routes of templates."""
    routes = APIRouter(prefix="/api/templates", tags=["templates"], responses=RESPONSES)

    @routes.get("")
    async def listed(_: Viewer) -> list[TemplateLineModel]:
        """What there is."""
        return [
            TemplateLineModel(name=each.name, title=each.title, doc=each.doc)
            for each in templates()
        ]

    @routes.get("/{name}")
    async def template(_: Viewer, name: str) -> TemplateModel:
        """One of them."""
        found = find(name)
        if found is None:
            raise ProblemError(404, f"there is no template {name}")
        return TemplateModel(name=found.name, xml=found.xml)

    return routes
