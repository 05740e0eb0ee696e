"""The routers of missions, without a network, over an executive with simulated vehicles."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
from fastapi import APIRouter, FastAPI
from m2pem_plugin_web.access.permissions import SCOPE_KEY
from m2pem_plugin_web.access.roles import Person, Role
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.problems import handle_problems
from m2pem_plugin_web.rest import (
    catalogue,
    checks,
    estimates,
    geometries,
    geometry_files,
    missions,
    rehearsals,
    runs,
    survey_patterns,
    verifications,
)
from m2pem_plugin_web.services import Services, services_of
from starlette.types import ASGIApp, Receive, Scope, Send
from web_world import PLUGINS

from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.rehearsal.worker import rehearse_in_subprocess
from m2pem.simulation.estimates import estimate_mission

REPOSITORY = Path(__file__).parents[4]
VIGNETTE = (REPOSITORY / "missions" / "vignette1.bpmn").read_text(encoding="utf-8")
FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
WITHIN_S = 60.0


class As:
    """The guard's part: says who asks, as a header of the test does."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            role = dict(scope["headers"]).get(b"x-role", b"commander").decode()
            if role:
                scope[SCOPE_KEY] = Person(f"a {role}", Role(role))
        await self._app(scope, receive, send)


def app_of(services: Services, *others: APIRouter) -> FastAPI:
    """The routers, and how refusals look."""
    control, folder = services.control, services.folder
    routers = (
        missions.router(control, folder),
        runs.router(control, folder, Hub(control)),
        missions.template_router(),
        checks.router(control, folder),
        estimates.router(control, folder),
        verifications.router(control, folder, services.verifications),
        rehearsals.router(control, folder, services.rehearsals),
        catalogue.router(control),
        geometry_files.router(control),
        geometries.router(control),
        survey_patterns.router(control),
        *others,
    )
    routes = [route for router in routers for route in router.routes]
    app = FastAPI(title="m2pem", openapi_url="/api/openapi.json", routes=routes)
    handle_problems(app)
    return app


@dataclass
class Rest:
    """What is asked for, and where it is kept."""

    http: httpx.AsyncClient
    services: Services
    folder: Path

    async def get(self, path: str, status: int = 200, **options: Any) -> Any:
        return self._said(await self.http.get(f"/api{path}", **options), status)

    async def post(self, path: str, body: Any, status: int = 200, **options: Any) -> Any:
        return self._said(await self.http.post(f"/api{path}", json=body, **options), status)

    async def put(self, path: str, body: Any, status: int = 200, **options: Any) -> Any:
        return self._said(await self.http.put(f"/api{path}", json=body, **options), status)

    async def delete(self, path: str, status: int = 204, **options: Any) -> Any:
        return self._said(await self.http.delete(f"/api{path}", **options), status)

    async def until_over(self, path: str) -> Any:
        """Ask until a job is over."""
        async with asyncio.timeout(WITHIN_S):
            while True:
                job = await self.get(path)
                if job["state"] != "running":
                    return job
                await asyncio.sleep(0.02)

    def _said(self, response: httpx.Response, status: int) -> Any:
        assert response.status_code == status, response.text
        if response.status_code >= 400:
            assert response.headers["content-type"] == "application/problem+json"
        return response.json() if response.content else None


@asynccontextmanager
async def rest_world(folder: Path, fleet: Path = FLEET) -> AsyncIterator[Rest]:
    """Everything, with the missions in `folder`."""
    executive = Executive(
        simulated_fleet(load_fleet(fleet)),
        MemoryJournal(),
        PLUGINS,
        SystemClock(20.0),
        speed=20.0,
        rehearse=rehearse_in_subprocess,
        estimate=estimate_mission,
    )
    async with executive:
        services = services_of(executive.control, folder)
        transport = httpx.ASGITransport(As(app_of(services)))
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
            try:
                yield Rest(http, services, folder)
            finally:
                await services.close()
