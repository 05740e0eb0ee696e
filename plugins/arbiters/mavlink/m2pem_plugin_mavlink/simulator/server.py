"""The UDP socket of a simulated vehicle, and the wires that carry its frames."""

import asyncio
import logging
import struct
from collections.abc import Callable
from typing import Any, cast

from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.messages import Outgoing

Address = tuple[str, int]
Deliver = Callable[[bytes, Address], None]


class Wire:
    """One direction of a vehicle's link. `cut`: it carries nothing."""

    def __init__(self, deliver: Deliver) -> None:
        self.deliver = deliver
        self.cut = False

    def carry(self, data: bytes, peer: Address) -> None:
        """Deliver a frame, or a received datagram."""
        if not self.cut:
            self.deliver(data, peer)


logger = logging.getLogger(__name__)


class VehiclePort(asyncio.DatagramProtocol):
    """One vehicle on one socket. Peers are UDP addresses; who speaks to the socket becomes one.

    `outward` and `inward` carry frames and datagrams.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self.autopilot = autopilot
        self.outward = Wire(self._transmit)
        self.inward = Wire(self._read)
        self._transport: asyncio.DatagramTransport | None = None
        self._parsers: dict[Address, Any] = {}
        self._encoders: dict[tuple[Address, int], Any] = {}

    @property
    def address(self) -> Address:
        """Where it listens."""
        assert self._transport is not None
        return cast("Address", self._transport.get_extra_info("sockname")[:2])

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The socket is open."""
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """A datagram has come."""
        self.inward.carry(data, addr[:2])

    def error_received(self, exc: Exception) -> None:
        """No process listens at the peer (yet); later messages may arrive."""

    def step(self, now_s: float) -> None:
        """Advance simulated time, and send messages."""
        self.autopilot.step(now_s)
        self.flush()

    def flush(self) -> None:
        """Send the messages of the outbox."""
        for outgoing in self.autopilot.take_outbox():
            if outgoing.message is None:
                continue
            peers = self.autopilot.peers if outgoing.to is None else [outgoing.to]
            for peer in peers:
                address = cast("Address", peer)
                try:
                    frame = self._encode(outgoing, address)
                except struct.error:
                    # One message that cannot be sent must not stop the other vehicles.
                    logger.exception("cannot encode %s", outgoing.message)
                    continue
                self.outward.carry(frame, address)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()

    def _encode(self, outgoing: Outgoing, peer: Address) -> bytes:
        encoder = self._encoders.get((peer, outgoing.component))
        if encoder is None:
            encoder = self.autopilot.signing.encoder(self.autopilot.spec.system, outgoing.component)
            self._encoders[peer, outgoing.component] = encoder
        frame: bytes = outgoing.message.pack(encoder)
        encoder.seq = (encoder.seq + 1) % 256
        return frame

    def _transmit(self, frame: bytes, peer: Address) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(frame, peer)

    def _read(self, data: bytes, peer: Address) -> None:
        parser = self._parsers.get(peer)
        if parser is None:
            parser = self._parsers[peer] = self.autopilot.signing.parser()
        for message in parser.parse_buffer(data) or ():
            if message.get_type() != "BAD_DATA":
                self.autopilot.receive(message, peer, self.autopilot.now_s)
        self.flush()
