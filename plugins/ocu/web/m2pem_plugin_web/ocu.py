"""The web page as an operator control unit."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl


class WebOcu:
    """Serves browsers until cancelled."""

    def __init__(self, control: "MissionControl") -> None:
        self._control = control

    async def serve(self) -> None:
        """Serve browsers until cancelled."""
        raise NotImplementedError
