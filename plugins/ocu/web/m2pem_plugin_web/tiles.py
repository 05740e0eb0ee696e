"""Map tiles from a local file: MBTiles 1.3 (a table of tiles in SQLite,
github.com/mapbox/mbtiles-spec), which QGIS, GDAL and tile servers write."""

import asyncio
import html
import re
import sqlite3
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Annotated

from fastapi import APIRouter
from fastapi import Path as InPath
from fastapi.responses import Response

from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.settings import TILES, SettingError

MEDIA_TYPES = {
    "png": "image/png",
    "jpg": "image/jpeg",
    "jpeg": "image/jpeg",
    "webp": "image/webp",
}
DEEPEST = 24
"""Zoom levels that the page may request."""

KEPT = "private, max-age=3600"

_MARKUP = re.compile(r"<[^>]*>")


@dataclass(frozen=True, slots=True)
class Pictured:
    """The metadata of a file of tiles. `attribution`: text without markup."""

    media_type: str
    max_zoom: int
    attribution: str


class Tiles:
    """The tiles of a file.

    Raises:
        SettingError: the file cannot be read, is not MBTiles, or has vector data instead of images.
    """

    def __init__(self, file: Path) -> None:
        self._lock = Lock()
        try:
            self._database = sqlite3.connect(
                f"{file.resolve().as_uri()}?mode=ro", uri=True, check_same_thread=False
            )
            said = dict(self._database.execute("SELECT name, value FROM metadata"))
            deepest = self._database.execute("SELECT max(zoom_level) FROM tiles").fetchone()[0]
        except sqlite3.Error as error:
            raise SettingError(f"{TILES}={file} is not a readable MBTiles file: {error}") from error
        kind = str(said.get("format", "png")).lower()
        if kind not in MEDIA_TYPES:
            self.close()
            raise SettingError(
                f"{TILES}={file} has tiles of the format {kind!r}: the map shows images only "
                f"({', '.join(MEDIA_TYPES)})"
            )
        attribution = html.unescape(_MARKUP.sub("", str(said.get("attribution", ""))))
        self.pictured = Pictured(MEDIA_TYPES[kind], int(deepest or 0), attribution.strip())

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """Return a tile; rows count from the north. None: the file does not have it."""
        from_south = (1 << zoom) - 1 - row
        with self._lock:
            found = self._database.execute(
                "SELECT tile_data FROM tiles"
                " WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?",
                (zoom, column, from_south),
            ).fetchone()
        return None if found is None else bytes(found[0])


Zoom = Annotated[int, InPath(ge=0, le=DEEPEST)]
Step = Annotated[int, InPath(ge=0, lt=1 << DEEPEST)]


def router(tiles: Tiles | None) -> APIRouter:
    """Return the route of tiles. Without a file, all of them are missing."""
    routes = APIRouter(tags=["tiles"], responses=RESPONSES)

    @routes.get(
        "/tiles/{zoom}/{column}/{row}.png",
        response_class=Response,
        responses={
            200: {"content": {"image/*": {}}},
            204: {"description": "The file does not have this tile."},
        },
    )
    async def tile(_: Viewer, zoom: Zoom, column: Step, row: Step) -> Response:
        """An image of 256 x 256 pixels, in the web Mercator projection; rows from the north."""
        found = None
        if tiles is not None:
            found = await asyncio.to_thread(tiles.tile, zoom, column, row)
        if tiles is None or found is None:
            return Response(status_code=204)
        headers = {"cache-control": KEPT}
        return Response(found, headers=headers, media_type=tiles.pictured.media_type)

    return routes
