"""/api/missions/{name}/comments: what persons say about the elements of a mission."""

from collections.abc import Callable
from typing import Annotated, ParamSpec, TypeVar

from fastapi import APIRouter
from fastapi import Path as InPath
from pydantic import Field

from m2pem.api import MAX_NOTE_CHARACTERS
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.missions.comments import CommentError, Comments
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.drafts import MissionName, of_folder
from m2pem_plugin_web.rest.models import Answer, Body

P = ParamSpec("P")
T = TypeVar("T")

Number = Annotated[int, InPath(ge=1, le=10**9)]
Words = Annotated[str, Field(min_length=1, max_length=MAX_NOTE_CHARACTERS, pattern=r"\S")]


class CommentModel(Answer):
    """A comment, or an answer to the comment `parent` (0: it answers none). `element`: the id of
    the element, "" for the mission as a whole; `label`: what that was called. `version`: of the
    mission's file then. `resolved_by`: who has settled it, "": it is open."""

    id: int
    element: str
    label: str
    text: str
    by: str
    at_us: int
    parent: int
    version: str
    resolved_by: str
    resolved_us: int


class NewCommentModel(Body):
    """A comment; with a `parent`, an answer to it."""

    text: Words
    element: Annotated[str, Field(max_length=300)] = ""
    label: Annotated[str, Field(max_length=300)] = ""
    parent: Annotated[int, Field(ge=0, le=10**9)] = 0


class ResolvedModel(Body):
    """Whether it is settled."""

    resolved: bool


def router(folder: MissionFolder, hub: Hub) -> APIRouter:
    """The routes of comments. `hub` tells all pages that there are others now."""
    routes = APIRouter(prefix="/api/missions", tags=["missions"], responses=RESPONSES)
    comments = Comments(folder)

    @routes.get("/{name}/comments")
    async def listed(_: Viewer, name: MissionName) -> list[CommentModel]:
        """All comments of a mission, the oldest first."""
        return [CommentModel.of(each) for each in await of_folder(comments.all, name)]

    @routes.post("/{name}/comments")
    async def add(person: Operator, name: MissionName, wanted: NewCommentModel) -> CommentModel:
        """Write a comment on an element, or an answer."""
        made = await _of_comments(
            comments.add,
            name,
            element=wanted.element,
            label=wanted.label,
            text=wanted.text.strip(),
            by=person.name,
            parent=wanted.parent,
        )
        hub.comments_changed(name)
        return CommentModel.of(made)

    @routes.post("/{name}/comments/{number}/resolve")
    async def resolve(
        person: Operator, name: MissionName, number: Number, wanted: ResolvedModel
    ) -> CommentModel:
        """Settle a comment, or open it again."""
        made = await _of_comments(
            comments.resolve, name, number, person.name, resolved=wanted.resolved
        )
        hub.comments_changed(name)
        return CommentModel.of(made)

    @routes.delete("/{name}/comments/{number}", status_code=204)
    async def delete(person: Operator, name: MissionName, number: Number) -> None:
        """Delete one's own comment, if no other person has answered; a commander deletes any."""
        of_others = person.role.covers(Role.COMMANDER)
        await _of_comments(comments.delete, name, number, person.name, of_others=of_others)
        hub.comments_changed(name)

    return routes


async def _of_comments(call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    try:
        return await of_folder(call, *args, **kwargs)
    except CommentError as error:
        raise ProblemError(404 if error.missing else 409, str(error)) from error
