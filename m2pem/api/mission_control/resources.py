"""Operations on vehicles and payloads: who has them, and who waits for them."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from m2pem.api.allocation import SharedSpaceState, TakeEffect, WaitingTask
from m2pem.mission.catalogue import ResourceId


class ResourceControl(Protocol):
    """The operations of `MissionControl` on vehicles and payloads."""

    async def take(self, resource: str, *, by: str = "") -> None:
        """Take a vehicle or payload from the missions, to steer it by hand.

        What it was doing ends with error TAKEN_OVER; until it is given back no behavior gets it.
        """

    async def preview_take(self, resource: str) -> Sequence[TakeEffect]:
        """What `take` of a resource would end now, and whether the missions handle it.

        Empty: no run commands it. Operators see this before they take anything.
        """

    async def give_back(self, resource: str, *, reason: str = "", by: str = "") -> None:
        """Give it back to the missions; signals with `m2pem:returned` of it are thrown.

        The operator who has it may. Another one gives a `reason`, and is refused while the one who
        has it is there: see "Handing over" in docs/operating.md. All operators see it then.

        Raises:
            OperatorError: no operator has it, or `by` may not give it back.
        """

    async def holders(self) -> Mapping[ResourceId, str]:
        """Who has each resource: an operator, a behavior ("r1.b3"), a request for which it was just
        chosen ("r1.a2"), an incident ("r1.i1"), or "" when it is free.
        """

    async def holder_labels(self) -> Mapping[str, str]:
        """The task and run of each behavior and request that has a resource, in words, by its id:
        "Survey of r1". Operators are not among them.
        """

    async def unavailable(self) -> Mapping[ResourceId, str]:
        """Why missions get some resources not now: manned, with an operator, lost, or returned and
        not stopped yet. "returned: held": it was lost, is free again, and has done nothing since.
        """

    async def waiting(self) -> Sequence[WaitingTask]:
        """The tasks of all runs that wait for vehicles, payloads or space, in the order of
        service."""

    async def shared_space(self) -> Sequence[SharedSpaceState]:
        """Who has places in the shared spaces of the fleet file, in its order, and which tasks wait
        for one."""
