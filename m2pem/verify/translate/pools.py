"""Pools: which vehicles and payloads are interchangeable for the tasks that choose among them.

A pool is a place with a token for each of its resources that is free. A task that is given one
takes a token; whatever ends the task gives it back. Resources that may fill the same roles are one
pool, unless something distinguishes them: a task names one of them, the choice of one is stored and
read, or a requirement is about it.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, islice

from m2pem.errors import ExpressionError
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import ENDING_PARAMETERS, SHARED
from m2pem.fleet.facts import fleet_facts, possible_resources
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.graph import Catalogue, ResourceGraph
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior, BehaviorType, Role
from m2pem.mission.candidate_facts import FLEET_FACTS
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.expression.partial import possible_truth
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.translate.domains import MOST_VALUES

Pool = tuple[ResourceId, ...]
"""Interchangeable resources, in the order of the fleet file."""


@dataclass(frozen=True, slots=True)
class RoleCandidates:
    """What may fill a role of a task. Of a role that names its resource, all of them do, together.

    `unknown`: names of facts and data on which it depends whether some of them may.
    """

    role: Role
    resources: tuple[ResourceId, ...]
    unknown: frozenset[str] = frozenset()

    @property
    def named(self) -> bool:
        """Whether the mission names what fills the role."""
        return bool(self.role.resource)


Candidates = Mapping[e.FlowNode, Sequence[RoleCandidates]]
"""The roles of each task whose resources are chosen, or waited for, when it starts."""


def candidates_of(mission: Mission, fleet: Fleet, catalogue: Catalogue | None) -> Candidates:
    """Return the roles of each task that asks for resources when it starts.

    `catalogue`: what each resource offers; None: each offers all that the mission asks for.
    """
    asking = [
        (node, behavior) for node, behavior in behaviors(mission) if behavior.allocated_at_start
    ]
    if not asking:
        return {}
    graph = ResourceGraph(fleet, catalogue or _offers_all(mission))
    return {
        node: tuple(_role(fleet, graph, behavior, role) for role in behavior.roles)
        for node, behavior in asking
    }


def behaviors(mission: Mission) -> Iterator[tuple[e.FlowNode, Behavior]]:
    """Yield the tasks that command a behavior, with it."""
    for node in mission.nodes:
        behavior = getattr(node, "behavior", None)
        if isinstance(behavior, Behavior):
            yield node, behavior


def _offers_all(mission: Mission) -> Catalogue:
    """The catalogue of a fleet whose arbiters are not known."""
    wanted = dict.fromkeys((each.name, each.type) for _, each in behaviors(mission))
    offered = [SHARED.get((name, kind)) or BehaviorSpec(name, kind) for name, kind in wanted]
    on_payloads = [each for each in offered if each.type is BehaviorType.PAYLOAD]
    on_vehicles = [each for each in offered if each.type is not BehaviorType.PAYLOAD]
    return lambda resource: on_payloads if "/" in resource else on_vehicles


def goes_on(
    behavior: Behavior, resources: Sequence[ResourceId], catalogue: Catalogue | None
) -> bool:
    """Whether a behavior ends only when something interrupts it, whatever has it of `resources`."""
    if any(each.name in ENDING_PARAMETERS for each in behavior.parameters):
        return False
    key = (behavior.name, behavior.type)
    if catalogue is None:
        specs = [SHARED.get(key)]
    else:
        specs = [
            next((spec for spec in catalogue(each) if (spec.name, spec.type) == key), None)
            for each in resources
        ]
    return bool(specs) and all(spec is not None and not spec.ends for spec in specs)


def _role(fleet: Fleet, graph: ResourceGraph, behavior: Behavior, role: Role) -> RoleCandidates:
    if role.resource:
        return RoleCandidates(role, resources_of(role, fleet))
    try:
        found = possible_resources(fleet, graph, behavior, role)
    except ExpressionError:  # `m2pem check` says so; the task ends with error EXPRESSION
        return RoleCandidates(role, ())
    unknown: frozenset[str] = frozenset()
    if role.need is not None and (condition := role.need.condition) is not None:
        known = FLEET_FACTS.__contains__
        if any(
            possible_truth(condition, known, fleet_facts(fleet, graph, each).get) is None
            for each in found
        ):
            unknown = frozenset(name for name in condition.names if not known(name))
    return RoleCandidates(role, found, unknown)


def stored_values(candidates: Candidates) -> Mapping[e.FlowNode, Mapping[str, list[Value] | None]]:
    """By task and name, what a task may store there; None: more values than are followed."""
    return {
        node: {
            each.role.need.store: _stored(each)
            for each in roles
            if each.role.need is not None and each.role.need.store
        }
        for node, roles in candidates.items()
    }


def _stored(each: RoleCandidates) -> list[Value] | None:
    need = each.role.need
    assert need is not None
    if need.most == 1:
        return list(each.resources)
    lists: Iterator[list[Value]] = (
        list(some)
        for count in range(need.least, min(need.most, len(each.resources)) + 1)
        for some in combinations(each.resources, count)
    )
    found: list[Value] = list(islice(lists, MOST_VALUES + 1))
    return found if len(found) <= MOST_VALUES else None


def pools_of(
    mission: Mission,
    fleet: Fleet,
    candidates: Candidates,
    followed: Collection[str],
    distinguished: Collection[str],
    likeness: Callable[[ResourceId], object] = lambda _: None,
) -> Mapping[ResourceId, Pool]:
    """Return the pool of each resource that some task may be given.

    `followed`: names of data whose values the net distinguishes. `distinguished`: resources that
    requirements name. `likeness`: must be equal of the resources of a pool.
    """
    alone: set[ResourceId] = set()
    roles_of: dict[ResourceId, list[tuple[str, str]]] = {}
    for node, roles in candidates.items():
        for each in roles:
            need = each.role.need
            for resource in each.resources:
                roles_of.setdefault(resource, []).append((node.id, each.role.name))
            if each.named or (need is not None and {need.store, need.same} & {*followed}):
                alone.update(each.resources)
    alone |= {ResourceId(each) for each in distinguished} & roles_of.keys()
    alone |= _named_with(mission, fleet, roles_of.keys())
    alike: dict[object, list[ResourceId]] = {}
    for resource in (*fleet.vehicles, *fleet.payloads):
        if resource in alone or resource in roles_of:
            asked = tuple(roles_of.get(resource, ()))
            key = resource if resource in alone else (likeness(resource), *asked)
            alike.setdefault(key, []).append(resource)
    return {resource: tuple(pool) for pool in alike.values() for resource in pool}


def _named_with(
    mission: Mission, fleet: Fleet, chosen: Collection[ResourceId]
) -> frozenset[ResourceId]:
    """Return what is named by tasks that need something which other tasks may be given: the names
    of those resources, and of all that such tasks hold with them.
    """
    tasks = [
        frozenset(
            each for role in behavior.roles if role.resource for each in resources_of(role, fleet)
        )
        for _, behavior in behaviors(mission)
        if any(role.resource for role in behavior.roles)
    ]
    found: set[ResourceId] = set()
    taken = {*chosen}
    while more := [task for task in tasks if task & taken and not task <= found]:
        found.update(*more)
        taken |= found
    return frozenset(found)
