"""Requests for resources, as the allocator looks at them."""

from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.allocation.needs import ConsideredRole, RoleEvaluator, Task, reads_candidate_alone
from m2pem.api.arbiter import BehaviorRequest
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.inputs import ResourcesChosen
from m2pem.engine.state import AllocationRequest
from m2pem.executive.preemption import priority_of
from m2pem.executive.runner import Runner
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.losses import TAKEN_OVER, may_return


@dataclass(slots=True)
class AskedFor:
    """A request that has no behavior yet. `chosen`: its resources are held for it. `lacks`: what
    its run knows that it lacks, without the values of telemetry, which change all the time.
    `preempts`: what is taken from other runs for it, and given when their behaviors have ended.
    `place`: its place in the order in which requests are served; None: it was not looked at yet.
    `need`: what its task waits for, equal for all that wait for the same; None: what it needs may
    be another at each decision."""

    runner: Runner
    chosen: bool = False
    lacks: object = None
    preempts: "Preempting | None" = None
    place: tuple[int, int, int, str] | None = None
    need: tuple[object, ...] | None = None

    def look_at(self, request: AllocationRequest) -> tuple[int, int, int, str]:
        """Find its place in the order, and what it needs, once. Returns its place."""
        if self.place is None:
            roles = behavior_of(request).roles
            # Of one moment and run, r1.a2 asked before r1.a10.
            self.place = -priority_of(roles), request.at_us, len(request.id), request.id
            self.need = _constant_need(request)
        return self.place


@dataclass(frozen=True, slots=True)
class Preempting:
    """What was chosen for a request, and the behaviors that have to end first. `wanted`: the
    behavior that is requested then, for which space is reserved; None: it needs none."""

    answer: ResourcesChosen
    resources: tuple[ResourceId, ...]
    behaviors: frozenset[str]
    wanted: tuple[BehaviorRequest, BehaviorSpec] | None


@dataclass(frozen=True, slots=True)
class ConsideredRequest:
    """A request with all that may fill its roles."""

    asked: AskedFor
    request: AllocationRequest
    task: Task
    roles: tuple[ConsideredRole, ...]

    @property
    def priority(self) -> int:
        """The greatest priority of its roles."""
        return priority_of(each.role for each in self.roles)

    @property
    def waits(self) -> bool:
        """Whether its task waits until resources are free; one that waits for space does."""
        asked = any(each.role.need is not None and each.role.need.waits for each in self.roles)
        return asked or self.request.deadline != 0

    @property
    def in_turn(self) -> bool:
        """Whether it queues for resources: it does not if it names them, and waits for space at
        most. So what brings a vehicle down by its name need not wait for what another task keeps.
        """
        roles = [each.role for each in self.roles]
        return any(not r.resource or (r.need is not None and r.need.waits) for r in roles)

    @property
    def named_vehicles(self) -> frozenset[ResourceId]:
        """The resources that its roles name, or an operator."""
        return frozenset(one for role in self.roles if role.named for one in role.resources)

    def filled(
        self, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> dict[str, tuple[ResourceId, ...]]:
        """Return what fills each role, a named team, and what an operator named, in their order."""
        return {
            role.role.name: role.resources if role.named else chosen[role.role.name]
            for role in self.roles
            if role.role.name in chosen
        }

    def is_hopeless(self, evaluator: RoleEvaluator) -> bool:
        """Whether what is left of a lost behavior will be done by no other, however long it waits.

        Of a vehicle that a pilot has taken, not an operator, it is not known when it is given back.
        """
        if self.request.token.lost_work is None:
            return False
        lost, taken = self.task.lost, self.asked.runner.run.state.taken
        returns = {
            name
            for name, loss in lost.items()
            if may_return(loss.code) and (loss.code != TAKEN_OVER or name in taken)
        }
        for considered in self.roles:
            role = considered.role
            if considered.named:
                continue
            same = role.need is not None and role.need.same
            gone = lost.keys() if same else lost.keys() - returns
            able = [e for e in evaluator.ever(role, self.task) if e not in gone]
            if len(able) < considered.options.least:
                return True
        return False


def _constant_need(request: AllocationRequest) -> tuple[object, ...] | None:
    """Return what a request needs if that is one resource, depends on facts of the candidates alone
    and not on the task's place, and its task waits."""
    behavior = behavior_of(request)
    token = request.token
    if len(behavior.roles) != 1 or token.lost_work is not None or token.replacements:
        return None
    role = behavior.roles[0]
    need = role.need
    if role.resource or role.optional or need is None or need.least != 1 or need.same:
        return None
    waits = need.waits or request.deadline != 0
    if not waits or not all(map(reads_candidate_alone, need.expressions)):
        return None
    return role.name, role.kind, need.condition, need.preference, behavior.name, behavior.type
