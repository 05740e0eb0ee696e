"""The page itself: its files, and the same `index.html` for every address of it."""

from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import FileResponse, RedirectResponse, Response
from fastapi.staticfiles import StaticFiles

from m2pem_plugin_web.access.entry import Entry

STATIC = Path(__file__).parent / "static"

ADDRESSES = (
    "/",
    "/sign-in",
    "/missions/{name:path}",
    "/runs/{run}",
    "/rehearsals/{rehearsal}",
)
"""Addresses of the page; what is shown there, it decides by itself."""


def add_pages(app: FastAPI, entry: Entry, static: Path = STATIC) -> None:
    """Serve the page. `?token=` in any of its addresses signs in, once, and disappears."""
    router = APIRouter(include_in_schema=False)

    def page(request: Request) -> Response:
        token = request.query_params.get("token")
        if token is None:
            return FileResponse(static / "index.html", headers={"Cache-Control": "no-cache"})
        key = entry.redeem(token)
        if key is None:
            return RedirectResponse("/sign-in?refused=token", 303)
        response = RedirectResponse(request.url.path, 303)
        response.set_cookie(
            entry.cookie, key, httponly=True, samesite="lax", secure=entry.secure, path="/"
        )
        return response

    for address in ADDRESSES:
        router.add_api_route(address, page, methods=["GET"])
    app.include_router(router)
    if static.is_dir():
        app.mount("/", StaticFiles(directory=static))
