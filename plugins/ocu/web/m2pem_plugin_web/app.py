"""The ASGI app: checks of requests, the routers, and the page."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.types import ASGIApp

from m2pem_plugin_web import pages, probes
from m2pem_plugin_web import tiles as map_tiles
from m2pem_plugin_web.access.compression import CompressedAnswers
from m2pem_plugin_web.access.guard import Guard
from m2pem_plugin_web.access.requests import BoundedBodies, SafeHeaders
from m2pem_plugin_web.access.sign_in import Entry
from m2pem_plugin_web.live import socket
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.pages import Pages
from m2pem_plugin_web.problems import ProblemModel, handle_problems
from m2pem_plugin_web.replay.replays import Replays
from m2pem_plugin_web.rest import (
    alerts,
    approvals,
    catalogue,
    checks,
    comments,
    debugging,
    estimates,
    fleet_commands,
    geometries,
    geometry_files,
    incidents,
    missions,
    people,
    rehearsals,
    replays,
    revisions,
    run_pages,
    runs,
    schedule,
    session,
    standbys,
    steering,
    survey_patterns,
    terrain,
    tracks,
    verifications,
)
from m2pem_plugin_web.server import Slots
from m2pem_plugin_web.services import Services
from m2pem_plugin_web.settings import Settings
from m2pem_plugin_web.tile_files import open_tiles
from m2pem_plugin_web.tracks.recorder import Recorder

OPENAPI = "/api/openapi.json"


def routers_of(
    services: Services,
    settings: Settings,
    hub: Hub,
    entry: Entry,
    recorder: Recorder,
    replaying: Replays,
) -> list[APIRouter]:
    """Return the routers of the REST interface, the WebSocket and the page."""
    control, folder = services.control, services.folder
    tiles = open_tiles(settings.tiles) if settings.tiles is not None else None
    return [
        session.router(control, settings, entry, tiles.pictured if tiles is not None else None),
        runs.router(control, folder, hub),
        run_pages.router(control),
        replays.router(control, replaying, services.rehearsals),
        schedule.router(control, folder),
        tracks.router(control, recorder),
        steering.router(control, hub),
        steering.prompt_router(control, hub),
        debugging.router(control),
        steering.resource_router(control),
        fleet_commands.router(control, hub),
        incidents.router(control),
        revisions.router(control, folder),
        alerts.router(control),
        people.router(control),
        missions.router(control, folder),
        approvals.router(control, folder),
        comments.router(folder, hub),
        missions.template_router(),
        checks.router(control, folder),
        estimates.router(control, folder),
        verifications.router(control, folder, services.verifications),
        rehearsals.router(control, folder, services.rehearsals),
        catalogue.router(control),
        geometry_files.router(control),
        geometries.router(control),
        survey_patterns.router(control),
        terrain.router(control, settings.terrain),
        standbys.router(hub.standbys),
        map_tiles.router(tiles),
        socket.router(hub, entry),
        probes.router(control),
        pages.router(Pages()),
    ]


def create_app(
    routers: Iterable[APIRouter],
    entry: Entry,
    settings: Settings,
    slots: Slots,
    known: Standbys,
    videos: Mapping[str, str] = MappingProxyType({}),
) -> ASGIApp:
    """Create the app. `entry` signs users in; `slots` are the server's connections; the page may
    ask the pages of `known` whether they serve, and load what `videos` adds to its policy."""
    # FastAPI makes the routes of a router that is included a second time, which takes longer than
    # all else at the start: the app has them as they are.
    routes = [route for router in routers for route in router.routes]
    # FastAPI's pages about an API load scripts from other hosts.
    app = FastAPI(title="m2pem", openapi_url=OPENAPI, docs_url=None, redoc_url=None, routes=routes)
    handle_problems(app, settings.missions)
    app.openapi = lambda: _described(app)  # type: ignore[method-assign]
    guard = Guard(
        BoundedBodies(CompressedAnswers(app)),
        entry=entry,
        names=settings.names,
        scheme=settings.scheme,
        slots=slots,
    )
    return SafeHeaders(guard, lambda: known.pages, videos)


def _described(app: FastAPI) -> dict[str, Any]:
    if app.openapi_schema is None:
        described = get_openapi(title=app.title, version=app.version, routes=app.routes)
        schemas = described.setdefault("components", {}).setdefault("schemas", {})
        schemas["Problem"] = ProblemModel.model_json_schema()
        app.openapi_schema = described
    return app.openapi_schema
