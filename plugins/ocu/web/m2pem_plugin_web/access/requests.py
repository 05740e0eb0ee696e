"""Checks of every request before its route: host and origin, age, size, session; and safe headers.

The order: `SafeHeaders` outside, then `Guard`, then `BoundedBodies`, then `CompressedAnswers`.
"""

import asyncio
import math
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from types import MappingProxyType

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from m2pem_plugin_web.problems import ProblemError, problem

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN_SITES = frozenset({"same-origin", "none"})
"""Of Sec-Fetch-Site; `none`: the user has typed the address."""


def name_of(host: str) -> str:
    """Return the name in a Host header, without the port and without the brackets of IPv6."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower()


def wrong_host(headers: Headers, names: Collection[str]) -> str:
    """Return why the Host header is refused; "" if it is accepted."""
    hosts = headers.getlist("host")
    if len(hosts) != 1:
        return "a request has one Host header"
    if name_of(hosts[0]) not in names:
        return f"this server does not have the name {name_of(hosts[0])[:100]!r}"
    return ""


def foreign(headers: Headers, scheme: str, *, strict: bool) -> str:
    """Return why a request may come from another site; "" if it does not.

    `strict`: the request changes something or opens a WebSocket, so a browser sends its origin.
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
"""The header with the time of a command, in seconds of the executive's clock."""

LATEST_S = 5.0
"""Age in seconds beyond which a command is refused, and a STOP is reported as late."""

AHEAD_S = 1.0
"""A command that is further in the future has the clock of another start of the machine."""


def now_s() -> float:
    """Return the monotonic time of the executive's clock in seconds."""
    return time.monotonic()


def age_s(connection: HTTPConnection) -> float:
    """Return the seconds since a command was given; 0 if the request has no time.

    Raises:
        ProblemError: 400, the header is not a number; 409, its time is from another clock.
    """
    said = connection.headers.get(GIVEN)
    if said is None:
        return 0.0
    try:
        given_s = float(said)
    except ValueError:
        given_s = math.nan
    if not math.isfinite(given_s):
        raise ProblemError(400, f"{GIVEN} must be a number of seconds")
    age = now_s() - given_s
    if age < -AHEAD_S:
        raise ProblemError(
            409, f"{GIVEN} is {-age:.0f} s ahead of this executive's clock: connect again"
        )
    return max(0.0, age)


def refuse_late(connection: HTTPConnection) -> None:
    """Refuse a command that was not given just now.

    Raises:
        ProblemError: 409, it arrived too late, with its age; or as `age_s`.
    """
    age = age_s(connection)
    if age > LATEST_S:
        raise ProblemError(
            409,
            f"this was given {age:.1f} s before it arrived, and is refused after {LATEST_S:g} s: "
            "check the present state, and give it again",
            age_s=round(age, 1),
            limit_s=LATEST_S,
        )


FILES = frozenset({"/api/geometry-files/read"})
"""Routes that take the bytes of a file; all others take JSON alone."""

LARGEST_BYTES = 10_000_000
BODY_WITHIN_S = 30.0


class BoundedBodies:
    """Refuses bodies that are too large: by their header, or while reading them."""

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
        refused = self._refused(scope["method"], scope["path"], headers)
        if refused is not None:
            # The rest of the body stays unread, so the connection cannot be used again.
            status, why = refused
            await problem(status, why, {"connection": "close"})(scope, receive, send)
            return
        await self._app(scope, self._bounded(receive), send)

    def _refused(self, method: str, path: str, headers: Headers) -> tuple[int, str] | None:
        said = headers.get("content-length", "")
        if said and not (said.isascii() and said.isdigit()):
            return 400, "Content-Length must be a number"
        if said and int(said) > self._largest:
            return 413, self._too_large()
        comes = said not in ("", "0") or "transfer-encoding" in headers
        if not comes or method in SAFE_METHODS:
            return None
        kind = headers.get("content-type", "").partition(";")[0].strip().lower()
        right = "application/octet-stream" if path in FILES else "application/json"
        if kind not in ("application/json", right):
            return 415, f"send {right}"
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
                    408, f"the body was not received within {self._longest_s:g} s"
                ) from None
            taken += len(message.get("body", b""))
            if taken > self._largest:
                raise HTTPException(413, self._too_large(), {"connection": "close"})
            whole = not message.get("more_body", False)
            return message

        return bounded

    def _too_large(self) -> str:
        return f"the body is larger than {self._largest / 1_000_000:g} MB"


# Styles: bpmn-js sets some on elements. `self` covers a WebSocket of the same origin. `others` are
# the pages of executives that stand by; `videos` are the cameras' origins, by directive. hls.js
# hands a video to the browser as a blob.
POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:{videos[img-src]}",
        "media-src 'self' blob:{videos[media-src]}",
        "font-src 'self' data:",
        "connect-src 'self'{others}{videos[connect-src]}",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)

# A stricter Referrer-Policy would take the origin from requests of forms.
HEADERS = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}


class SafeHeaders:
    """Adds security headers to every response; responses of /api are not cached. `others`: other
    pages, which a page from here may ask whether they serve; `videos`: what cameras add to
    directives of the policy."""

    def __init__(
        self,
        app: ASGIApp,
        others: Callable[[], Iterable[str]] = tuple,
        videos: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._app = app
        self._others = others
        self._videos = defaultdict(str, videos)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(HEADERS)
                others = "".join(f" {page}" for page in self._others())
                headers["content-security-policy"] = POLICY.format(
                    others=others, videos=self._videos
                )
                if scope["path"].startswith("/api"):
                    headers["cache-control"] = "no-store"
            await send(message)

        await self._app(scope, receive, with_headers)
