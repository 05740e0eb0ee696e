"""One address that MAVLink comes from, and its frames go to."""

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.inbound import Inbound, Sender
from m2pem_plugin_mavlink.protocol.messages import Address, Message

Meet: TypeAlias = Callable[["Peer", Sender], bool]
"""Is told of a new sender at a peer; False: it is not to be heard."""


class Peer:
    """A peer of an endpoint: a UDP address, a TCP connection, or what is at the end of a serial
    line. `name` is for people; `write` sends bytes at once, or drops them; `heard_s`: when anything
    came from it; `open`: it has not gone away."""

    __slots__ = ("_sequences", "heard_s", "inbound", "name", "open", "write")

    def __init__(
        self, name: str, write: Callable[[bytes], None], meet: Meet, heard_s: float
    ) -> None:
        self.name = name
        self.write = write
        self.heard_s = heard_s
        self.open = True
        self.inbound = Inbound(partial(meet, self))
        self._sequences: dict[Address, int] = {}

    def send(self, message: Message, source: Address) -> None:
        """Send a message as `source`, whose frames to each peer are numbered by themselves.

        Raises:
            struct.error: a field's value does not fit its type.
        """
        sequence = self._sequences.get(source, 0)
        self.write(encode(message, sequence, source))
        self._sequences[source] = (sequence + 1) & 255
