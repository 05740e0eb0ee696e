"""/api/session: who one is here, and what this executive moves."""

from importlib.metadata import version

from fastapi import APIRouter
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem_plugin_web.access.people import Role, Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.settings import Settings


class SessionModel(BaseModel):
    """Who asks, and where they are."""

    user: str
    role: Role
    fleet: str
    simulated: bool
    version: str
    missions_folder: str


def router(control: MissionControl, settings: Settings) -> APIRouter:
    """The routes of a session."""
    routes = APIRouter(prefix="/api/session", tags=["session"], responses=RESPONSES)
    installed = version("m2pem")

    @routes.get("")
    async def session(person: Viewer) -> SessionModel:
        """Who one is, and what this executive moves."""
        return SessionModel(
            user=person.name,
            role=person.role,
            fleet=control.fleet().name,
            simulated=control.simulated(),
            version=installed,
            missions_folder=str(settings.missions),
        )

    return routes
