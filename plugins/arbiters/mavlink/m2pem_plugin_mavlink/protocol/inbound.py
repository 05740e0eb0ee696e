"""The frames of one peer: splits its bytes, counts frames for each sender, and decodes what has
listeners."""

import logging
import math
from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from fastcrc.crc16 import mcrf4xx

from m2pem_plugin_mavlink.protocol.frames import (
    AROUND_V2,
    CRC_START,
    EXTRA,
    HEADER_V2,
    SIGNATURE,
    SIGNED,
    V2,
    Frame,
    clean,
    read,
    right,
    scan,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, MessageType
from m2pem_plugin_mavlink.protocol.quality import RESTART_S, Reception
from m2pem_plugin_mavlink.signing.signature import SignatureCheck, Signing

_logger = logging.getLogger(__name__)

UNFINISHED_S = 1.0
"""Seconds after which an incomplete frame in a stream is dropped, at most twice as many."""

MOST_SENDERS = 1_024
"""Most senders of one peer; those that were silent for longest are forgotten first."""

KEPT_S = 60.0
KEPT = 8192
"""So long, and so many, are frames known that were received."""

LATE_S = 0.5
LATE_FRAMES = 16
"""Copies that come later than this belong to a slow second way. So does a frame by which it goes on
after at most so many that it has lost."""

Listener: TypeAlias = Callable[[Message, Address], None]
"""Called with a message and its sender."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A message type that has listeners."""

    type: MessageType
    listeners: tuple[Listener, ...]


WantedById: TypeAlias = Mapping[int, Wanted]

NOTHING: WantedById = {}


class Sender(Reception):
    """One component of a system, as one peer sends it; messages in `wanted` are decoded and passed
    on. `check` None: its frames need no signature. `next_copy`: the number after the last late
    copy. `checksums`, `times_s`: of the last frames, by the count of their numbers; of one that is
    not used, none."""

    __slots__ = (
        "_copied_s", "address", "check", "checksums", "next_copy", "times_s", "wanted",
    )  # fmt: skip

    def __init__(
        self, address: Address, sequence: int, now_s: float, check: SignatureCheck | None = None
    ) -> None:
        super().__init__(sequence, now_s)
        self.address = address
        self.check = check
        self.wanted: WantedById = NOTHING
        self.checksums, self.times_s = array("H"), array("d")
        self.next_copy = -1
        self._copied_s = -math.inf

    def is_copy(self, sequence: int, checksum: int, now_s: float) -> bool:
        """Whether a frame that is out of sequence, or follows a copy, was received before, or comes
        over a second way on which frames come late. It is counted."""
        late_s = now_s - self._kept_s(sequence, checksum)
        ahead = (sequence - self.expected) & 255
        if late_s <= KEPT_S:
            if ahead in (0, 255) and (
                sequence != self.next_copy or now_s - self._copied_s > RESTART_S
            ):
                return False  # the same after 256 others; a sender that numbers none of its frames
            follows = late_s >= LATE_S
        else:
            follows = (
                (sequence - self.next_copy) & 255 < LATE_FRAMES <= ahead
                and now_s - self._copied_s <= LATE_S
                and now_s - self.received_s < RESTART_S
            )
            if not follows:
                return False
        if follows:
            self.next_copy, self._copied_s = (sequence + 1) & 255, now_s
        self.doubled += 1
        return True

    def keep(self, sequence: int, checksum: int, now_s: float) -> None:
        """Note a frame as received; call it after it is counted."""
        if not self.checksums:
            self.checksums = array("H", bytes(2 * KEPT))
            self.times_s = array("d", [-math.inf]) * KEPT
        last = self.expected - 1
        place = (last - ((last - sequence) & 255)) % KEPT
        self.checksums[place], self.times_s[place] = checksum, now_s

    def _kept_s(self, sequence: int, checksum: int) -> float:
        """Return when a frame was received last; long ago: it was not."""
        times_s, sums = self.times_s, self.checksums
        places = range(sequence, len(sums), 256)
        return max((times_s[at] for at in places if sums[at] == checksum), default=-math.inf)


AdmitSender: TypeAlias = Callable[[Sender], bool]
"""Called with a new sender; may set `wanted`. Returns False to drop its frames."""


CheckOf: TypeAlias = Callable[[int], SignatureCheck | None]
"""Returns the check of a sender, system + 256 * component; None: it needs no signature."""


def unchecked(_: int) -> SignatureCheck | None:
    """Return None: no sender needs a signature."""
    return None


class Inbound:
    """One peer. A sender becomes known by a frame with a right checksum and, where it must sign, a
    right signature.

    `junk_bytes`: those that belong to no frame. `greeting`: how to sign a heartbeat that tells a
    sender the time; see `SignatureCheck.must_answer`.
    """

    __slots__ = (
        "_admit", "_check_of", "_marked", "_marked_s", "_rest", "greeting", "junk_bytes", "senders",
    )  # fmt: skip

    def __init__(self, admit: AdmitSender, check_of: CheckOf = unchecked) -> None:
        self._admit = admit
        self._check_of = check_of
        self._rest = b""
        self._marked = 0  # bytes of the rest at `_marked_s`
        self._marked_s = 0.0
        self.senders: dict[int, Sender] = {}
        self.junk_bytes = 0
        self.greeting: Signing | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether the begin of a frame was received, and its end was not."""
        return bool(self._rest)

    def datagram(self, data: bytes, now_s: float) -> None:
        """Receive a datagram."""
        size = len(data)
        # Nearly all datagrams have one frame of MAVLink 2: this path avoids calls and objects.
        if size >= AROUND_V2 and data[0] == V2:
            _, flags, sequence, source, low, high = HEADER_V2.unpack_from(data)
            end = data[1] + AROUND_V2
            if (size == end and not flags) or (size == end + SIGNATURE and flags == SIGNED):
                id_ = low | high << 16 if high else low
                sender = self.senders.get(source)
                if sender is None or (not flags and sender.check is not None):
                    signed = data if flags else b""
                    payload, sum_of = data[10 : end - 2], data[end - 2 : end]
                    frame = Frame(sequence, source, id_, payload, False, signed, sum_of)
                    self._frame(frame, data[:end], now_s)
                    return
                check = sender.check
                if check is not None and not check.accepts(data, source, now_s):
                    return
                wanted = sender.wanted.get(id_)
                if wanted is not None:
                    sum_ = mcrf4xx(EXTRA[id_], mcrf4xx(data[1 : end - 2], CRC_START))
                    if data[end - 2] != sum_ & 255 or data[end - 1] != sum_ >> 8:
                        return
                checksum = data[end - 2] | data[end - 1] << 8
                if sequence == sender.expected & 255 and sequence != sender.next_copy:
                    sender.expected += 1
                elif sender.is_copy(sequence, checksum, now_s):
                    return
                else:
                    sender.count(sequence, now_s)
                sender.received_s = now_s
                if sender.wanted:
                    place = (sender.expected - 1) % KEPT  # as in `keep`, without its call
                    if place & 255 == sequence and sender.checksums:
                        sender.checksums[place], sender.times_s[place] = checksum, now_s
                    else:
                        sender.keep(sequence, checksum, now_s)
                if wanted is not None:
                    self._hand_over(wanted, data[10 : end - 2], sender.address)
                return
        frames = clean(data)
        if frames is None:  # radios and bridges cut frames at the border of a datagram
            self.stream(data, now_s)
            return
        for each in frames:
            header = read(each)
            if header is not None:
                self._frame(header, each[:-SIGNATURE] if header.signed else each, now_s)

    def stream(self, data: bytes, now_s: float) -> None:
        """Receive bytes of a stream."""
        if self._rest:
            data = self._rest + data
        given_up = self._marked if now_s - self._marked_s > UNFINISHED_S else 0
        found, junk, end = scan(data, given_up)
        self._rest = data[end:]
        self._marked -= end
        if given_up or self._marked <= 0:
            self._marked, self._marked_s = len(self._rest), now_s
        self.junk_bytes += junk
        for frame in found:
            self._frame(frame, b"", now_s)

    def _frame(self, frame: Frame, raw: bytes, now_s: float) -> None:
        """Process a frame. `raw`: its bytes without a signature, if it has not been checked."""
        sequence, source, id_, payload, checked, _, checksum = frame
        sender = self.senders.get(source)
        check = self._check_of(source) if sender is None else sender.check
        if sender is None or check is not None:
            if id_ in EXTRA:
                if not (checked or right(raw, id_)):
                    return
                checked = True
            elif sender is None:
                return
        if check is not None and not self._is_signed(check, frame, now_s):
            if not frame.signed and check.accepts_unsigned(id_, now_s) and sender is not None:
                wanted = sender.wanted.get(id_)
                if wanted is not None:
                    self._hand_over(wanted, payload, sender.address)
            return
        if sender is None:
            sender = self._met(source, sequence, now_s, check)
            if sender is None:
                return
        wanted = sender.wanted.get(id_)
        if wanted is not None and not checked and not right(raw, id_):
            return
        sum_ = checksum[0] | checksum[1] << 8
        in_order = sequence == sender.expected & 255 and sequence != sender.next_copy
        if not in_order and sender.is_copy(sequence, sum_, now_s):
            return
        sender.count(sequence, now_s)
        if sender.wanted:
            sender.keep(sequence, sum_, now_s)
        if wanted is not None:
            self._hand_over(wanted, payload, sender.address)

    def _is_signed(self, check: SignatureCheck, frame: Frame, now_s: float) -> bool:
        if not frame.signed:
            return False
        accepted = check.accepts(frame.signed, frame.sender, now_s)
        if not accepted and check.must_answer(now_s):
            self.greeting = check.signing
        return accepted

    def forget(self, sender: Sender) -> None:
        """Forget a sender; it is admitted again at its next frame."""
        key = sender.address.system | sender.address.component << 8
        if self.senders.get(key) is sender:
            del self.senders[key]

    def _met(
        self, source: int, sequence: int, now_s: float, check: SignatureCheck | None
    ) -> Sender | None:
        sender = Sender(Address(source & 255, source >> 8), sequence, now_s, check)
        if not self._admit(sender):
            return None
        if len(self.senders) >= MOST_SENDERS:
            del self.senders[min(self.senders, key=lambda each: self.senders[each].received_s)]
        self.senders[source] = sender
        return sender

    def _hand_over(self, wanted: Wanted, payload: bytes, address: Address) -> None:
        message = wanted.type.unpack(payload)
        for listener in wanted.listeners:
            try:
                listener(message, address)
            except Exception:
                _logger.exception("a listener to %s of %s failed", wanted.type.name, address)
