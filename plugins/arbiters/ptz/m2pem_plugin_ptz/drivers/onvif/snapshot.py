"""A picture over HTTP: as the camera asks for the password, bounded in size and time."""

import asyncio
import base64
from typing import Any

from m2pem_plugin_ptz.drivers.onvif.session import Session
from m2pem_plugin_ptz.drivers.onvif.troubles import RefusedError, camera, translated, unauthorized

LARGEST = 32 * 1024 * 1024
"""Bytes."""

PATIENCE = 4.0
"""So many times as long as a call: a picture is more to carry."""

CHUNK = 64 * 1024
KINDS = {b"\xff\xd8\xff": ".jpg", b"\x89PNG": ".png"}
"""How a picture begins. What a camera says of its type is wrong too often."""


async def fetch_snapshot(session: Session, url: str) -> tuple[bytes, str]:
    """The picture, and the suffix for its file.

    Raises:
        CameraError: there is none; the text says why.
    """
    import aiohttp  # noqa: PLC0415  # comes with the library

    settings = session.settings
    try:
        async with asyncio.timeout(settings.timeout_s * PATIENCE):
            async with aiohttp.ClientSession() as client:
                content = await _ask(client, session, url)
    except Exception as error:
        raise translated(error, "a picture", settings, session.user) from error
    suffix = next((kind for start, kind in KINDS.items() if content.startswith(start)), None)
    if suffix is None:
        raise RefusedError(f"{camera(settings)} gives {len(content)} bytes that are no picture")
    return content, suffix


async def _ask(client: Any, session: Session, url: str) -> bytes:
    """The password goes out as a digest, and in the clear only if the camera takes nothing else."""
    import aiohttp  # noqa: PLC0415

    account = session.credentials
    digest = (
        () if account is None else (aiohttp.DigestAuthMiddleware(account.user, account.password),)
    )
    async with client.get(url, middlewares=digest, allow_redirects=False) as answer:
        asked = answer.headers.get("WWW-Authenticate", "").lower()
        if answer.status != 401 or account is None or not asked.startswith("basic"):
            return await _read(answer, session)
    basic = base64.b64encode(f"{account.user}:{account.password}".encode()).decode()
    headers = {"Authorization": f"Basic {basic}"}
    async with client.get(url, headers=headers, allow_redirects=False) as answer:
        return await _read(answer, session)


async def _read(answer: Any, session: Session) -> bytes:
    settings = session.settings
    if answer.status in (401, 403):
        raise unauthorized(settings, session.user)
    if answer.status != 200:
        raise RefusedError(f"{camera(settings)} refuses a picture: HTTP status {answer.status}")
    content = bytearray()
    async for chunk in answer.content.iter_chunked(CHUNK):
        content += chunk
        if len(content) > LARGEST:
            raise RefusedError(f"{camera(settings)} gives a picture of more than {LARGEST} bytes")
    return bytes(content)
