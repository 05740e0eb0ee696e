"""Bounds connections, so that strangers who open many keep nobody out who has signed in."""

from collections.abc import Callable
from dataclasses import dataclass

MOST_STRANGERS = 128
MOST_OF_AN_ADDRESS = 32
"""Connections on which nobody has signed in: of all addresses, and of one."""

MOST_KNOWN = 256
"""Connections of people who have signed in; then all is refused to them but STOP."""

Peer = tuple[str, int]


@dataclass(slots=True)
class _Connection:
    abort: Callable[[], None]
    known: bool = False


class Slots:
    """Open connections by their peers (address and port), the oldest first.

    A new connection always has a slot: the oldest one goes on which nobody has signed in, first
    of those from the same address. That is most likely a request that never came whole.
    """

    def __init__(self) -> None:
        self._open: dict[Peer, _Connection] = {}

    def opened(self, peer: Peer, abort: Callable[[], None]) -> None:
        """Somebody has connected; `abort` ends that."""
        strangers = [each for each, slot in self._open.items() if not slot.known]
        own = [each for each in strangers if each[0] == peer[0]]
        if len(own) >= MOST_OF_AN_ADDRESS:
            self._drop(own[0])
        elif len(strangers) >= MOST_STRANGERS:
            self._drop(strangers[0])
        self._open[peer] = _Connection(abort)

    def closed(self, peer: Peer) -> None:
        """The connection has ended, or is a WebSocket's now."""
        self._open.pop(peer, None)

    def known(self, peer: Peer) -> None:
        """Who is at the other end has signed in: the connection stays."""
        if (slot := self._open.get(peer)) is not None:
            slot.known = True

    @property
    def full(self) -> bool:
        """Whether there are too many connections even of people who have signed in."""
        return sum(slot.known for slot in self._open.values()) > MOST_KNOWN

    def _drop(self, peer: Peer) -> None:
        self._open.pop(peer).abort()
