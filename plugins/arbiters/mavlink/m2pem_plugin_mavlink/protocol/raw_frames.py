"""Frames as they travel: found among bytes and kept whole, with signatures and unknown messages.

For programs that forward frames (mavlink.io, "Routing"). A frame of a known message has a valid
checksum; that of an unknown one cannot be checked.
"""

from functools import cache
from typing import NamedTuple

from m2pem_plugin_mavlink.protocol.frames import (
    AROUND_V1,
    AROUND_V2,
    EXTRA,
    SIGNATURE,
    SIGNED,
    V1,
    V2,
    read,
    right,
)
from m2pem_plugin_mavlink.protocol.messages import Address, types_by_id


class RawFrame(NamedTuple):
    """A frame. `data`: all its bytes; `target`: to whom it is addressed, 0 for all."""

    data: bytes
    source: Address
    id: int
    payload: bytes
    target: Address


EVERYONE = Address(0, 0)


class FrameSplitter:
    """The frames of one peer. `rejected`: bytes that belong to no frame."""

    def __init__(self) -> None:
        self.rejected = 0
        self._rest = b""

    def datagram(self, data: bytes) -> list[RawFrame]:
        """Return the frames of a datagram."""
        return self._split(data, is_whole=True)[0]

    def stream(self, data: bytes) -> list[RawFrame]:
        """Return the frames that are whole after further bytes of a stream."""
        data = self._rest + data
        frames, end = self._split(data, is_whole=False)
        self._rest = data[end:]
        return frames

    def _split(self, data: bytes, is_whole: bool) -> tuple[list[RawFrame], int]:
        """Return the frames, and the position of the first one that is not whole; of a datagram,
        which `is_whole`, no such frame becomes whole."""
        found: list[RawFrame] = []
        position, size = 0, len(data)
        while position < size:
            magic = data[position]
            after = size + 1
            frame = None
            if magic in (V1, V2) and size - position >= AROUND_V1:
                around = AROUND_V2 if magic == V2 else AROUND_V1
                end = position + around + data[position + 1]
                signed = magic == V2 and data[position + 2] & SIGNED
                after = end + SIGNATURE if signed else end
                if after <= size:
                    frame = _read(data[position:end], data[position:after])
            if frame is not None:
                found.append(frame)
                position = after
            elif magic in (V1, V2) and after > size and not is_whole:
                break
            else:
                self.rejected += 1
                position += 1
        return found, position


def _read(unsigned: bytes, whole: bytes) -> RawFrame | None:
    frame = read(whole)
    if frame is None or (frame.id in EXTRA and not right(unsigned, frame.id)):
        return None
    target = _target(frame.id, frame.payload) if frame.id in EXTRA else EVERYONE
    source = Address(frame.sender & 255, frame.sender >> 8)
    return RawFrame(whole, source, frame.id, frame.payload, target)


def _target(id_: int, payload: bytes) -> Address:
    system, component = target_offsets(id_)
    if system is None or system >= len(payload):  # MAVLink 2 leaves out zeros at the end
        return EVERYONE
    named = component is not None and component < len(payload)
    return Address(payload[system], payload[component] if named else 0)  # type: ignore[index]


@cache
def target_offsets(id_: int) -> tuple[int | None, int | None]:
    """Return where the fields `target_system` and `target_component` of a message are in its
    payload; None: it has none."""
    type_ = types_by_id()[id_]
    fields = type_.make._fields
    found = (
        type_.pack(type_.make(**{name: 1})).index(1) if name in fields else None
        for name in ("target_system", "target_component")
    )
    system, component = found
    return system, component
