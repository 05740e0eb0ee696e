"""MAVLink over connections that may break and are made again: TCP and serial lines."""

import asyncio
import socket
from abc import abstractmethod
from collections.abc import Callable
from typing import Any

from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.endpoint import Endpoint, logger
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.link.udp import why_not
from m2pem_plugin_mavlink.protocol.url import SerialUrl, SocketUrl

FIRST_PAUSE_S = 0.25
LONGEST_PAUSE_S = 5.0
CONNECTING_S = 10.0
MOST_UNSENT_BYTES = 64 * 1024
"""Most unsent bytes of a peer; further frames are dropped, as by a radio."""

MOST_CONNECTIONS = 512

UNACKNOWLEDGED_MS = 10_000
"""Seconds after which a connection breaks whose other end does not acknowledge the heartbeats."""


class Connection(asyncio.Protocol):
    """One connection of an endpoint; it is a peer while it lasts."""

    def __init__(self, endpoint: Endpoint, name: str = "") -> None:
        self._endpoint = endpoint
        self._name = name
        loop = asyncio.get_running_loop()
        self.made: asyncio.Future[None] = loop.create_future()
        self.lost: asyncio.Future[None] = loop.create_future()

    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        if len(self._endpoint.peers) >= MOST_CONNECTIONS:
            transport.abort()
            return
        connected = transport.get_extra_info("socket")
        if connected is not None and hasattr(socket, "TCP_USER_TIMEOUT"):
            option = (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNACKNOWLEDGED_MS)
            connected.setsockopt(*option)
        address = transport.get_extra_info("peername")
        name = self._name or f"{address[0]}:{address[1]}"
        endpoint = self._endpoint
        now_s = endpoint.now_s()
        self.peer = Peer(name, self._write, endpoint.admit, now_s, endpoint.check_of)
        endpoint.peers[self] = self.peer
        endpoint.greet(self.peer, endpoint.signings_of_unknown(self.peer))
        self.made.set_result(None)

    def data_received(self, data: bytes) -> None:
        self.peer.received_s = now_s = self._endpoint.now_s()
        self.peer.inbound.stream(data, now_s)
        for tap in self._endpoint.taps:
            tap(self._endpoint, self.peer, data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._endpoint.drop(self)
        self.lost.set_result(None)

    def abort(self) -> None:
        """Close the connection at once."""
        self._transport.abort()

    def _write(self, data: bytes) -> None:
        if self._transport.get_write_buffer_size() < MOST_UNSENT_BYTES:
            self._transport.write(data)
        else:
            self.peer.unsent += 1


class ConnectingEndpoint(Endpoint):
    """Connects, and reconnects with growing pauses."""

    async def open(self) -> None:
        self._keeping = asyncio.create_task(self._keep())

    async def close(self) -> None:
        self._keeping.cancel()
        await asyncio.wait([self._keeping])

    @abstractmethod
    async def connect(self, make: Callable[[], Connection]) -> Connection:
        """Connect once.

        Raises:
            OSError: not now.
        """

    async def _keep(self) -> None:
        pause_s = FIRST_PAUSE_S
        silenced = False
        while True:
            try:
                async with asyncio.timeout(CONNECTING_S):
                    connection = await self.connect(lambda: Connection(self, str(self.url)))
            except OSError as error:  # a timeout is one, too
                reason = error.strerror or str(error) or "no answer"
            else:
                logger.info("%s: connected", self.url)
                try:
                    await asyncio.shield(connection.lost)
                finally:
                    connection.abort()
                    await connection.lost
                reason = "the connection broke"
                if connection.peer.inbound.senders:
                    pause_s, silenced = FIRST_PAUSE_S, False
            if not silenced:
                logger.warning("%s: %s; reconnecting", self.url, reason)
            silenced = True
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)


class TcpOutEndpoint(ConnectingEndpoint):
    """The endpoint of `tcpout` URLs."""

    url: SocketUrl

    async def connect(self, make: Callable[[], Connection]) -> Connection:
        loop = asyncio.get_running_loop()
        _, connection = await loop.create_connection(make, self.url.host, self.url.port)
        return connection


class SerialEndpoint(ConnectingEndpoint):
    """The endpoint of `serial` URLs."""

    url: SerialUrl

    async def open(self) -> None:
        try:
            import serial_asyncio_fast  # noqa: PLC0415  # few have a serial line
        except ImportError:
            raise PluginError(
                f"{self.url}: serial lines need pyserial-asyncio-fast: "
                "pip install 'm2pem-plugin-mavlink[serial]'"
            ) from None
        self._connect = serial_asyncio_fast.create_serial_connection
        await super().open()

    async def connect(self, make: Callable[[], Connection]) -> Connection:
        loop, url = asyncio.get_running_loop(), self.url
        try:
            transport, connection = await self._connect(
                loop, make, url.path, baudrate=url.baudrate, exclusive=True
            )
        except OSError:
            raise
        except Exception as error:  # pyserial lets some of termios through
            raise OSError(str(error)) from error
        assert isinstance(connection, Connection)
        try:
            await connection.made
        except BaseException:
            transport.abort()
            raise
        return connection


class TcpInEndpoint(Endpoint):
    """The endpoint of `tcpin` URLs; it accepts up to `MOST_CONNECTIONS`."""

    url: SocketUrl
    _server: asyncio.Server

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(
                lambda: Connection(self), self.url.host, self.url.port
            )
        except OSError as error:
            raise PluginError(f"{self.url}: {why_not(error)}") from None

    async def close(self) -> None:
        self._server.close()
        connections = [key for key in self.peers if isinstance(key, Connection)]
        for connection in connections:
            connection.abort()
        for connection in connections:
            await connection.lost

    @property
    def port(self) -> int:
        """The local port."""
        port: int = self._server.sockets[0].getsockname()[1]
        return port
