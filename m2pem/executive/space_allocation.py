"""Reserves space for what the allocator chooses.

A task that waits for space holds none. Later tasks get nothing that it needs, neither the space nor
its vehicles, as long as behaviors that will end are in its way: so it is not overtaken for ever. A
vehicle at rest in its way, or that is lost, may stay there: what the task needs is then free for
others.
"""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from m2pem.api.arbiter import BehaviorId, BehaviorRequest
from m2pem.executive.separation import VehicleSeparation
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Occupant, Refusal
    from m2pem.deconfliction.reservations import Reservation


class SpaceAllocation:
    """The space that requests for resources need, while one decision is made.

    A decision has rounds: each looks at all requests in their order, until all that are chosen have
    their space.
    """

    def __init__(self, separation: VehicleSeparation) -> None:
        self._separation = separation
        self._proposed: dict[str, Reservation | None] = {}
        self._kept_back: dict[str, Reservation] = {}
        self._kept_before: dict[str, Reservation] = {}
        self._kept_for_next: dict[str, Reservation] = {}
        self._ahead: list[Reservation] = []

    def awaits_positions(self) -> bool:
        """Whether to decide later: a vehicle that has not said where it is may be in the way."""
        return bool(self._separation.awaited())

    def begin(self) -> None:
        """Begin a decision."""
        self._kept_back.clear()
        self._kept_before, self._kept_for_next = self._kept_for_next, {}

    def begin_round(self) -> None:
        """Look at all requests again, from the first."""
        self._ahead.clear()
        self._proposed.clear()

    def refusal(self, request: BehaviorRequest, spec: BehaviorSpec) -> "Refusal | None":
        """Return why a request has no space now; None: it has, ahead of those that follow."""
        wanted = self._separation.propose(request, spec)
        if wanted is None:
            return None
        found = self._separation.conflict(wanted, self._ahead, spec)
        if found is None:
            self._proposed[request.id] = wanted
            self._ahead.append(wanted)
        elif found.wait_s is not None and found.blockers and all(map(_ends, found.blockers)):
            self._kept_back.setdefault(request.id, wanted)
        return found

    def refusal_after(
        self,
        request: BehaviorRequest,
        spec: BehaviorSpec,
        ended: Collection[str],
        before: Collection[str],
    ) -> "Refusal | None":
        """Return why a request has no space when the behaviors of `ended` have ended, whose
        vehicles it takes; None: it has, and keeps it from now on.

        `before`: the requests that come before it and wait. If it waits for behaviors that will
        end, the space is not for those that follow, from the next decision on.
        """
        wanted = self._separation.propose(request, spec)
        if wanted is None:
            return None
        ahead = [each for each in self._ahead if each.request.id in before]
        found = self._separation.conflict(wanted, ahead, spec, ended)
        if found is None:
            self._separation.reservations.commit(wanted)
        elif found.wait_s is not None and found.blockers and all(map(_ends, found.blockers)):
            self._kept_for_next[request.id] = wanted
        return found

    def keep_back(self, request: str) -> None:
        """A request waits: what it needs is not for those that follow."""
        kept = self._kept_back.get(request) or self._kept_before.get(request)
        if kept is not None:
            self._ahead.append(kept)

    def kept_with(self, request: str) -> Sequence[ResourceId]:
        """Return the resources for which a request waits for space; (): it keeps none."""
        kept = self._kept_back.get(request)
        return () if kept is None else kept.request.resources

    def commit(self, request: str) -> None:
        """Reserve the space of a request that is served."""
        wanted = self._proposed.get(request)
        if wanted is not None:
            self._separation.reservations.commit(wanted)

    def hand_on(self, request: str, behavior: str) -> None:
        """Give what is reserved for a request to the behavior that was requested for it."""
        self._separation.reservations.hand_on(BehaviorId(request), BehaviorId(behavior))

    def release(self, request: str) -> None:
        """A request is served no more."""
        self._kept_for_next.pop(request, None)
        self._separation.reservations.withdraw(BehaviorId(request))


def _ends(blocker: "Occupant") -> bool:
    """Whether a vehicle is in the way only as long as a behavior goes on."""
    return bool(blocker.behavior) and not blocker.lost


def holders_of(refusal: "Refusal") -> dict[str, str]:
    """Return who has the space that a task waits for: behaviors, and vehicles at rest there.

    The keys are the name of the shared space, or that of the vehicle which is in the way.
    """
    if not refusal.space:
        return {each.vehicle: each.behavior or each.vehicle for each in refusal.blockers}
    return {refusal.space: ", ".join(each.behavior or each.vehicle for each in refusal.blockers)}
