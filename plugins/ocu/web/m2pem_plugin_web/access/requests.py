"""Checks of every request before its route: host and origin, age, size, session; and safe headers.

The order: `SafeHeaders` outside, then `Guard`, then `BoundedBodies`.
"""

import asyncio
import math
import time
from collections.abc import Collection

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from m2pem_plugin_web.problems import ProblemError, problem

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN_SITES = frozenset({"same-origin", "none"})
"""Of Sec-Fetch-Site; `none`: the user has typed the address."""


def name_of(host: str) -> str:
    """The name in a Host header: without the port, and without the brackets of IPv6."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower()


def wrong_host(headers: Headers, names: Collection[str]) -> str:
    """Why the Host header is refused; "": it is not."""
    hosts = headers.getlist("host")
    if len(hosts) != 1:
        return "a request has one Host header"
    if name_of(hosts[0]) not in names:
        return f"this page is not called {name_of(hosts[0])[:100]!r} here"
    return ""


def foreign(headers: Headers, scheme: str, *, strict: bool) -> str:
    """Why a request may come from a foreign page; "": it does not.

    `strict`: it changes something or opens a WebSocket, so that a browser says its origin.
    """
    site = headers.get("sec-fetch-site")
    if site is not None and site not in OWN_SITES:
        return "the request comes from another site"
    origins = headers.getlist("origin")
    own = f"{scheme}://{headers.get('host', '')}".lower()
    if not origins:
        return f"the request needs the header Origin: {own}" if strict else ""
    if [each.lower() for each in origins] != [own]:
        return "the request comes from another page"
    return ""


GIVEN = "M2pem-Given"
"""The header: seconds of the executive's clock."""

LATEST_S = 5.0
"""Age beyond which a command is refused, and a STOP is said to be late."""

AHEAD_S = 1.0
"""A command cannot be from the future: then its clock is that of another start of the machine."""


def now_s() -> float:
    """The executive's clock: seconds, which only rise."""
    return time.monotonic()


def age_s(connection: HTTPConnection) -> float:
    """Seconds since a command was given; 0 if the request does not say when.

    Raises:
        ProblemError: 400, the header is no number; 409, it is from another clock.
    """
    said = connection.headers.get(GIVEN)
    if said is None:
        return 0.0
    try:
        given_s = float(said)
    except ValueError:
        given_s = math.nan
    if not math.isfinite(given_s):
        raise ProblemError(400, f"{GIVEN} is a number of seconds")
    age = now_s() - given_s
    if age < -AHEAD_S:
        raise ProblemError(
            409, f"{GIVEN} is {-age:.0f} s ahead of this executive's clock: connect again"
        )
    return max(0.0, age)


def refuse_late(connection: HTTPConnection) -> None:
    """Let a command pass that was given just now.

    Raises:
        ProblemError: 409, it arrived too late, with its age; or as `age_s`.
    """
    age = age_s(connection)
    if age > LATEST_S:
        raise ProblemError(
            409,
            f"this was given {age:.1f} s before it arrived, and is refused after {LATEST_S:g} s: "
            "look at what is so now, and give it again",
            age_s=round(age, 1),
            limit_s=LATEST_S,
        )


LARGEST_BYTES = 10_000_000
BODY_WITHIN_S = 30.0


class BoundedBodies:
    """Refuses what is too large before reading it, or as soon as that is seen."""

    def __init__(
        self, app: ASGIApp, *, largest: int = LARGEST_BYTES, longest_s: float = BODY_WITHIN_S
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


# Styles: bpmn-js sets some on elements. `self` covers a WebSocket of the same origin.
POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "connect-src 'self'",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)

# A stricter Referrer-Policy would take the origin from requests of forms.
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}


class SafeHeaders:
    """Puts safe headers on every response; responses of /api are not cached."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(HEADERS)
                if scope["path"].startswith("/api"):
                    headers["cache-control"] = "no-store"
            await send(message)

        await self._app(scope, receive, with_headers)
