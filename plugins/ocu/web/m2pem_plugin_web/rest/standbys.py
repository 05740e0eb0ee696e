"""/api/standbys: where a page goes on when its executive has died."""

from collections.abc import Sequence

from fastapi import APIRouter

from m2pem.api import ExecutiveAddress
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.problems import RESPONSES


def router(known: Standbys) -> APIRouter:
    """The route of the executives that stand by."""
    routes = APIRouter(prefix="/api/standbys", tags=["standbys"], responses=RESPONSES)

    @routes.get("")
    async def standbys(_: Viewer) -> Sequence[ExecutiveAddress]:
        """Return the executives that stand by for the fleet of this one."""
        return known.found

    return routes
