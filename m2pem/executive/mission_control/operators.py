"""Operations between operators: who is present, and who asks whom for a vehicle or payload."""

from collections.abc import Sequence

from m2pem.api.people import OpenControlRequest, OperatorPresence
from m2pem.api.runs import RunId
from m2pem.executive.handover import UNNAMED_OPERATOR
from m2pem.executive.mission_control.parts import ControlParts


class OperatorOperations(ControlParts):
    """See `m2pem.api.mission_control.operators.OperatorControl`."""

    async def request_control(self, resource: str, *, by: str = "") -> None:
        self._supervisor.seen(by)
        await self._supervisor.control_requests.ask(resource, by)

    async def answer_control(self, resource: str, *, give: bool, by: str = "") -> None:
        self._supervisor.seen(by)
        await self._supervisor.control_requests.answer(resource, by, give=give)

    async def control_requests(self) -> Sequence[OpenControlRequest]:
        return self._supervisor.control_requests.all()

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
        name = by or UNNAMED_OPERATOR
        presence = OperatorPresence(name, unit, role, run, page, editing=editing)
        self._supervisor.presence.announce(client, presence)

    async def end_presence(self, client: str) -> None:
        self._supervisor.presence.leave(client)

    async def operators(self) -> Sequence[OperatorPresence]:
        return self._supervisor.presence.present()
