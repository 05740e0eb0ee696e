"""Bounds what is sent with a request: JSON alone, so large, within so long."""

import asyncio

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from m2pem_plugin_web.access.origins import SAFE_METHODS
from m2pem_plugin_web.problems import problem

LARGEST_BYTES = 10_000_000
LONGEST_S = 30.0


class BoundedBodies:
    """Refuses what is too large before reading it, or as soon as that is seen."""

    def __init__(
        self, app: ASGIApp, *, largest: int = LARGEST_BYTES, longest_s: float = LONGEST_S
    ) -> None:
        self._app = app
        self._largest = largest
        self._longest_s = longest_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refused = self._refused(scope["method"], headers)
        if refused is not None:
            # The rest of the body is not read: the connection is of no more use.
            status, why = refused
            await problem(status, why, {"connection": "close"})(scope, receive, send)
            return
        await self._app(scope, self._bounded(receive), send)

    def _refused(self, method: str, headers: Headers) -> tuple[int, str] | None:
        said = headers.get("content-length", "")
        if said and not (said.isascii() and said.isdigit()):
            return 400, "Content-Length is a number"
        if said and int(said) > self._largest:
            return 413, self._too_large()
        comes = said not in ("", "0") or "transfer-encoding" in headers
        if not comes or method in SAFE_METHODS:
            return None
        kind = headers.get("content-type", "").partition(";")[0].strip().lower()
        if kind != "application/json":
            return 415, "send application/json"
        return None

    def _bounded(self, receive: Receive) -> Receive:
        loop = asyncio.get_running_loop()
        until = loop.time() + self._longest_s
        taken = 0
        whole = False

        async def bounded() -> Message:
            nonlocal taken, whole
            if whole:
                return await receive()
            try:
                async with asyncio.timeout_at(until):
                    message = await receive()
            except TimeoutError:
                raise HTTPException(
                    408, f"the body did not come within {self._longest_s:g} s"
                ) from None
            taken += len(message.get("body", b""))
            if taken > self._largest:
                raise HTTPException(413, self._too_large(), {"connection": "close"})
            whole = not message.get("more_body", False)
            return message

        return bounded

    def _too_large(self) -> str:
        return f"{self._largest / 1_000_000:g} MB are the most that may be sent"
