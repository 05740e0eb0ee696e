"""The frames in a datagram, and which message each has, without decoding them."""

from collections.abc import Iterator

V1, V2 = 0xFE, 0xFD
SIGNED = 0x01
"""In the incompatibility flags of MAVLink 2: a signature of 13 bytes follows."""


def frames_in(datagram: bytes) -> Iterator[bytes]:
    """One by one; what is no frame stays together."""
    start = 0
    while start < len(datagram):
        end = start + _length(datagram, start)
        yield datagram[start:end]
        start = end


def _length(datagram: bytes, start: int) -> int:
    rest = len(datagram) - start
    if datagram[start] == V2 and rest >= 12:
        signature = 13 if datagram[start + 2] & SIGNED else 0
        return min(rest, datagram[start + 1] + 12 + signature)
    if datagram[start] == V1 and rest >= 8:
        return min(rest, datagram[start + 1] + 8)
    return rest


def message_id(frame: bytes) -> int | None:
    """The id of its message; None: it is no frame."""
    if len(frame) >= 12 and frame[0] == V2:
        return int.from_bytes(frame[7:10], "little")
    if len(frame) >= 8 and frame[0] == V1:
        return frame[5]
    return None
