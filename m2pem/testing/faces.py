"""Serving a face in the tests of a plugin."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

from m2pem.api.control import MissionControl
from m2pem.api.face import Face, FaceSettings


@asynccontextmanager
async def serve_face(
    factory: Callable[[MissionControl, FaceSettings], Face],
    control: MissionControl,
    settings: Mapping[str, Any],
    name: str = "face",
) -> AsyncIterator[Face]:
    """Make a face and let it serve; at the end it is cancelled.

    `settings`: what a fleet file says at `faces: {NAME: ...}`.

    Raises:
        PluginError: a setting is wrong, or what the face needs cannot be opened.
        AssertionError: it ended by itself.
    """
    face = factory(control, FaceSettings(name, settings))
    serving = asyncio.create_task(face.serve())
    try:
        yield face
    finally:
        ended = serving.done()
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving
        assert not ended, "the face ended by itself"
