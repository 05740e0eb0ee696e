"""Checks every request before its route: its origin, and the user of its session."""

from collections.abc import Collection
from typing import Any

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from m2pem_plugin_web.access.permissions import SCOPE_KEY
from m2pem_plugin_web.access.requests import SAFE_METHODS, foreign, wrong_host
from m2pem_plugin_web.access.sign_in import KEY_HEADER, Entry, key_of
from m2pem_plugin_web.probes import LIVE, READY
from m2pem_plugin_web.problems import problem
from m2pem_plugin_web.server import Slots

API = "/api"
SIGN_IN = "/api/session"
TILES = "/tiles/"
"""Map tiles: a browser sends no headers of the page with a request for an image."""

STOPS = ("/stop", "/stop-all")
NO_KEY = (
    f"the cookie of the session is valid, but its key ({KEY_HEADER}) is missing or wrong: "
    "sign in again"
)


class Guard:
    """Refuses requests below /api without a session, except signing in. `names`: of this server.

    The cookie alone does not suffice: browsers also send it to other servers on this host, which
    could send it here.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        entry: Entry,
        names: Collection[str],
        scheme: str,
        slots: Slots,
    ) -> None:
        self._app = app
        self._entry = entry
        self._names = names
        self._scheme = scheme
        self._slots = slots

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self._refused(scope)
        if refused is not None:
            status, why, more = refused
            await problem(status, why, **more)(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _refused(self, scope: Scope) -> tuple[int, str, dict[str, Any]] | None:
        connection = HTTPConnection(scope)
        headers, cookies = connection.headers, connection.cookies
        if why := wrong_host(headers, self._names):
            return 400, why, {}
        method = scope.get("method", "")
        changes = scope["type"] == "websocket" or method not in SAFE_METHODS
        of_api = scope["path"] == API or scope["path"].startswith(f"{API}/")
        if (changes or of_api) and (why := foreign(headers, self._scheme, strict=changes)):
            return 403, why, {}
        person = scope[SCOPE_KEY] = self._entry.person(cookies, key_of(connection))
        if of_api and person is None and not (scope["path"] == SIGN_IN and method == "POST"):
            if self._entry.person_of_cookie(cookies) is None:
                return 401, "sign in first", {}
            return 401, NO_KEY, {"missing": KEY_HEADER}
        if person is not None and scope["client"] is not None:
            self._slots.known(tuple(scope["client"]))
        if person is None and scope["path"].startswith(TILES):
            scope[SCOPE_KEY] = self._entry.person_of_cookie(cookies)
        if self._slots.full and not scope["path"].endswith((*STOPS, LIVE, READY)):
            return 503, "too many connections are open: close other pages", {}
        return None
