"""/api/prompts: the questions that stand, and the answers to them."""

from fastapi import APIRouter

from m2pem.api import MissionControl
from m2pem_plugin_web.access.people import Operator, Viewer
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.live.messages import prompt_of
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.lookup import find_run
from m2pem_plugin_web.rest.models import Body, Name, PromptModel


class AnswerModel(Body):
    """The `value` of one of the decisions."""

    decision: Name


def router(control: MissionControl, hub: Hub) -> APIRouter:
    """The routes of prompts."""
    routes = APIRouter(prefix="/api", tags=["prompts"], responses=RESPONSES)

    @routes.get("/prompts")
    async def prompts(_: Viewer) -> list[PromptModel]:
        """The questions that stand."""
        return [
            PromptModel.model_validate(prompt_of(each, hub.place(each)))
            for each in control.prompts()
        ]

    @routes.post("/runs/{run}/prompts/{prompt}", status_code=204)
    async def answer(person: Operator, run: str, prompt: str, wanted: AnswerModel) -> None:
        """Answer a question. The first answer to it wins."""
        await find_run(control, run)
        await control.answer(run, prompt, wanted.decision, by=person.name)

    return routes
