"""What executes, as the page can draw it."""

import asyncio

from m2pem.api import MissionControl
from m2pem.errors import MissionError


async def shown(control: MissionControl, source: bytes) -> str:
    """A file in the form that the editor takes; as it is, if it has none."""
    try:
        found = await asyncio.to_thread(control.editable, source)
    except MissionError:
        return source.decode(errors="replace")
    return found.source.decode()
