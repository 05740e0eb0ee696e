"""Which resources may be given to a behavior now (the paper's availability information).

A resource is unavailable for a reason (lost, taken over, manned), or held by one behavior, or free.
A vehicle and its payloads are apart in both: a lost radio of the vehicle says nothing about a
camera with a link of its own. Pure: the executive tells it what happened.
"""

from collections.abc import Collection, Iterable

from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import ResourceId

MANNED = "manned"


class Availability:
    """The one ledger of an executive, across all its runs. Behavior ids are unique in it."""

    def __init__(self, fleet: Fleet) -> None:
        self._resources = frozenset({*fleet.vehicles, *fleet.payloads})
        self._unavailable = {v.id: MANNED for v in fleet.vehicles.values() if v.manned}
        self._holders: dict[ResourceId, str] = {}

    def withdraw(self, resource: ResourceId, reason: str) -> None:
        """No behavior gets the resource until `restore`. Its holder, if any, keeps holding it.

        Raises:
            KeyError: the fleet has no such resource.
        """
        if resource not in self._resources:
            raise KeyError(resource)
        self._unavailable[resource] = reason

    def restore(self, resource: ResourceId) -> None:
        """Behaviors may get the resource again; a manned vehicle, too, once it is handed over."""
        self._unavailable.pop(resource, None)

    def reason(self, resource: ResourceId) -> str:
        """Why a resource is unavailable, or "" when it is not."""
        if resource not in self._resources:
            return "not in the fleet"
        return self._unavailable.get(resource, "")

    def holder(self, resource: ResourceId) -> str | None:
        """The behavior that holds a resource."""
        return self._holders.get(resource)

    def held_by(self, behavior: str) -> tuple[ResourceId, ...]:
        """What a behavior holds."""
        return tuple(r for r, holder in self._holders.items() if holder == behavior)

    def acquire(
        self, resources: Iterable[ResourceId], behavior: str, preempts: Collection[str] = ()
    ) -> str | None:
        """Give all of `resources` to `behavior`, or none.

        `preempts`: behaviors that are being cancelled; what they hold passes to the new one at
        once. Returns None, or why not, for a person. Asking again for what is held is no error.
        """
        wanted = tuple(dict.fromkeys(resources))
        refusals = [self._refusal(resource, behavior, preempts) for resource in wanted]
        if any(refusals):
            return "; ".join(refusal for refusal in refusals if refusal)
        self._holders.update((resource, behavior) for resource in wanted)
        return None

    def _refusal(self, resource: ResourceId, behavior: str, preempts: Collection[str]) -> str:
        reason = self.reason(resource)
        if reason:
            return f"{resource} is unavailable: {reason}"
        holder = self._holders.get(resource, behavior)
        if holder != behavior and holder not in preempts:
            return f"{resource} is held by behavior {holder}"
        return ""

    def release(self, behavior: str) -> None:
        """The behavior has ended. What passed on to another one stays with that."""
        for resource in self.held_by(behavior):
            del self._holders[resource]
