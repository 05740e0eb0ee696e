"""An operator control unit: how operators see and steer missions (paper, section 4.3)."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl


class Ocu(Protocol):
    """Constructed as `Ocu(control)`; several may serve at once, all in the same manner.

    What the command line must know before it makes one, the class declares in its attribute
    `capabilities`, an `m2pem.api.OcuCapabilities`, which may be missing.
    """

    def __init__(self, control: "MissionControl") -> None: ...

    async def serve(self) -> None:
        """Show and ask until cancelled, or until the operator leaves."""
        ...
