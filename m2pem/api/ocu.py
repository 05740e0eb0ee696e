"""An operator control unit: how operators see and steer missions (paper, section 4.3)."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl
    from m2pem.api.health import ExecutiveAddress


class Ocu(Protocol):
    """Constructed as `Ocu(control)`; several may serve at once, all in the same manner.

    What the command line must know before it makes one, the class declares in its attribute
    `capabilities`, an `m2pem.api.OcuCapabilities`, which may be missing.
    """

    def __init__(self, control: "MissionControl") -> None: ...

    async def serve(self) -> None:
        """Show and ask until cancelled, or until the operator leaves."""
        ...


class StandbyOcu(Protocol):
    """A unit that answers also while its executive stands by (`OcuCapabilities.stands_by`)."""

    @classmethod
    def page(cls) -> str:
        """Return the address at which browsers will find it; "": it has none, or does not know."""
        ...

    @classmethod
    async def stand_by(cls, fleet: str, served_by: "Callable[[], ExecutiveAddress | None]") -> None:
        """Show operators that the executive stands by, until cancelled.

        `served_by`: who serves the fleet now; None: that is not known.
        """
        ...
