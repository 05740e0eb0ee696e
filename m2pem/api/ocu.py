"""An operator control unit: how operators see and steer missions (paper, section 4.3)."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl


class Ocu(Protocol):
    """Constructed as `Ocu(control)`; several may serve at once, all in the same manner.

    A class attribute `takes_terminal = True` says that it draws on the whole terminal: then the
    command line prints nothing while it serves, and uses `plain` instead where there is none.
    A class attribute `imports` names modules that take long to import: they are imported before an
    executive exists, as an import in its event loop would delay STOP.
    """

    def __init__(self, control: "MissionControl") -> None: ...

    async def serve(self) -> None:
        """Show and ask until cancelled, or until the operator leaves."""
        ...
