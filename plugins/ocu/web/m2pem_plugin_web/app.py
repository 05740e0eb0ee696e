"""Puts the app together: the guard before everything, the routers, and the page."""

from collections.abc import Iterable
from typing import Any

from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi

from m2pem.api import MissionControl
from m2pem_plugin_web.access.entry import Entry
from m2pem_plugin_web.access.guard import Guard
from m2pem_plugin_web.live import socket
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.pages import add_pages
from m2pem_plugin_web.problems import ProblemModel, handle_problems
from m2pem_plugin_web.rest import prompts, resources, runs, session, steering
from m2pem_plugin_web.settings import Settings

OPENAPI = "/api/openapi.json"


def routers_of(
    control: MissionControl, settings: Settings, hub: Hub, entry: Entry
) -> list[APIRouter]:
    """All that browsers may ask for."""
    return [
        session.router(control, settings),
        runs.router(control, settings.missions),
        steering.router(control),
        prompts.router(control, hub),
        resources.router(control),
        socket.router(hub, entry),
    ]


def create_app(routers: Iterable[APIRouter], entry: Entry) -> FastAPI:
    """The app. `entry` says who may come in."""
    # The pages of FastAPI about an API load scripts from elsewhere.
    app = FastAPI(title="m2pem", openapi_url=OPENAPI, docs_url=None, redoc_url=None)
    for router in routers:
        app.include_router(router)
    add_pages(app, entry)
    handle_problems(app)
    app.add_middleware(Guard, entry=entry)
    app.openapi = lambda: _described(app)  # type: ignore[method-assign]
    return app


def _described(app: FastAPI) -> dict[str, Any]:
    if app.openapi_schema is None:
        described = get_openapi(title=app.title, version=app.version, routes=app.routes)
        schemas = described.setdefault("components", {}).setdefault("schemas", {})
        schemas["Problem"] = ProblemModel.model_json_schema()
        app.openapi_schema = described
    return app.openapi_schema
