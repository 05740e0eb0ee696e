"""Who the autopilot talks with. A peer is whatever the server says, such as a UDP address."""

from collections.abc import Hashable
from typing import Any, NamedTuple

Peer = Hashable


class Heard(NamedTuple):
    """Where a message came from: the peer that handed it over, and who says to have sent it."""

    peer: Peer
    system: int
    component: int


class Outgoing(NamedTuple):
    """A message to be sent: to one peer, or (None) to all of them."""

    message: Any
    to: Peer | None
    component: int = 1
