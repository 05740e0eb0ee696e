"""Everything said to and heard from one vehicle, over whichever endpoint hears it best."""

from collections.abc import Callable, Iterable
from typing import Protocol, TypeAlias, TypeVar

from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import Transaction

T = TypeVar("T")

Listener: TypeAlias = Callable[[Message, Address], None]
"""Is handed a message and its sender, in the event loop; must not raise."""


class VehicleLink(Protocol):
    """What the exchanges and drivers of a vehicle speak through. `address` is its autopilot's."""

    @property
    def address(self) -> Address:
        """Of the autopilot."""
        ...

    def now_s(self) -> float:
        """The clock of `deadline_s`: seconds, never goes back."""
        ...

    def send(self, message: Message) -> None:
        """Send a message; its target fields are the caller's. Nothing is said of its arrival."""
        ...

    async def perform(self, transaction: Transaction[T]) -> T:
        """Run an exchange to its end, after those with the same key.

        Raises:
            ExchangeError: it failed.
        """
        ...

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        """Hand over all messages with these ids of this system, any component; the function that is
        returned ends it. Only messages that somebody listens to are decoded."""
        ...

    def quality(self) -> LinkQuality | None:
        """How well the autopilot is heard over the endpoint in use; None: never yet."""
        ...
