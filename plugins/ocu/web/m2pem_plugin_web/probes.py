"""`/healthz` and `/readyz`: for programs that watch the executive, without signing in.

They say names and states alone: no path, no vehicle, no mission. The executive bounds what an
answer costs (`MissionControl.health`), and the server the connections.
"""

import asyncio

from fastapi import APIRouter
from fastapi.responses import JSONResponse

from m2pem.api import HealthStatus, MissionControl
from m2pem.errors import M2pemError

LIVE = "/healthz"
READY = "/readyz"

ANSWERED_WITHIN_S = 3.0
"""For an executive in another process, whose answer may not come."""

PROBE_HEADERS = {"cache-control": "no-store", "access-control-allow-origin": "*"}
"""The page of another executive of the fleet may ask: they say nothing secret."""


def router(control: MissionControl) -> APIRouter:
    """Return the routes of both."""
    routes = APIRouter(include_in_schema=False)

    @routes.api_route(LIVE, methods=["GET", "HEAD"])
    async def live() -> JSONResponse:
        """The event loop runs: it has answered."""
        return JSONResponse({"status": "live"}, headers=PROBE_HEADERS)

    @routes.api_route(READY, methods=["GET", "HEAD"])
    async def ready() -> JSONResponse:
        """200 if missions can be started and their records are written, else 503."""
        try:
            async with asyncio.timeout(ANSWERED_WITHIN_S):
                checks = {each.name: each.status.value for each in await control.health()}
        except (TimeoutError, M2pemError):
            checks = {"executive": HealthStatus.ERROR.value}
        is_ready = HealthStatus.ERROR not in checks.values()
        return JSONResponse(
            {"status": "ready" if is_ready else "not ready", "checks": checks},
            status_code=200 if is_ready else 503,
            headers=PROBE_HEADERS,
        )

    return routes
