"""MAVLink over UDP.

The datagram transport of asyncio reads one datagram in each iteration of the loop; this module
reads all that wait, so that bursts of many vehicles do not overflow the socket's buffer.
"""

import asyncio
import errno
import socket
from typing import Any

from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.endpoint import Endpoint, logger
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.protocol.url import SocketUrl, Way

RECEIVE_BUFFER_BYTES = 8 * 2**20
"""Requested size of the receive buffer; the kernel grants at most net.core.rmem_max."""

LARGEST_DATAGRAM = 65_535
AT_ONCE = 256
"""Datagrams that are read before other tasks run: about a millisecond."""

MAX_PEERS = 1_024
MAX_UNKNOWN_PEERS = 16
FORGOTTEN_S = 60.0


class UdpEndpoint(Endpoint):
    """The endpoint of `udpin` and `udpout` URLs: the latter has one peer from the beginning, and no
    other."""

    url: SocketUrl
    _socket: socket.socket

    async def open(self) -> None:
        """See `Endpoint.open`."""
        self._unknown: dict[Any, Peer] = {}
        self._socket = await _opened(self.url)
        asyncio.get_running_loop().add_reader(self._socket, self._readable)
        if self.url.way is Way.UDP_OUT:
            address = self._socket.getpeername()
            self.peers[address] = peer = self._peer(address, self.now_s())
            self.greet(peer, self.signings_of_unknown(peer))

    async def close(self) -> None:
        """See `Endpoint.close`."""
        asyncio.get_running_loop().remove_reader(self._socket)
        self._socket.close()
        for key in list(self.peers):
            self.drop(key)

    @property
    def port(self) -> int:
        """The local port."""
        port: int = self._socket.getsockname()[1]
        return port

    def maintain(self) -> None:
        """See `Endpoint.maintain`."""
        super().maintain()
        if self.url.way is Way.UDP_IN:
            for key in list(self.idle_peers(self.now_s() - FORGOTTEN_S)):
                self.drop(key)

    def _readable(self) -> None:
        now_s = self.now_s()
        receive, peers, taps = self._socket.recvfrom, self.peers, self.taps
        for _ in range(AT_ONCE):
            try:
                data, address = receive(LARGEST_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                continue  # an earlier datagram did not arrive: no process listens there yet
            peer = peers.get(address)
            if peer is None:
                self._receive_from_new_peer(data, address, now_s)
            else:
                peer.received_s = now_s
                peer.inbound.datagram(data, now_s)
                for tap in taps:
                    tap(self, peer, data)

    def _receive_from_new_peer(self, data: bytes, address: Any, now_s: float) -> None:
        """Add a peer for an address that has sent a valid frame; of others that have sent the begin
        of one, the last few are kept."""
        peer = self._unknown.pop(address, None) or self._peer(address, now_s)
        peer.inbound.datagram(data, now_s)
        if not peer.inbound.senders:
            if peer.inbound.is_waiting:
                self._unknown[address] = peer
                if len(self._unknown) > MAX_UNKNOWN_PEERS:
                    del self._unknown[next(iter(self._unknown))]
            if peer.inbound.greeting is not None:
                self.greet(peer, (peer.inbound.greeting,))
            return
        if len(self.peers) >= MAX_PEERS:
            idle = next(iter(self.idle_peers(now_s)), None)
            if idle is None:
                peer.open = False
                return
            self.drop(idle)
        self.peers[address] = peer
        for tap in self.taps:
            tap(self, peer, data)

    def _peer(self, address: Any, now_s: float) -> Peer:
        host, port = address[:2]
        name = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        connected = self.url.way is Way.UDP_OUT

        def write(data: bytes) -> None:
            try:
                if connected:
                    self._socket.send(data)
                else:
                    self._socket.sendto(data, address)
            except OSError as error:
                # Lost, as any datagram may be; a refusal answers an earlier one.
                peer.unsent += 1
                if error.errno not in (errno.ECONNREFUSED, errno.EAGAIN, errno.ENOBUFS):
                    logger.debug("%s: nothing sent to %s: %s", self.url, name, error)

        peer = Peer(name, write, self.admit, now_s, self.check_of)
        return peer


async def _opened(url: SocketUrl) -> socket.socket:
    loop = asyncio.get_running_loop()
    try:
        found = await loop.getaddrinfo(url.host, url.port, type=socket.SOCK_DGRAM)
    except OSError as error:
        raise PluginError(f"{url}: '{url.host}' is not found: {error.strerror}") from None
    family, kind, protocol, _, address = found[0]
    opened = socket.socket(family, kind, protocol)
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    try:
        if url.way is Way.UDP_IN:
            opened.bind(address)
        else:
            opened.connect(address)
    except OSError as error:
        opened.close()
        raise PluginError(f"{url}: {why_not(error)}") from None
    return opened


def why_not(error: OSError) -> str:
    """Return why a socket cannot be opened, for people."""
    if error.errno == errno.EADDRINUSE:
        return "another program has this port; end it, or use another port"
    if error.errno == errno.EADDRNOTAVAIL:
        return (
            "this machine does not have that address; to listen on all its addresses, use 0.0.0.0"
        )
    if error.errno == errno.EACCES:
        return "not allowed: a port below 1024, or a broadcast address"
    return error.strerror or str(error)
