"""Operations between operators: who is present, and who asks whom for a vehicle or payload."""

from collections.abc import Sequence
from typing import Protocol

from m2pem.api.people import OpenControlRequest, OperatorPresence
from m2pem.api.runs import RunId


class OperatorControl(Protocol):
    """The operations of `MissionControl` between operators."""

    async def request_control(self, resource: str, *, by: str = "") -> None:
        """Ask the operator who has taken a vehicle or payload for it.

        Within the fleet's `hand_over: answer_within` the holder gives it or refuses; afterwards it
        stays, or goes to `by`, as the fleet says. All operators see the request.

        Raises:
            OperatorError: no other operator has it, or one asks for it already.
        """

    async def answer_control(self, resource: str, *, give: bool, by: str = "") -> None:
        """Give a vehicle or payload to the operator who asks for it, or refuse. Who has asked
        withdraws the request by refusing.

        Raises:
            OperatorError: no operator asks for it, or `by` does not have it.
        """

    async def control_requests(self) -> Sequence[OpenControlRequest]:
        """Who asks whom for which vehicle or payload now."""

    async def announce_presence(
        self,
        client: str,
        *,
        unit: str,
        role: str = "",
        run: RunId = "",
        page: str = "",
        editing: str = "",
        by: str = "",
    ) -> None:
        """An operator is present at a unit with the id `client`. Units say so each
        `PRESENCE_EVERY_S`; after `ABSENT_AFTER_S` without it the operator counts as gone.

        `run`, `page`: what the unit shows; `editing`: the mission that is edited there; `role`:
        what it lets the operator do.
        """

    async def end_presence(self, client: str) -> None:
        """The operator of the unit `client` has left."""

    async def operators(self) -> Sequence[OperatorPresence]:
        """Which operators are present, at which units."""
