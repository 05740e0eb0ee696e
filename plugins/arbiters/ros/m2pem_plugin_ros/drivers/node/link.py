"""What a driver of an m2pem node asks of the way in which it is commanded."""

from collections.abc import Callable
from typing import Protocol
from uuid import UUID

from m2pem_plugin_ros.drivers.driver import Order, Outcome

REPEAT_S = 0.5
"""After so long without an answer a command is sent again, on the clock that was lent."""

ANSWER_WITHIN_S = 10.0
"""A node that is heard, and answers no START for so long, will not do it."""

LOOK_WITHIN_S = 3.0
"""A node that is there answers a question at once."""

REMEMBERED = 100
"""Goals that have ended of which it is known how."""

STILL_S = 2.5
"""A node says at least once a second what it does. If what was said to be unknown was said to go on
within this, two nodes are there, and the one that does it was not restarted."""

RESTARTED = "the vehicle's node was restarted and knows nothing of it"


class Link(Protocol):
    """START, CANCEL, and what becomes of them; by topics or as an action."""

    @property
    def order(self) -> Order | None:
        """What the vehicle is to do now."""
        ...

    def begin(self, order: Order) -> None:
        """As `Driver.begin`."""
        ...

    def end(self, goal: UUID) -> None:
        """As `Driver.end`."""
        ...

    async def look(self, order: Order) -> Outcome:
        """As `Driver.look`."""
        ...

    def vehicle_does(self, behavior: str) -> None:
        """vehicle_status has said which behavior is going on; "": none."""
        ...

    def forget(self) -> None:
        """As `Driver.forget`."""
        ...

    async def close(self) -> None:
        """Send nothing more."""
        ...


Send = Callable[[object], None]
"""Publishes on `command`."""
