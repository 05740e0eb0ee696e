"""The connection to a browser, to which whole messages are written without waiting.

The ASGI interface takes a task switch for each message, a copy of it in each layer, and stops
reading after each one that comes: with 50 browsers the engine would be late.
"""

from collections.abc import Callable
from typing import Protocol

WIRE = "m2pem.wire"
"""The key of the `Wire` in the ASGI scope of a WebSocket."""

_FINAL_TEXT = 0x81
_IN_ONE_BYTE = 125
_IN_TWO_BYTES = 0xFFFF


class Wire(Protocol):
    """A WebSocket that is open."""

    def listen(self, received: Callable[[bytes], None], drained: Callable[[], None]) -> None:
        """Call `received` with each message that comes, `drained` when it is writable again."""

    @property
    def is_writable(self) -> bool:
        """Whether so little waits in the memory of this process that more may be written."""

    def write_text(self, head: bytes, rest: bytes) -> None:
        """Write `head` and `rest` as one message of text; nothing if the connection is closing."""

    def abort(self) -> None:
        """End the connection at once: one that receives nothing receives no close message."""


def frame_of_text(head: bytes, rest: bytes) -> bytes:
    """Return a message of text as one frame of a server (RFC 6455, 5.2)."""
    size = len(head) + len(rest)
    if size <= _IN_ONE_BYTE:
        begin = bytes((_FINAL_TEXT, size))
    elif size <= _IN_TWO_BYTES:
        begin = bytes((_FINAL_TEXT, 126)) + size.to_bytes(2, "big")
    else:
        begin = bytes((_FINAL_TEXT, 127)) + size.to_bytes(8, "big")
    return b"".join((begin, head, rest))
