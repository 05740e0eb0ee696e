"""The files of the page, and `index.html` for each of its addresses."""

import asyncio
import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import Response
from starlette.datastructures import Headers

from m2pem_plugin_web.problems import ProblemError

STATIC = Path(__file__).parent / "static"

ADDRESSES = (
    "/",
    "/sign-in",
    "/alerts",
    "/fleet",
    "/missions/{name}",
    "/runs/{run}",
    "/rehearsals/{rehearsal}",
)
"""Addresses of the page; the router in the browser shows their content."""

FOR_EVER = "public, max-age=31536000, immutable"
"""Files below assets/ have a hash of their content in their names."""

TYPES = {
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}
COMPRESSED = ("text/", "application/json", "image/svg+xml", "application/javascript")
SMALLEST = 1000
"""Bytes below which compression gains nothing."""


@dataclass(frozen=True, slots=True)
class _File:
    content: bytes
    compressed: bytes | None
    media_type: str
    etag: str


class Pages:
    """Files of a folder, each read and compressed once, in a thread."""

    def __init__(self, folder: Path = STATIC) -> None:
        self._folder = folder.resolve()
        self._files: dict[tuple[Path, int], _File] = {}

    async def answer(self, name: str, headers: Headers) -> Response:
        """Return a file of the folder.

        Raises:
            ProblemError: 404, it does not exist.
        """
        file = await self._file(self._find(name))
        said = {
            "etag": file.etag,
            "cache-control": FOR_EVER if name.startswith("assets/") else "no-cache",
            "vary": "accept-encoding",
        }
        if file.etag in headers.get("if-none-match", ""):
            return Response(status_code=304, headers=said)
        content = file.content
        if file.compressed is not None and "gzip" in headers.get("accept-encoding", ""):
            content = file.compressed
            said["content-encoding"] = "gzip"
        return Response(content, headers=said, media_type=file.media_type)

    def _find(self, name: str) -> tuple[Path, int]:
        try:
            path = (self._folder / name).resolve()
            if path.is_relative_to(self._folder) and path.is_file():
                return path, path.stat().st_mtime_ns
        except (OSError, ValueError):  # the name is not valid for a file
            pass
        raise ProblemError(404, "this page does not exist")

    async def _file(self, found: tuple[Path, int]) -> _File:
        if found not in self._files:
            self._files[found] = await asyncio.to_thread(_read, found[0])
        return self._files[found]


def _read(path: Path) -> _File:
    content = path.read_bytes()
    media_type = (
        TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    )
    compresses = media_type.startswith(COMPRESSED) and len(content) >= SMALLEST
    compressed = gzip.compress(content, mtime=0) if compresses else None
    return _File(content, compressed, media_type, f'"{hashlib.sha256(content).hexdigest()[:32]}"')


def router(pages: Pages) -> APIRouter:
    """The routes of the page. The page signs in with `?token=` of its address."""
    routes = APIRouter(include_in_schema=False)

    async def page(request: Request) -> Response:
        return await pages.answer("index.html", request.headers)

    for address in ADDRESSES:
        routes.add_api_route(address, page, methods=["GET"])

    @routes.get("/{name}")
    async def file(request: Request, name: str) -> Response:
        """A file of the page."""
        return await pages.answer(name, request.headers)

    @routes.get("/assets/{name:path}")
    async def asset(request: Request, name: str) -> Response:
        """A file of the page that never changes."""
        return await pages.answer(f"assets/{name}", request.headers)

    return routes
