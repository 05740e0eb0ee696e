"""uvicorn in an event loop that is another's: it handles no signals, and ends when cancelled."""

import asyncio
import socket
import ssl
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from m2pem.errors import PluginError
from m2pem_plugin_web.access.slots import Slots
from m2pem_plugin_web.live.socket import ABORT, LONGEST_MESSAGE
from m2pem_plugin_web.settings import HOST, PORT, Settings

LAST_WORDS_S = 1
"""For responses that are being sent when it ends."""

BACKLOG = 128
HEADERS_S = 10.0
"""Within which the head of a request comes, once a connection is there or its head has begun."""


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


class _Http(H11Protocol):
    """Lets go of connections on which the head of a request does not come."""

    slots: Slots
    _patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self.client is not None:
            self.slots.opened(self.client, transport.abort)
        self._patience = self.loop.call_later(HEADERS_S, transport.abort)

    def data_received(self, data: bytes) -> None:
        before = self.scope
        super().data_received(data)
        if self.scope is not before:
            self._be_patient()
        elif self._patience is None and (self.cycle is None or self.cycle.response_complete):
            self._patience = self.loop.call_later(HEADERS_S, self.transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._be_patient()
        self._leave()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._leave()
        super().handle_websocket_upgrade(event)

    def _leave(self) -> None:
        if self.client is not None:
            self.slots.closed(self.client)

    def _be_patient(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None


class _WebSocket(WebSocketsSansIOProtocol):
    async def run_asgi(self) -> None:
        """Let the app end a connection that takes nothing any more."""
        self.scope[ABORT] = self.transport.abort  # type: ignore[literal-required]
        await super().run_asgi()


class _Uvicorn(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Signals are the executive's."""
        yield


class Server:
    """Listens from the moment it is made.

    Raises:
        PluginError: the address cannot be had, or the certificate and its key cannot be used.
    """

    def __init__(self, settings: Settings) -> None:
        self._more: dict[str, Any] = {}
        if settings.certificate is not None and settings.key is not None:
            _refuse_bad_certificate(settings.certificate, settings.key)
            self._more = {"ssl_certfile": settings.certificate, "ssl_keyfile": settings.key}
        self._listener = listen(settings)
        self.slots = Slots()
        self.port: int = self._listener.getsockname()[1]

    def close(self) -> None:
        """Listen no more."""
        self._listener.close()

    async def serve(self, app: ASGIApp) -> None:
        """Serve an app until cancelled, and close what is open then."""
        server = _Uvicorn(
            uvicorn.Config(
                app,
                lifespan="off",
                log_config=None,
                log_level="warning",
                access_log=False,
                server_header=False,
                proxy_headers=False,
                http=type("_Http", (_Http,), {"slots": self.slots}),
                ws=_WebSocket,
                ws_max_size=LONGEST_MESSAGE,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=LAST_WORDS_S,
                **self._more,
            )
        )
        serving = asyncio.create_task(server.serve(sockets=[self._listener]))
        try:
            await asyncio.shield(serving)
        except asyncio.CancelledError:
            server.should_exit = True
            with suppress(asyncio.CancelledError):
                await serving
            raise


def _refuse_bad_certificate(certificate: Path, key: Path) -> None:
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (OSError, ValueError) as error:
        raise PluginError(
            f"{certificate} and {key} are no certificate with its key: {error}"
        ) from error
