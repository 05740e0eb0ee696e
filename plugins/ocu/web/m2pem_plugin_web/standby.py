"""What the page's address answers while its executive stands by: who serves, and where.

It reads nothing and changes nothing, so that it needs no session.
"""

import logging
from collections.abc import Callable, Mapping
from html import escape

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from m2pem.api import ExecutiveAddress
from m2pem.errors import PluginError
from m2pem_plugin_web.access.requests import SafeHeaders
from m2pem_plugin_web.live.standbys import with_page
from m2pem_plugin_web.probes import LIVE, PROBE_HEADERS, READY
from m2pem_plugin_web.problems import METHODS, problem
from m2pem_plugin_web.server import Server
from m2pem_plugin_web.settings import read_settings

log = logging.getLogger("m2pem.ocu")

ServedBy = Callable[[], ExecutiveAddress | None]

_RELOAD_S = 2
_HEADERS = {"cache-control": "no-store", "retry-after": str(_RELOAD_S)}
_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="{reload_s}">
<meta name="viewport" content="width=device-width"><title>m2pem: standby</title>
<body style="font: 16px sans-serif; margin: 3rem auto; max-width: 40rem">
<h1>Standby for {fleet}</h1><p>{text}</p>
<p>When this executive takes over, its page is here.</p></body></html>
"""


async def serve(fleet: str, served_by: ServedBy, environment: Mapping[str, str]) -> None:
    """Answer until cancelled; not where another program has the address, such as the executive of
    this host that serves."""
    settings = read_settings(environment)
    try:
        server = Server(settings)
    except PluginError as error:
        log.info("while this executive stands by: %s", error)
        return
    try:
        await server.serve(create_app(fleet, served_by))
    finally:
        server.close()


def create_app(fleet: str, served_by: ServedBy) -> ASGIApp:
    """Create the app of a standby."""

    async def live(_: Request) -> Response:
        return JSONResponse({"status": "live"}, headers=PROBE_HEADERS)

    def serves() -> dict[str, object] | None:
        server = served_by()
        if server is None:
            return None
        return {"host": server.host, "pid": server.pid, "page": server.page}

    async def ready(_: Request) -> Response:
        said = {"status": "standby", "served_by": serves()}
        return JSONResponse(said, status_code=503, headers=PROBE_HEADERS)

    async def api(_: Request) -> Response:
        detail = f"this executive stands by for {fleet}, and does nothing: ask the one that serves"
        return problem(503, detail, _HEADERS, served_by=serves())

    async def page(_: Request) -> Response:
        text = _said(fleet, served_by())
        content = _PAGE.format(fleet=escape(fleet), text=text, reload_s=_RELOAD_S)
        return HTMLResponse(content, status_code=503, headers=_HEADERS)

    routes = [
        *(Route(LIVE, live), Route(READY, ready)),
        Route("/api/{path:path}", api, methods=METHODS),
        Route("/{path:path}", page),
    ]
    return SafeHeaders(Starlette(routes=routes))


def _said(fleet: str, server: ExecutiveAddress | None) -> str:
    if server is None or not server.pid:
        return f"Which executive serves {escape(fleet)} is not known now."
    text = f"Process {server.pid} on {escape(server.host)} serves {escape(fleet)}"
    page = with_page(server).page
    return f'{text}: <a href="{page}">{page}</a>' if page else f"{text}. It has no page."
