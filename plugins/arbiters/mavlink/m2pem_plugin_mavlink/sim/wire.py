"""What carries frames between a vehicle and its peers: at once and whole, unless it is replaced."""

from collections.abc import Callable

Address = tuple[str, int]
Deliver = Callable[[bytes, Address], None]


class Wire:
    """One direction of a vehicle's link. Faults are subclasses: they lose, delay or double."""

    def __init__(self, deliver: Deliver) -> None:
        self.deliver = deliver

    def carry(self, data: bytes, peer: Address, now_s: float) -> None:
        """Take a frame (or a datagram that came) to its end."""
        self.deliver(data, peer)

    def step(self, now_s: float) -> None:
        """Deliver what was held up until now."""
