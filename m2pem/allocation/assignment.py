"""Chooses resources for the roles of all tasks that ask, together.

A task gets resources for all of its roles, or none. Tasks are served in their order: by priority,
then by the time at which they asked. A later one gets nothing that an earlier one could have. Among
all choices that serve the same tasks, the one of least cost is taken; of equal ones the one whose
resources come first in the fleet. The same requests always get the same answer.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from m2pem.mission.catalogue import ResourceId

MILLISECONDS = 1_000
MAX_COST_S = 1e6
"""A cost in seconds is not more than that: the solver computes with doubles, exactly."""


@dataclass(frozen=True, slots=True)
class RoleOptions:
    """What may fill a role. `costs_s`: of each resource that is free, in seconds of travel time.
    `busy`: resources that could fill it, and are not free now, but will be."""

    name: str
    least: int
    most: int
    costs_s: Mapping[ResourceId, float]
    busy: Collection[ResourceId] = ()


@dataclass(frozen=True, slots=True)
class Request:
    """A task that asks for resources: its id and its roles. `waits`: until it can have them; while
    it waits for several, later ones do not get those of them that are free, nor what it `keeps`.
    `in_turn`: it does not get what those before it keep."""

    id: str
    roles: tuple[RoleOptions, ...]
    waits: bool = True
    keeps: Collection[ResourceId] = ()
    in_turn: bool = True


@dataclass(slots=True)
class _Slot:
    """A place for one resource in a role."""

    request: str
    role: RoleOptions
    options: Collection[ResourceId]


class _Matching:
    """A matching of slots and resources that grows by augmenting paths."""

    def __init__(self) -> None:
        self.slots: list[_Slot] = []
        self._slot_of: dict[ResourceId, int] = {}
        self._full: set[ResourceId] = set()

    def add(self, slots: Sequence[_Slot]) -> bool:
        """Add slots if all can be filled beside those that were added before."""
        if len(slots) == 1 and self._full.issuperset(slots[0].options):
            return False
        before = dict(self._slot_of) if len(slots) > 1 else self._slot_of
        count = len(self.slots)
        for slot in slots:
            self.slots.append(slot)
            if not self._fill(len(self.slots) - 1, is_first=slot is slots[0]):
                self._slot_of = before
                del self.slots[count:]
                return False
        return True

    def _fill(self, index: int, *, is_first: bool) -> bool:
        """Find an augmenting path from an empty slot, breadth first.

        What a search in vain has reached is left out of all later ones: the slots that have it can
        have nothing else. `is_first`: the matching is not taken back if there is no path.
        """
        came_from: dict[ResourceId, tuple[int, ResourceId | None]] = {}
        queue: list[tuple[int, ResourceId | None]] = [(index, None)]
        for slot, through in queue:
            for resource in self.slots[slot].options:
                if resource in came_from or resource in self._full:
                    continue
                came_from[resource] = (slot, through)
                owner = self._slot_of.get(resource)
                if owner is not None:
                    queue.append((owner, resource))
                    continue
                step: ResourceId | None = resource
                while step is not None:
                    filled, before = came_from[step]
                    self._slot_of[step] = filled
                    step = before
                return True
        if is_first:
            self._full.update(came_from)
        return False

    def resources_of(self, request: str) -> list[ResourceId]:
        """Return the resources in the slots of a request, as matched."""
        return [each for each, slot in self._slot_of.items() if self.slots[slot].request == request]

    def resources_of_all(self) -> list[ResourceId]:
        """Return the resources in all slots, as matched."""
        return list(self._slot_of)


def load_solver() -> None:
    """Load the solver: it takes up to seconds, in which an event loop must not wait for it."""
    import scipy.optimize  # noqa: F401, PLC0415  # only missions with roles by need have to load it


def assign(
    requests: Sequence[Request],
    order: Mapping[ResourceId, int],
    kept: dict[ResourceId, str] | None = None,
) -> dict[str, dict[str, tuple[ResourceId, ...]]]:
    """Return by request and role what fills it; a request that must wait is left out.

    `requests`: the first comes first. `order`: the place of each resource in the fleet. `kept` gets
    the free resources that are kept from later requests, with the request that waits.
    """
    matching = _Matching()
    served: list[Request] = []
    kept = {} if kept is None else kept
    for request in requests:
        if matching.add(list(_slots(request, kept if request.in_turn else ()))):
            served.append(request)
            continue
        keeps = [*request.keeps]
        if request.waits:
            keeps += _kept_for(request, {*kept, *keeps}, matching)
        for each in keeps:
            kept.setdefault(each, request.id)
    for request in served:
        for role in request.roles:
            options = _without(role.costs_s, kept)
            for _ in range(role.most - role.least):
                if not matching.add([_Slot(request.id, role, options)]):
                    break
    return _of_least_cost(matching.slots, order)


def _slots(request: Request, kept: Collection[ResourceId]) -> Iterator[_Slot]:
    for role in request.roles:
        options = _without(role.costs_s, kept)
        for _ in range(role.least):
            yield _Slot(request.id, role, options)


def _without(
    resources: Collection[ResourceId], kept: Collection[ResourceId]
) -> Collection[ResourceId]:
    return [each for each in resources if each not in kept] if kept else resources


def _kept_for(
    request: Request, kept: Collection[ResourceId], matching: _Matching
) -> Iterable[ResourceId]:
    """Return the free resources that later requests may not take from one that waits for others.

    Nothing, if what it needs will not be free: it would keep resources for ever.
    """
    if sum(role.least for role in request.roles) == 1:
        return ()  # nothing that could fill its one place is free
    could = {each for role in request.roles for each in role.costs_s}
    if could <= set(kept):
        return ()
    free = could.difference(kept, matching.resources_of_all())
    alone = _Matching()
    slots = [
        _Slot(
            request.id,
            role,
            dict.fromkeys((*(e for e in role.costs_s if e in free), *role.busy, *role.costs_s)),
        )
        for role in request.roles
        for _ in range(role.least)
    ]
    if not alone.add(slots):
        return ()
    keeps = free.intersection(alone.resources_of(request.id))
    for role in request.roles:
        if role.least and free.isdisjoint(role.costs_s.keys() - keeps):
            # Nor do later ones get what it could have where those before it are given others.
            keeps.update(role.costs_s)
    return keeps


def _of_least_cost(
    slots: Sequence[_Slot], order: Mapping[ResourceId, int]
) -> dict[str, dict[str, tuple[ResourceId, ...]]]:
    """Fill all slots at the least cost; the caller knows that all can be filled."""
    if not slots:
        return {}
    # Only a mission with roles by need has to load them.
    import numpy as np  # noqa: PLC0415
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    every = set[ResourceId]().union(*(slot.options for slot in slots))
    resources = sorted(every, key=order.__getitem__)
    column = {resource: place for place, resource in enumerate(resources)}
    costs = np.full((len(slots), len(resources)), np.inf)
    for row, slot in enumerate(slots):
        known_s, options = slot.role.costs_s, slot.options
        values = known_s.values() if options is known_s else map(known_s.__getitem__, options)
        places = np.fromiter(map(column.__getitem__, options), np.intp, len(options))
        costs_s = np.fromiter(values, np.float64, len(options))
        whole_ms = np.rint(np.clip(costs_s, -MAX_COST_S, MAX_COST_S) * MILLISECONDS)
        costs[row, places] = whole_ms * len(resources) + places
    rows, columns = linear_sum_assignment(costs)
    chosen: dict[str, dict[str, list[ResourceId]]] = {}
    for row, place in zip(rows.tolist(), columns.tolist(), strict=True):
        slot = slots[row]
        chosen.setdefault(slot.request, {}).setdefault(slot.role.name, []).append(resources[place])
    return {
        request: {role: tuple(sorted(ids, key=order.__getitem__)) for role, ids in roles.items()}
        for request, roles in chosen.items()
    }
