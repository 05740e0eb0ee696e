"""/api/operators: who is present, and who asks whom for control; notes in a run's log."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import MAX_NOTE_CHARACTERS, MissionControl, OperatorPresence, person_of
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Answer, Body, known_resource, known_run


class ControlRequestModel(Answer):
    """An operator asks another one for a resource: `OpenControlRequest`. `mine`: the one who reads
    this has it, and is asked; `own`: has asked."""

    resource: str
    by: str
    holder: str
    left_s: float
    given_then: bool
    holder_gone: bool
    mine: bool
    own: bool


class OperatorsModel(BaseModel):
    """Who is present, and who asks whom for what."""

    operators: list[OperatorPresence]
    control_requests: list[ControlRequestModel]


class AnswerControlModel(Body):
    """Whether it is given."""

    give: bool


class NoteModel(Body):
    """A note."""

    text: Annotated[str, Field(min_length=1, max_length=MAX_NOTE_CHARACTERS)]


def router(control: MissionControl) -> APIRouter:
    """The routes of what operators have to do with each other."""
    routes = APIRouter(prefix="/api", tags=["operators"], responses=RESPONSES)

    @routes.get("/operators")
    async def operators(person: Viewer) -> OperatorsModel:
        """Who is present, and who asks whom for what."""
        return OperatorsModel(
            operators=list(await control.operators()),
            control_requests=[
                ControlRequestModel.of(
                    each, mine=_same(each.holder, person.name), own=_same(each.by, person.name)
                )
                for each in await control.control_requests()
            ],
        )

    @routes.post("/resources/{resource:path}/request", status_code=204)
    async def request(person: Operator, resource: str) -> None:
        """Ask the operator who has it for it."""
        await known_resource(control, resource)
        await control.request_control(resource, by=person.name)

    @routes.post("/resources/{resource:path}/hand-over", status_code=204)
    async def hand_over(person: Operator, resource: str, wanted: AnswerControlModel) -> None:
        """Give it to the operator who asks for it, or refuse."""
        await known_resource(control, resource)
        await control.answer_control(resource, give=wanted.give, by=person.name)

    @routes.post("/runs/{run}/notes", status_code=204)
    async def note(person: Operator, run: str, wanted: NoteModel) -> None:
        """Write a note into the log of a run."""
        async with known_run(control, run):
            await control.add_note(run, wanted.text, by=person.name)

    return routes


def _same(name: str, other: str) -> bool:
    return person_of(name) == person_of(other)
