"""Waiting for what another thread or task does."""

import asyncio
from collections.abc import Callable


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(30):
        while not condition():  # noqa: ASYNC110  # another thread changes it
            await asyncio.sleep(0.01)
