"""Sends and receives events: UDP (unicast or multicast), TCP or TLS.

A receiver that is slow or gone loses events, which are counted; nothing waits for it.
"""

import asyncio
import ipaddress
import logging
import socket
import struct
from collections.abc import Callable
from typing import cast

from m2pem.errors import PluginError
from m2pem_plugin_cot.received import MAX_EVENT_BYTES, EventStream
from m2pem_plugin_cot.settings import Address, Settings

log = logging.getLogger("m2pem.cot")

Receive = Callable[[bytes, str], None]
"""Gets the bytes of an event, and where it came from."""

MAX_WAITING_BYTES = 262_144
CONNECT_WITHIN_S = 10.0
AGAIN_S = 1.0
LONGEST_AGAIN_S = 30.0


class Link:
    """`dropped`: events that were not sent. `connected`: is called at each connection."""

    def __init__(self, settings: Settings, receive: Receive, connected: Callable[[], None]) -> None:
        self.dropped = 0
        self._connected = connected
        self._settings = settings
        self._receive = receive
        self._transport: asyncio.Transport | None = None

    def send(self, event: bytes) -> None:
        """Send an event, or drop it."""
        transport = self._transport
        if transport is None or transport.get_write_buffer_size() > MAX_WAITING_BYTES:
            self.dropped += 1
        elif self._settings.url.scheme == "udp":
            cast("asyncio.DatagramTransport", transport).sendto(event)
        else:
            transport.write(event + b"\n")

    async def run(self) -> None:
        """Send and receive until cancelled.

        Raises:
            PluginError: an address of this host cannot be used.
        """
        if self._settings.url.scheme == "udp":
            await self._run_udp()
        else:
            await self._run_stream()

    async def _run_udp(self) -> None:
        loop = asyncio.get_running_loop()
        out, listen = self._settings.url, self._settings.listen
        opened: list[asyncio.BaseTransport] = []
        try:
            sending = await asyncio.to_thread(_sending_socket, out, self._settings.interface)
            transport, _ = await loop.create_datagram_endpoint(_Errors, sock=sending)
            opened.append(transport)
            # A datagram transport of asyncio has a buffer, too, whatever its declared type.
            self._transport = cast("asyncio.Transport", transport)
            self._connected()
            if listen is not None:
                receiving = _receiving_socket(listen, self._settings.interface)
                listening, _ = await loop.create_datagram_endpoint(
                    lambda: _Datagrams(self._receive), sock=receiving
                )
                opened.append(listening)
            await loop.create_future()
        except OSError as error:
            raise PluginError(f"{out}{f', {listen}' if listen else ''}: {error}") from error
        finally:
            self._transport = None
            for each in opened:
                each.close()

    async def _run_stream(self) -> None:
        """Connect, and connect again when the connection ends."""
        address, again_s = self._settings.url, AGAIN_S
        while True:
            lost: asyncio.Future[str] = asyncio.get_running_loop().create_future()
            try:
                async with asyncio.timeout(CONNECT_WITHIN_S):
                    transport, _ = await asyncio.get_running_loop().create_connection(
                        lambda lost=lost: _Stream(self._receive, str(address), lost),
                        address.host,
                        address.port,
                        ssl=self._settings.tls,
                    )
            except (OSError, TimeoutError) as error:
                log.warning("%s: %s; tried again in %.0f s", address, error, again_s)
                await asyncio.sleep(again_s)
                again_s = min(2 * again_s, LONGEST_AGAIN_S)
                continue
            log.info("%s: connected", address)
            self._transport, again_s = transport, AGAIN_S
            self._connected()
            try:
                why = await lost
            finally:
                self._transport = None
                transport.abort()
            log.warning("%s: %s; connected again in %.0f s", address, why, again_s)
            await asyncio.sleep(again_s)


class _Errors(asyncio.DatagramProtocol):
    """Sends alone: that no program listens there yet is no error."""


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, receive: Receive) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        if len(data) <= MAX_EVENT_BYTES:
            self._receive(data, f"{addr[0]}:{addr[1]}")


class _Stream(asyncio.Protocol):
    def __init__(self, receive: Receive, peer: str, lost: "asyncio.Future[str]") -> None:
        self._receive = receive
        self._peer = peer
        self._lost = lost
        self._events = EventStream()

    def data_received(self, data: bytes) -> None:
        for event in self._events.feed(data):
            self._receive(event, self._peer)

    def connection_lost(self, exc: Exception | None) -> None:
        if not self._lost.done():
            self._lost.set_result(str(exc or "the connection was closed"))


def _sending_socket(to: Address, interface: str) -> socket.socket:
    family, kind, _, _, where = socket.getaddrinfo(to.host, to.port, type=socket.SOCK_DGRAM)[0]
    made = socket.socket(family, kind)
    try:
        made.setblocking(False)
        if _is_multicast(to.host):
            made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
            made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
        made.connect(where)
    except BaseException:
        made.close()
        raise
    return made


def _receiving_socket(at: Address, interface: str) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        made.setblocking(False)
        if _is_multicast(at.host):
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            group = struct.pack("4s4s", socket.inet_aton(at.host), socket.inet_aton(interface))
            made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
        made.bind((at.host, at.port))
    except BaseException:
        made.close()
        raise
    return made


def _is_multicast(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_multicast
    except ValueError:
        return False
