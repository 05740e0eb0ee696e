"""Who has which vehicle: the missions, or an operator who took it to steer it by hand.

While an operator has a resource, no mission gets it; every run's journal says so.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

from m2pem.api.control import TakeEffect
from m2pem.engine.elements.behaviors import preview_control_taken
from m2pem.engine.inputs import ControlReturned, ControlTaken
from m2pem.errors import OperatorError
from m2pem.executive.runner import Runner
from m2pem.fleet.availability import Availability
from m2pem.mission.catalogue import ResourceId
from m2pem.suggestions import did_you_mean

if TYPE_CHECKING:
    from m2pem.executive.arbiters import FleetArbiters

SOMEBODY = "an operator"


class Handover:
    """Operators take resources from the missions, and give them back.

    `why_not_free`: why a resource that is given back is not free yet (it is lost), or "".
    """

    def __init__(self, arbiters: "FleetArbiters", availability: Availability) -> None:
        self._known = arbiters.resources
        self._availability = availability
        self.taken: dict[ResourceId, str] = {}
        self.why_not_free: Callable[[ResourceId], str] = lambda _: ""

    async def take(self, name: str, by: str, runners: Iterable[Runner]) -> None:
        """Give a resource to an operator: no behavior gets it, and what it did is given up.

        Raises:
            OperatorError: there is no such resource, or somebody has it.
        """
        resource = self._resource(name)
        holder = self.taken.get(resource)
        if holder is not None:
            raise OperatorError(f"{resource} is with {holder}")
        self.taken[resource] = by or SOMEBODY
        self._withdraw(resource)
        for runner in list(runners):
            if not runner.done.is_set():
                await runner.tell(ControlTaken(resource, by or SOMEBODY))

    def preview(self, name: str, runners: Iterable[Runner]) -> list[TakeEffect]:
        """What `take` of a resource would end now in each run.

        Raises:
            OperatorError: the fleet has no such resource.
        """
        resource = self._resource(name)
        return [
            TakeEffect(
                runner.id,
                behavior.id,
                behavior.element,
                state.mission.elements[behavior.element].label,
                catcher.label if catcher is not None else "",
            )
            for runner in runners
            if not runner.done.is_set() and (state := runner.run.state)
            for behavior, catcher in preview_control_taken(state, resource)
        ]

    async def give_back(self, name: str, by: str, runners: Iterable[Runner]) -> None:
        """Give a resource back to the missions.

        Raises:
            OperatorError: no operator has it.
        """
        resource = self._resource(name)
        if resource not in self.taken:
            raise OperatorError(f"{resource} is not with an operator")
        del self.taken[resource]
        self._availability.restore(resource)
        if why := self.why_not_free(resource):
            self._availability.withdraw(resource, why)
        for runner in list(runners):
            if not runner.done.is_set():
                await runner.tell(ControlReturned(resource, by or SOMEBODY))

    def by_name(self) -> dict[str, str]:
        """What is taken, and by whom: for a run that begins."""
        return {str(resource): holder for resource, holder in self.taken.items()}

    def take_up(self, taken: Mapping[str, str]) -> None:
        """After a restart: who had what, by the journal of a run."""
        for name, holder in taken.items():
            resource = ResourceId(name)
            self.taken.setdefault(resource, holder)
            self._withdraw(resource)

    def restore(self, resource: ResourceId) -> None:
        """A lost resource is heard again: it is free, unless an operator has it."""
        if resource in self.taken:
            self._withdraw(resource)
        else:
            self._availability.restore(resource)

    def holders(self) -> dict[ResourceId, str]:
        """Who has each resource: an operator, a behavior, or "" when nobody does."""
        return {
            resource: self.taken.get(resource) or self._availability.holder(resource) or ""
            for resource in self._known
        }

    def _withdraw(self, resource: ResourceId) -> None:
        self._availability.withdraw(resource, f"with {self.taken[resource]}")

    def _resource(self, name: str) -> ResourceId:
        resource = ResourceId(name)
        if resource not in self._known:
            hint = did_you_mean(name, self._known)
            raise OperatorError(f"the fleet has no {name!r}; {hint}")
        return resource
