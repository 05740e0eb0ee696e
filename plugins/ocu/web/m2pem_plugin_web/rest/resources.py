"""/api/resources: who has which vehicle or payload; operators take them, and give them back."""

from fastapi import APIRouter
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem_plugin_web.access.people import Operator, Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError


class HoldersModel(BaseModel):
    """Who has each resource: an operator, a behavior ("r1.b3"), or "" when nobody does."""

    holders: dict[str, str]


def router(control: MissionControl) -> APIRouter:
    """The routes of resources."""
    routes = APIRouter(prefix="/api/resources", tags=["resources"], responses=RESPONSES)

    async def known(resource: str) -> None:
        if resource not in await control.holders():
            raise ProblemError(404, f"the fleet has no {resource}")

    @routes.get("")
    async def holders(_: Viewer) -> HoldersModel:
        """Who has what."""
        found = await control.holders()
        return HoldersModel(holders={str(each): who for each, who in found.items()})

    @routes.post("/{resource:path}/take", status_code=204)
    async def take(person: Operator, resource: str) -> None:
        """Take it from the missions, to steer it by hand."""
        await known(resource)
        await control.take(resource, by=person.name)

    @routes.post("/{resource:path}/give-back", status_code=204)
    async def give_back(person: Operator, resource: str) -> None:
        """Give it back to the missions."""
        await known(resource)
        await control.give_back(resource, by=person.name)

    return routes
