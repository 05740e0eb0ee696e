"""/tiles: the images below the map, from a file of this machine."""

import asyncio
from typing import Annotated

from fastapi import APIRouter
from fastapi import Path as InPath
from fastapi.responses import Response

from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.tile_files import Tiles

DEEPEST = 24
"""Zoom levels that the page may request."""

KEPT = "private, max-age=3600"

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
