"""Operations on vehicles and payloads: who has them, and who waits for them."""

from collections.abc import Mapping, Sequence

from m2pem.api.allocation import SharedSpaceState, TakeEffect, WaitingTask
from m2pem.executive.mission_control.parts import ControlParts
from m2pem.executive.waiting_tasks import holder_label, waiting_tasks
from m2pem.mission.catalogue import ResourceId


class ResourceOperations(ControlParts):
    """See `m2pem.api.mission_control.resources.ResourceControl`."""

    async def take(self, resource: str, *, by: str = "") -> None:
        self._supervisor.seen(by)
        await self._direct.take(resource, by)

    async def preview_take(self, resource: str) -> Sequence[TakeEffect]:
        return self._supervisor.handover.preview(resource, self._supervisor.runners.values())

    async def give_back(self, resource: str, *, reason: str = "", by: str = "") -> None:
        self._supervisor.seen(by)
        await self._supervisor.control_release.give_back(
            resource, by, reason, self._supervisor.runners.values()
        )

    async def holders(self) -> Mapping[ResourceId, str]:
        return self._supervisor.handover.holders()

    async def holder_labels(self) -> Mapping[str, str]:
        supervisor = self._supervisor
        holders = supervisor.handover.holders().values()
        labels = {holder: holder_label(supervisor.runners, holder) for holder in holders}
        return {holder: label for holder, label in labels.items() if label}

    async def unavailable(self) -> Mapping[ResourceId, str]:
        return self._supervisor.unavailable()

    async def waiting(self) -> Sequence[WaitingTask]:
        supervisor = self._supervisor
        return waiting_tasks(supervisor.runners.values(), supervisor.clock.now_us())

    async def shared_space(self) -> Sequence[SharedSpaceState]:
        return self._supervisor.shared_space()
