"""uvicorn in an event loop that is another's: it handles no signals, and ends when cancelled."""

import asyncio
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from m2pem.errors import PluginError
from m2pem_plugin_web.live.socket import ABORT, LONGEST_MESSAGE
from m2pem_plugin_web.settings import HOST, PORT, Settings

LAST_WORDS_S = 1
"""For responses that are being sent when it ends."""

BACKLOG = 128


def listen(settings: Settings) -> socket.socket:
    """A socket that listens where the settings say.

    Raises:
        PluginError: it cannot.
    """
    try:
        found = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)
        family, kind, number, _, address = found[0]
        listener = socket.socket(family, kind, number)
    except OSError as error:
        raise PluginError(f"{HOST}={settings.host}: {error.strerror}") from error
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(BACKLOG)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise PluginError(
            f"the page cannot be served at {settings.host}:{settings.port}: {error.strerror}; "
            f"{PORT}=0 takes any free port"
        ) from error
    return listener


class _WebSocket(WebSocketsSansIOProtocol):
    async def run_asgi(self) -> None:
        """Let the app end a connection that takes nothing any more."""
        self.scope[ABORT] = self.transport.abort  # type: ignore[literal-required]
        await super().run_asgi()


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the executive's."""
        yield


async def serve(app: ASGIApp, listener: socket.socket, settings: Settings) -> None:
    """Serve an app at a socket until cancelled, and close what is open then."""
    server = _Server(
        uvicorn.Config(
            app,
            lifespan="off",
            log_config=None,
            log_level="warning",
            access_log=False,
            server_header=False,
            proxy_headers=False,
            http="h11",
            ws=_WebSocket,
            ws_max_size=LONGEST_MESSAGE,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=LAST_WORDS_S,
            ssl_certfile=settings.certificate,
            ssl_keyfile=settings.key,
        )
    )
    serving = asyncio.create_task(server.serve(sockets=[listener]))
    try:
        await asyncio.shield(serving)
    except asyncio.CancelledError:
        server.should_exit = True
        with suppress(asyncio.CancelledError):
            await serving
        raise
