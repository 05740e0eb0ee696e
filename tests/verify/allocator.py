"""An allocator for tests: it serves the requests of one run, at costs that dice say."""

from collections.abc import Sequence
from dataclasses import replace
from random import Random

from m2pem.allocation.assignment import Request, RoleOptions, assign
from m2pem.allocation.candidates import Candidates, Place
from m2pem.allocation.needs import ConsideredRole, Occupancy, RoleEvaluator, Task
from m2pem.engine import inputs as i
from m2pem.engine.data import reader
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.keeping import may_use
from m2pem.engine.run import MissionRun
from m2pem.engine.state import AllocationRequest, BehaviorPhase, RunState
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.losses import UNAVAILABLE


def offers_all(resource: ResourceId) -> Sequence[BehaviorSpec]:
    """Every vehicle and payload offers all shared behaviors, the vehicles also as teams."""
    kind = BehaviorType.PAYLOAD if "/" in resource else BehaviorType.VEHICLE
    own = [spec for spec in SHARED.values() if spec.type is kind]
    if kind is BehaviorType.PAYLOAD:
        return own
    return [*own, *(BehaviorSpec(spec.name, BehaviorType.TEAM) for spec in own)]


def with_vehicles(fleet: Fleet, **tags: str) -> Fleet:
    """The vehicles of a fleet that a mission names, and more aircraft, each with a tag."""
    vehicles = {r: each for r, each in fleet.vehicles.items() if not r.startswith("role")}
    for name, tag in tags.items():
        vehicle = ResourceId(name)
        vehicles[vehicle] = Vehicle(vehicle, Domain.AIR, "sim", {}, tags=(tag,))
    return replace(fleet, vehicles=vehicles)


class Allocator:
    """Answers requests as `m2pem.executive.allocator` does, with dice in place of telemetry."""

    def __init__(self, fleet: Fleet, dice: Random) -> None:
        self.fleet = fleet
        self._dice = dice
        self._graph = ResourceGraph(fleet, offers_all)
        self.order = {r: n for n, r in enumerate((*fleet.vehicles, *fleet.payloads))}
        self._decided: list[i.ResourcesChosen | i.ResourcesNotFree] = []

    def answer(self, run: MissionRun) -> i.Input | None:
        """The next answer to a request; None: those that are left wait. What is decided at one
        moment is answered before the next decision."""
        state = run.state
        self._decided = [each for each in self._decided if each.allocation in state.allocations]
        if not self._decided:
            self._decided = self._decide(state)
        return self._decided.pop(0) if self._decided else None

    def _decide(self, state: RunState) -> list[i.ResourcesChosen | i.ResourcesNotFree]:
        asked = {each.id: self.roles_of(state, each) for each in state.allocations.values()}
        ordered = sorted(
            state.allocations.values(),
            key=lambda each: (-self._priority(asked[each.id]), each.at_us, len(each.id), each.id),
        )
        requests = [
            Request(each.id, tuple(r.options for r in asked[each.id]), _waits(asked[each.id]))
            for each in ordered
        ]
        chosen = assign(requests, self.order)
        found: list[i.ResourcesChosen | i.ResourcesNotFree] = [
            self._chosen(each, asked[each.id], chosen[each.id])
            for each in ordered
            if each.id in chosen
        ]
        return found + [
            i.ResourcesNotFree(each.id, "too few are free", {}, UNAVAILABLE)
            for each in ordered
            if each.id not in chosen and not _waits(asked[each.id])
        ]

    def _priority(self, roles: Sequence[ConsideredRole]) -> int:
        return max(each.role.need.priority for each in roles if each.role.need is not None)

    def roles_of(self, state: RunState, request: AllocationRequest) -> list[ConsideredRole]:
        occupied = {
            ResourceId(resource): Occupancy(holders[-1])
            for resource, holders in state.held.items()
            if any(state.behaviors[h].phase is not BehaviorPhase.CANCELLING for h in holders)
        }
        occupied |= {
            ResourceId(resource): Occupancy(keeping.id)
            for resource, keeping in state.kept.items()
            if not may_use(keeping, request.token)
        }
        evaluator = RoleEvaluator(Candidates(self.fleet, self._graph, lambda _: None))
        behavior = behavior_of(request)
        task = Task(behavior, Place, reader(request.token), (), occupied)
        found = [evaluator.role(each, task) for each in behavior.roles]
        return [replace(each, options=self._with_dice(each.options)) for each in found]

    def _with_dice(self, options: RoleOptions) -> RoleOptions:
        return replace(options, costs_s={each: self._dice.random() for each in options.costs_s})

    def _chosen(
        self,
        request: AllocationRequest,
        roles: Sequence[ConsideredRole],
        chosen: dict[str, tuple[ResourceId, ...]],
    ) -> i.ResourcesChosen:
        filled = {
            each.role.name: resources_of(each.role, self.fleet)
            if each.role.resource
            else chosen[each.role.name]
            for each in roles
            if each.role.name in chosen
        }
        return i.ResourcesChosen(request.id, dict(filled), {})


def _waits(roles: Sequence[ConsideredRole]) -> bool:
    return any(each.role.need is not None and each.role.need.waits for each in roles)
