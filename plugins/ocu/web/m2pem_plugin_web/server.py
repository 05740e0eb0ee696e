"""Runs uvicorn in the executive's event loop: without its signal handlers, until cancelled.

Connections are bounded, so that other clients cannot lock out signed-in users.
"""

import asyncio
import socket
import ssl
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from m2pem.errors import PluginError
from m2pem_plugin_web.live.socket import LONGEST_MESSAGE
from m2pem_plugin_web.live.wire import WIRE, frame_of_text
from m2pem_plugin_web.settings import HOST, PORT, Settings

MOST_STRANGERS = 128
MOST_OF_AN_ADDRESS = 32
"""Connections without a signed-in user: of all addresses, and of one."""

MOST_KNOWN = 256
"""Connections of signed-in users; beyond that, only STOP is accepted."""

Peer = tuple[str, int]


@dataclass(slots=True)
class _Connection:
    abort: Callable[[], None]
    known: bool = False


class Slots:
    """Open connections by their peers (address and port), the oldest first.

    A new connection always has a slot: the oldest one without a signed-in user is closed, first
    of those from the same address. That is most likely an incomplete request.
    """

    def __init__(self) -> None:
        self._open: dict[Peer, _Connection] = {}

    def opened(self, peer: Peer, abort: Callable[[], None]) -> None:
        """Add a connection; `abort` ends it."""
        strangers = [each for each, slot in self._open.items() if not slot.known]
        own = [each for each in strangers if each[0] == peer[0]]
        if len(own) >= MOST_OF_AN_ADDRESS:
            self._drop(own[0])
        elif len(strangers) >= MOST_STRANGERS:
            self._drop(strangers[0])
        self._open[peer] = _Connection(abort)

    def closed(self, peer: Peer) -> None:
        """Remove a connection that has ended, or that has become a WebSocket."""
        self._open.pop(peer, None)

    def known(self, peer: Peer) -> None:
        """Note that the user has signed in: the connection stays."""
        if (slot := self._open.get(peer)) is not None:
            slot.known = True

    @property
    def full(self) -> bool:
        """Whether signed-in users have too many connections."""
        return sum(slot.known for slot in self._open.values()) > MOST_KNOWN

    def _drop(self, peer: Peer) -> None:
        self._open.pop(peer).abort()


LAST_WORDS_S = 1
"""Seconds for responses that are being sent when the server ends."""

BACKLOG = 128
HEADERS_S = 10.0
"""Seconds for the head of a request, from the connection or from its first byte."""


def listen(settings: Settings) -> socket.socket:
    """Return a socket that listens at the address of the settings.

    Raises:
        PluginError: the address cannot be used.
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
    """Closes connections that send no complete head of a request in time."""

    slots: Slots
    _timeout: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self.client is not None:
            self.slots.opened(self.client, transport.abort)
        self._timeout = self.loop.call_later(HEADERS_S, transport.abort)

    def data_received(self, data: bytes) -> None:
        before = self.scope
        super().data_received(data)
        if self.scope is not before:
            self._cancel_timeout()
        elif self._timeout is None and (self.cycle is None or self.cycle.response_complete):
            self._timeout = self.loop.call_later(HEADERS_S, self.transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._cancel_timeout()
        self._leave()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._leave()
        super().handle_websocket_upgrade(event)

    def _leave(self) -> None:
        if self.client is not None:
            self.slots.closed(self.client)

    def _cancel_timeout(self) -> None:
        if self._timeout is not None:
            self._timeout.cancel()
            self._timeout = None


class _WebSocket(WebSocketsSansIOProtocol):
    """Is the `Wire` of the app: what comes is passed on at once, what goes is written at once."""

    _received: Callable[[bytes], None] | None = None
    _drained: Callable[[], None] | None = None

    async def run_asgi(self) -> None:
        self.scope[WIRE] = self  # type: ignore[literal-required]
        await super().run_asgi()

    def listen(self, received: Callable[[bytes], None], drained: Callable[[], None]) -> None:
        self._received = received
        self._drained = drained

    @property
    def is_writable(self) -> bool:
        return self.writable.is_set()

    def write_text(self, head: bytes, rest: bytes) -> None:
        if not (self.close_sent or self.disconnected or self.transport.is_closing()):
            self.transport.write(frame_of_text(head, rest))

    def abort(self) -> None:
        self.transport.abort()

    def send_receive_event_to_app(self) -> None:
        # What came before the app listens, and has not been fetched, goes before.
        if self._received is None or self.close_sent or not self.queue.empty():
            super().send_receive_event_to_app()
            return
        data, self.frames = b"".join(self.frames), []
        self._received(data)

    def resume_writing(self) -> None:
        super().resume_writing()
        if self._drained is not None:
            self._drained()


class _Uvicorn(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the executive."""
        yield


class Server:
    """Listens as soon as it is created.

    Raises:
        PluginError: the address, or the certificate with its key, cannot be used.
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
        """Close the socket."""
        self._listener.close()

    async def serve(self, app: ASGIApp) -> None:
        """Serve an app until cancelled, then close all connections."""
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
            f"{certificate} and {key} are not a certificate with its key: {error}"
        ) from error
