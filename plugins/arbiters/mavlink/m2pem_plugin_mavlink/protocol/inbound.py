"""What comes from one peer: split into frames, counted for each sender, decoded where wanted."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from fastcrc.crc16 import mcrf4xx

from m2pem_plugin_mavlink.protocol.frames import (
    AROUND_V2,
    CRC_START,
    EXTRA,
    HEADER_V2,
    V2,
    Frame,
    clean,
    read,
    right,
    scan,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, MessageType
from m2pem_plugin_mavlink.protocol.quality import Reception

_logger = logging.getLogger(__name__)

UNFINISHED_S = 1.0
"""A frame in a stream whose end has not come after so long is none."""

MOST_SENDERS = 512
"""Of one peer; those that were silent for longest are forgotten first."""

Listener: TypeAlias = Callable[[Message, Address], None]
"""Is handed a message and its sender."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A message that somebody listens to."""

    type: MessageType
    listeners: tuple[Listener, ...]


WantedById: TypeAlias = Mapping[int, Wanted]

NOTHING: WantedById = {}


class Sender(Reception):
    """One component of a system, as it is heard over one peer; `wanted` of its messages are
    decoded and handed on."""

    __slots__ = ("address", "wanted")

    def __init__(self, address: Address, sequence: int, now_s: float) -> None:
        super().__init__(sequence, now_s)
        self.address = address
        self.wanted: WantedById = NOTHING


Meet: TypeAlias = Callable[[Sender], bool]
"""Is told of a new sender, and may set what is wanted of it; False: it is not to be heard."""


class Inbound:
    """One peer. A sender becomes known by a frame with a right checksum.

    `junk_bytes`: those that belong to no frame; `bad_frames`: with a wrong checksum, or of a
    sender that nobody knows and that cannot be checked.
    """

    __slots__ = ("_began_s", "_meet", "_rest", "bad_frames", "junk_bytes", "senders")

    def __init__(self, meet: Meet) -> None:
        self._meet = meet
        self._rest = b""
        self._began_s = 0.0
        self.senders: dict[int, Sender] = {}
        self.junk_bytes = 0
        self.bad_frames = 0

    def datagram(self, data: bytes, now_s: float) -> None:
        """A datagram has come."""
        size = len(data)
        # Nearly all have one frame of MAVLink 2: no call, no object more than is needed for it.
        if size >= AROUND_V2 and data[0] == V2 and size == data[1] + AROUND_V2:
            _, flags, sequence, source, low, high = HEADER_V2.unpack_from(data)
            if not flags:
                id_ = low | high << 16 if high else low
                sender = self.senders.get(source)
                if sender is None:
                    self._frame(Frame(sequence, source, id_, data[10:-2], False), data, now_s)
                    return
                wanted = sender.wanted.get(id_)
                if wanted is not None:
                    sum_ = mcrf4xx(EXTRA[id_], mcrf4xx(data[1:-2], CRC_START))
                    if data[-2] != sum_ & 255 or data[-1] != sum_ >> 8:
                        self.bad_frames += 1
                        return
                if sequence == sender.expected & 255:
                    sender.expected += 1
                else:
                    sender.astray(sequence, now_s)
                sender.heard_s = now_s
                if wanted is not None:
                    self._hand_over(wanted, data[10:-2], sender.address)
                return
        frames = clean(data)
        if frames is None:
            found, junk, _ = scan(data)
            self.junk_bytes += junk
            for frame in found:
                self._frame(frame, b"", now_s)
            return
        for each in frames:
            header = read(each)
            if header is not None:
                self._frame(header, each, now_s)

    def stream(self, data: bytes, now_s: float) -> None:
        """More of a stream has come."""
        rest = self._rest
        if rest:
            data = rest + data
        found, junk, end = scan(data, unfinished=True)
        if rest and not end and now_s - self._began_s > UNFINISHED_S:
            # It was no frame, but some may be inside what was taken for one.
            data = data[1:]
            found, junk, end = scan(data, unfinished=True)
            self._began_s = now_s
            junk += 1
        elif end or not rest:
            self._began_s = now_s
        self._rest = data[end:]
        self.junk_bytes += junk
        for frame in found:
            self._frame(frame, b"", now_s)

    def _frame(self, frame: Frame, raw: bytes, now_s: float) -> None:
        """`raw`: the frame, if it has not been checked."""
        sequence, source, id_, payload, checked = frame
        sender = self.senders.get(source)
        if sender is None:
            if id_ not in EXTRA or not (checked or right(raw, id_)):
                self.bad_frames += 1
                return
            sender = self._met(source, sequence, now_s)
            if sender is None:
                return
            checked = True
        wanted = sender.wanted.get(id_)
        if wanted is not None and not checked and not right(raw, id_):
            self.bad_frames += 1
            return
        sender.count(sequence, now_s)
        if wanted is not None:
            self._hand_over(wanted, payload, sender.address)

    def _met(self, source: int, sequence: int, now_s: float) -> Sender | None:
        sender = Sender(Address(source & 255, source >> 8), sequence, now_s)
        if not self._meet(sender):
            return None
        if len(self.senders) >= MOST_SENDERS:
            del self.senders[min(self.senders, key=lambda each: self.senders[each].heard_s)]
        self.senders[source] = sender
        return sender

    def _hand_over(self, wanted: Wanted, payload: bytes, address: Address) -> None:
        message = wanted.type.unpack(payload)
        for listener in wanted.listeners:
            try:
                listener(message, address)
            except Exception:
                _logger.exception("a listener to %s of %s failed", wanted.type.name, address)
