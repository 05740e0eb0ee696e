"""Looks at every request before anything else does: its Host, its origin, and who asks."""

from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from m2pem_plugin_web.access.entry import Entry
from m2pem_plugin_web.access.people import SCOPE_KEY
from m2pem_plugin_web.problems import problem


class Guard:
    """Refuses who has not signed in everything below /api, but to sign in."""

    def __init__(self, app: ASGIApp, entry: Entry) -> None:
        self._app = app
        self._entry = entry

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] in ("http", "websocket"):
            person = self._entry.person(_cookies(Headers(scope=scope)))
            scope[SCOPE_KEY] = person
            signs_in = scope["path"] == "/api/session" and scope.get("method") == "POST"
            if scope["path"].startswith("/api") and person is None and not signs_in:
                await problem(401, "sign in first")(scope, receive, send)
                return
        await self._app(scope, receive, send)


def _cookies(headers: Headers) -> dict[str, str]:
    cookies: SimpleCookie = SimpleCookie()
    try:
        cookies.load("; ".join(headers.getlist("cookie")))
    except CookieError:
        return {}
    return {name: morsel.value for name, morsel in cookies.items()}
