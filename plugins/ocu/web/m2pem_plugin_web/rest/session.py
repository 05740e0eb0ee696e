"""/api/session: the user, and what this executive moves; signing in and out."""

import math
from importlib.metadata import version
from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field

from m2pem.api import MissionControl
from m2pem_plugin_web.access.passwords import LONGEST
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.access.roles import Person, Role
from m2pem_plugin_web.access.sessions import Secrets
from m2pem_plugin_web.access.sign_in import Entry, ThrottledError
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import Body, Name
from m2pem_plugin_web.settings import Settings
from m2pem_plugin_web.tile_files import Pictured


class TilesModel(BaseModel):
    """Image tiles for the map. `attribution`: a plain text to show with them."""

    max_zoom: int
    attribution: str


class SessionModel(BaseModel):
    """The user of this session, and the executive. `tiles` null: the map has no images."""

    user: str
    role: Role
    fleet: str
    simulated: bool
    version: str
    missions_folder: str
    tiles: TilesModel | None


class BegunModel(SessionModel):
    """A new session. `key`: the header M2pem-Key of every request below /api."""

    key: str


class TokenModel(Body):
    """The token of the address that the executive printed."""

    token: Annotated[str, Field(max_length=LONGEST)]


class SignInModel(Body):
    """A named user."""

    name: Name
    password: Annotated[str, Field(max_length=LONGEST)]


def router(
    control: MissionControl, settings: Settings, entry: Entry, tiles: Pictured | None = None
) -> APIRouter:
    """The routes of a session."""
    routes = APIRouter(prefix="/api/session", tags=["session"], responses=RESPONSES)
    installed = version("m2pem")
    pictures = None
    if tiles is not None:
        pictures = TilesModel(max_zoom=tiles.max_zoom, attribution=tiles.attribution)

    def session_of(person: Person) -> SessionModel:
        return SessionModel(
            user=person.name,
            role=person.role,
            fleet=control.fleet().name,
            simulated=control.simulated(),
            version=installed,
            missions_folder=str(settings.missions),
            tiles=pictures,
        )

    @routes.get("")
    async def session(person: Viewer) -> SessionModel:
        """Return the user, and what this executive moves."""
        return session_of(person)

    @routes.post("")
    async def sign_in(
        request: Request, response: Response, wanted: TokenModel | SignInModel
    ) -> BegunModel:
        """Sign in, with a token or with a name and its password."""
        address = request.client.host if request.client else ""
        try:
            found = await _signed_in(entry, wanted, address)
        except ThrottledError as error:
            wait = {"Retry-After": str(math.ceil(error.wait_s))}
            raise ProblemError(429, str(error), headers=wait) from None
        person, secrets = found
        _set_cookie(response, entry, secrets)
        return BegunModel(**session_of(person).model_dump(), key=secrets.key)

    @routes.delete("", status_code=204)
    async def sign_out(request: Request, response: Response, _: Viewer) -> None:
        """Sign out; the cookie is no longer valid."""
        entry.leave(request.cookies)
        response.delete_cookie(entry.cookie, path="/")

    return routes


async def _signed_in(
    entry: Entry, wanted: TokenModel | SignInModel, address: str
) -> tuple[Person, Secrets]:
    if isinstance(wanted, TokenModel):
        found = entry.redeem(wanted.token, address)
        wrong = "the token was used already, or is too old: `m2pem web url` prints another"
        if entry.by_name:
            wrong = "users are named here: sign in with a name and its password"
    elif entry.by_name:
        found = await entry.sign_in(wanted.name, wanted.password, address)
        wrong = "the name or the password is wrong"
    else:
        found = None
        wrong = "no users are named here: open the address that `m2pem web url` prints"
    if found is None:
        raise ProblemError(401, wrong)
    return found


def _set_cookie(response: Response, entry: Entry, secrets: Secrets) -> None:
    """Set a cookie with one secret of a session, which no script can read."""
    response.set_cookie(
        entry.cookie,
        secrets.cookie,
        httponly=True,
        samesite="strict",
        secure=entry.secure,
        path="/",
    )
