"""/api/standbys: where a page goes on when its executive has died."""

from fastapi import APIRouter

from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Answer


class StandbyModel(Answer):
    """An executive that stands by for the fleet. `page`: the address of its page, or ""."""

    host: str
    pid: int
    page: str


def router(known: Standbys) -> APIRouter:
    """The route of the executives that stand by."""
    routes = APIRouter(prefix="/api/standbys", tags=["standbys"], responses=RESPONSES)

    @routes.get("")
    async def standbys(_: Viewer) -> list[StandbyModel]:
        """Return the executives that stand by for the fleet of this one."""
        return [StandbyModel.of(each) for each in known.found]

    return routes
