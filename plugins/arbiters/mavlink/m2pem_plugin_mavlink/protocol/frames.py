"""Frames of MAVLink 1 and 2: found, checked and made (mavlink.io, "Packet Serialization").

A frame is decoded only as far as needed: of a datagram that consists of frames alone, only headers
are read, as UDP protects the rest. Frames from a stream, or from a datagram with other bytes, have
a valid checksum.
"""

import re
import sys
from collections.abc import Callable
from struct import Struct
from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message

V1 = 0xFE
V2 = 0xFD
SIGNED = 0x01
"""The incompatibility flag of a signature of 13 bytes. Frames with other flags are not read."""

HEADER_V1 = Struct("<xBBHB")  # length, sequence, sender, id
HEADER_V2 = Struct("<xBBxBHHB")  # length, flags, sequence, sender, lower and upper part of the id
AROUND_V1 = 8
AROUND_V2 = 12
SIGNATURE = 13
CRC_START = 0xFFFF
NEVER = sys.maxsize

EXTRA: dict[int, bytes] = {
    id_: bytes((each.crc_extra,)) for id_, each in dialect.mavlink_map.items()
}
"""CRC_EXTRA by message id. The checksum of other messages cannot be checked."""

_MAGIC = re.compile(b"[\xfd\xfe]")
_MADE = Struct("<BBBBBBBHB")
_CRC = Struct("<H")


class Frame(NamedTuple):
    """The header of a frame. `sender`: system + 256 * component; `checked`: its checksum is
    right (False: the message is unknown, or it was not checked); `signed`: the whole frame, if it
    has a signature, else nothing; `checksum`: its two bytes."""

    sequence: int
    sender: int
    id: int
    payload: bytes
    checked: bool
    signed: bytes = b""
    checksum: bytes = b""


def right(frame: bytes, id_: int) -> bool:
    """Return whether a frame without a signature has a valid checksum."""
    sum_ = mcrf4xx(EXTRA[id_], mcrf4xx(frame[1:-2], CRC_START))
    return frame[-2] == sum_ & 255 and frame[-1] == sum_ >> 8


def encode(
    message: Message, sequence: int, source: Address, sign: Callable[[bytes], bytes] | None = None
) -> bytes:
    """Return a message as a frame of MAVLink 2, without trailing zeros. `sequence`: 0..255;
    `sign`: returns the signature of a frame.

    Raises:
        struct.error: a field's value does not fit its type.
    """
    type_ = message.TYPE
    payload = type_.pack(message).rstrip(b"\0") or b"\0"
    id_ = type_.id
    flags = 0 if sign is None else SIGNED
    header = _MADE.pack(V2, len(payload), flags, 0, sequence, *source, id_ & 0xFFFF, id_ >> 16)
    extra = EXTRA.get(id_) or bytes((type_.crc_extra,))  # messages of other dialects
    sum_ = mcrf4xx(extra, mcrf4xx(payload, mcrf4xx(header[1:], CRC_START)))
    frame = header + payload + _CRC.pack(sum_)
    return frame if sign is None else frame + sign(frame)


def clean(data: bytes) -> list[bytes] | None:
    """Return the frames of a datagram; None if it has other bytes."""
    found = []
    start, size = 0, len(data)
    while start < size:
        if size - start < AROUND_V1:
            return None
        magic, length, flags = data[start], data[start + 1], data[start + 2]
        if magic == V2:
            end = start + AROUND_V2 + length + (SIGNATURE if flags & SIGNED else 0)
        elif magic == V1:
            end = start + AROUND_V1 + length
        else:
            return None
        if end > size:
            return None
        found.append(data[start:end])
        start = end
    return found


def read(frame: bytes) -> Frame | None:
    """Return the header of a frame of `clean`; None if it has an unknown flag."""
    if frame[0] == V1:
        _, sequence, sender, id_ = HEADER_V1.unpack_from(frame)
        return Frame(sequence, sender, id_, frame[6:-2], False, b"", frame[-2:])
    _, flags, sequence, sender, low, high = HEADER_V2.unpack_from(frame)
    if flags & ~SIGNED:
        return None
    end, signed = (len(frame) - 2 - (SIGNATURE if flags else 0)), (frame if flags else b"")
    id_, checksum = low | high << 16, frame[end : end + 2]
    return Frame(sequence, sender, id_, frame[10:end], False, signed, checksum)


def scan(data: bytes, unfinished_from: int = NEVER) -> tuple[list[Frame], int, int]:
    """Return the frames among other bytes: those with a valid checksum, and those that cannot be
    checked if another frame or nothing follows and no valid frame is inside of them.

    Also return the number of bytes outside of frames, and the start of an incomplete frame. An
    incomplete frame that starts before `unfinished_from` is ignored.
    """
    found: list[Frame] = []
    junk = position = 0
    size = len(data)
    doubt: Frame | None = None  # an unchecked frame that ends at `doubt_end`, if that is not 0
    doubt_end = junk_before = 0
    while True:
        if doubt_end and position >= doubt_end:
            if doubt is not None:
                found.append(doubt)
            junk, doubt_end = junk_before, 0
        if position >= size:
            break
        magic = data[position]
        # Of the payload; this stays if not even the header is whole.
        begin, length, flags = size, 1, 0
        if magic == V2:
            if size - position >= AROUND_V2:
                length, flags, sequence, sender, low, high = HEADER_V2.unpack_from(data, position)
                id_ = low | high << 16 if high else low
                begin = position + 10
        elif magic == V1:
            if size - position >= AROUND_V1:
                length, sequence, sender, id_ = HEADER_V1.unpack_from(data, position)
                begin = position + 6
        else:
            next_ = _MAGIC.search(data, position)
            start = next_.start() if next_ else size
            junk += start - position
            position = start
            continue
        end = begin + length
        after = end + 2 + SIGNATURE if flags & SIGNED else end + 2
        if after <= size:
            extra = None if flags & ~SIGNED else EXTRA.get(id_)
            rest = (data[position:after] if flags & SIGNED else b""), data[end : end + 2]
            if extra is not None:
                sum_ = mcrf4xx(extra, mcrf4xx(data[position + 1 : end], CRC_START))
                if data[end] == sum_ & 255 and data[end + 1] == sum_ >> 8:
                    found.append(Frame(sequence, sender, id_, data[begin:end], True, *rest))
                    position, doubt_end = after, 0
                    continue
            elif not doubt_end and (after == size or data[after] in (V1, V2)):
                made = Frame(sequence, sender, id_, data[begin:end], False, *rest)
                doubt = None if flags & ~SIGNED else made
                doubt_end, junk_before = after, junk
        elif position >= unfinished_from and not doubt_end:
            break
        junk += 1
        position += 1
    return found, junk, position
