"""Compresses the answers of the REST interface with gzip (RFC 9110, 8.4.1.3)."""

import asyncio
import gzip

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

SMALLEST = 1000
"""Bytes below which compression gains nothing."""

LARGE = 50_000
"""Bytes from which a thread compresses: the loop is the executive's, and 1 MB takes some 10 ms."""

LEVEL = 4
"""Records shrink to a twelfth; the highest level takes five times as long for a fourteenth."""


class CompressedAnswers:
    """Compresses answers that come in one piece as JSON; all others pass as they are."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http" or not scope["path"].startswith("/api"):
            await self._app(scope, receive, send)
            return
        accepted = Headers(scope=scope).get("accept-encoding", "")
        start: Message | None = None

        async def compressed(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                start = message
                return
            if start is not None:
                if message["type"] == "http.response.body" and not message.get("more_body"):
                    message = await _compress(start, message, accepted)
                await send(start)
                start = None
            await send(message)

        await self._app(scope, receive, compressed)


async def _compress(start: Message, body: Message, accepted: str) -> Message:
    """Return the body to send; `start` gets the headers that belong to it."""
    headers = MutableHeaders(scope=start)
    content: bytes = body.get("body", b"")
    is_json = "json" in headers.get("content-type", "")
    if len(content) < SMALLEST or not is_json or "content-encoding" in headers:
        return body
    headers.add_vary_header("Accept-Encoding")
    if not accepts_gzip(accepted):
        return body
    if len(content) < LARGE:
        content = gzip.compress(content, LEVEL, mtime=0)
    else:
        content = await asyncio.to_thread(gzip.compress, content, LEVEL, mtime=0)
    headers["content-encoding"] = "gzip"
    headers["content-length"] = str(len(content))
    return {**body, "body": content}


def accepts_gzip(accepted: str) -> bool:
    """Whether a header Accept-Encoding allows gzip, and does not give it the weight 0."""
    for each in accepted.lower().split(","):
        name, _, weight = each.partition(";")
        if name.strip() == "gzip":
            return weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000")
    return False
