"""The static check of tasks that may be active at the same time: whether the fleet has vehicles for
all of them (docs/allocation.md).

Tasks that wait for their resources are in nobody's way. One that does not, and finds what it needs
with others, ends with RESOURCE_UNAVAILABLE: an error of the check if that happens to one of several
tasks in every run, else a warning.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
from typing import TypeAlias

import rustworkx

from m2pem.findings import Finding, Severity
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import Behavior, Keep, Role
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.concurrency import (
    HOST,
    INSTANCE,
    ConcurrentTasks,
    Occurrence,
    Together,
    instances_at_once,
)
from m2pem.mission.elements import (
    Activity,
    CallActivity,
    Container,
    EventBasedGateway,
    ExclusiveGateway,
    FlowNode,
    Process,
    SubProcess,
)
from m2pem.mission.events import error_code
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following

UNAVAILABLE = "RESOURCE_UNAVAILABLE"

MOST_SETS = 64
"""Sets of resources for which several tasks compete that are looked at."""

RULE = "tasks-compete"

REMEDY = "say wait= in a role, ask for less, or give the fleet more of them"

Resources: TypeAlias = frozenset[ResourceId]


@dataclass(frozen=True, slots=True)
class Demand:
    """What a task needs while it is active: one resource for each place, of some that may fill it.

    A place is there as often as its role has to be filled. Optional roles have none, and those that
    mean an earlier role's resources: the task before has them, or nobody. `kept`: what earlier
    tasks keep for the run meanwhile, and the task cannot use in place of what it needs.
    """

    behavior: Behavior
    places: tuple[tuple[Role, Resources], ...]
    kept: tuple[tuple[Role, Resources], ...] = ()

    @classmethod
    def of(
        cls, behavior: Behavior, places: Sequence[tuple[Role, Sequence[ResourceId]]]
    ) -> "Demand":
        """Return the demand of a behavior, of what may fill each place in its roles."""
        counted = (
            (role, frozenset(able))
            for role, able in places
            if role.need is None or not role.need.same
        )
        return cls(behavior, tuple(counted))

    @property
    def waits(self) -> bool:
        """Whether the task waits until its resources are free."""
        return any(role.need is not None and role.need.waits for role in self.behavior.roles)

    @property
    def order(self) -> int:
        """Whom it is served before of tasks that begin in one step: the lesser comes first."""
        needs = [role.need.priority for role in self.behavior.roles if role.need is not None]
        return -max(needs) if needs else -(10**9)

    @property
    def named(self) -> Resources:
        """The resources that its roles name."""
        return _united([able for role, able in self.places if role.resource])

    def within(self, resources: Resources) -> int:
        """Return how many of some resources it has in any case."""
        return sum(able <= resources for _, able in (*self.places, *self.kept))


def check_shortages(mission: Mission, demands: Mapping[Activity, Demand]) -> list[Finding]:
    """Check the tasks that may be active together. `demands`: of the tasks that can be filled."""
    chosen = [each for each in demands.values() if each.behavior.allocated_at_start]
    if not chosen:
        return []
    demands = _with_what_is_kept(demands)
    return _Check(mission, demands, ConcurrentTasks(mission, demands.__contains__)).findings()


def _with_what_is_kept(demands: Mapping[Activity, Demand]) -> Mapping[Activity, Demand]:
    """Add to the demand of each task what earlier tasks of its scope keep for the run."""
    kept: dict[Activity, list[tuple[Role, Resources]]] = {}
    for task, demand in demands.items():
        for role, able in demand.places:
            if role.keep not in (Keep.PROCESS, Keep.SUBPROCESS):
                continue
            later = _later_in_scope(task, role.keep)
            if any(map(_splits, (task, *later))):
                continue  # beside several tasks it would count several times
            for other, its in demands.items():
                if other in later and not _may_use(its, role, able):
                    kept.setdefault(other, []).append((role, able))
    if not kept:
        return demands
    return {task: replace(each, kept=tuple(kept.get(task, ()))) for task, each in demands.items()}


def _later_in_scope(task: Activity, keep: Keep) -> list[FlowNode]:
    """Return what comes after a task before its scope ends, but not the task itself."""
    scope: Container = task.container
    waiting: list[FlowNode] = [task]
    while keep is Keep.PROCESS and isinstance(scope, SubProcess):
        waiting.append(scope)
        scope = scope.container
    found: dict[FlowNode, None] = {}
    while waiting:
        entered = following(waiting.pop())
        for each in entered:
            if isinstance(each, SubProcess):
                entered += each.nodes
            if each is not task and each not in found:
                found[each] = None
                waiting.append(each)
    return list(found)


def _splits(node: FlowNode) -> bool:
    """Whether an element may make several tokens of one."""
    if isinstance(node, Activity):
        several = instances_at_once(node) > 1
        beside = any(not each.interrupting for each in node.boundary)
        container = node if isinstance(node, SubProcess) else None
        events = container is not None and bool(container.event_subprocesses)
        return several or beside or events or len(node.outgoing) > 1
    one = isinstance(node, ExclusiveGateway | EventBasedGateway)
    return len(node.outgoing) > 1 and not one


def _may_use(demand: Demand, role: Role, able: Resources) -> bool:
    """Whether a task may have what an earlier role keeps as what it needs itself, or ends the
    keeping. One with `same` has what is kept, and no place for it."""
    if any(not able.isdisjoint(its) for _, its in demand.places):
        return True
    store = role.need.store if role.need is not None else ""
    return any(
        each.keep is Keep.TASK and each.need is not None and each.need.same == store
        for each in demand.behavior.roles
    )


@dataclass(slots=True)
class _Check:
    mission: Mission
    demands: Mapping[Activity, Demand]
    tasks: ConcurrentTasks

    def findings(self) -> list[Finding]:
        found: list[Finding] = []
        reported: list[frozenset[Activity]] = []
        begun = self.tasks.begun_together()
        for together in begun.values():
            if any(each.issubset(together) for each in reported):
                continue  # a smaller fork in this one
            violation = self._too_few([t for t in together if not self.demands[t].waits])
            if self._is_by_need(violation):
                reported.append(frozenset(violation))
                found.append(self._certain(violation))
        order = {n: self._order(tasks) for n, tasks in self.tasks.begun_first().items()}
        for resources in self._sets():
            for group in self.tasks.heaviest(partial(self._within, resources)):
                tasks = {each.task for each in group.tasks}
                if group.weight <= len(resources) or any(each <= tasks for each in reported):
                    continue
                for late, others in self._late(group, resources, order):
                    if self._is_by_need({late, *others}):
                        reported.append(frozenset({late, *others}))
                        found.append(self._possible(late, others, resources))
                        break
        return found

    def _order(self, tasks: Sequence[Activity]) -> dict[Activity, int]:
        """Return in which order tasks are served that begin in one step."""
        in_order = sorted(dict.fromkeys(tasks), key=lambda task: self.demands[task].order)
        return {task: number for number, task in enumerate(in_order)}

    def _is_by_need(self, tasks: Collection[Activity]) -> bool:
        return any(self.demands[task].behavior.allocated_at_start for task in tasks)

    def _within(self, resources: Resources, task: Activity) -> int:
        demand = self.demands.get(task)
        return demand.within(resources) if demand is not None else 0

    # --- tasks that begin together ----------------------------------------------------------------

    def _too_few(self, tasks: Sequence[Activity]) -> list[Activity]:
        """Return tasks of which not all can get what they need at once; none: all can."""
        places = [(task, resources) for task in tasks for _, resources in self.demands[task].places]
        while easy := [each for each in places if len(each[1]) >= len(places)]:
            places = [each for each in places if each not in easy]  # these find one in any case
        alike: dict[Resources, list[Activity]] = {}
        for task, resources in places:
            alike.setdefault(resources, []).append(task)
            if len(alike[resources]) > len(resources):
                return alike[resources]
        return [places[each][0] for each in _violating([able for _, able in places])]

    def _certain(self, tasks: Sequence[Activity]) -> Finding:
        last = max(dict.fromkeys(reversed(tasks)), key=lambda task: self.demands[task].order)
        resources = _united([able for task in tasks for _, able in self.demands[task].places])
        caught = all(_is_caught(task, self.mission) for task in tasks)
        outcome = "one of them ends with " + UNAVAILABLE + " in every run"
        return TaskFindings(self.mission.file_of(last), last).add(
            RULE,
            f"{self._named(tasks)} begin at once, do not wait, and need more than there are of "
            f"{_listed(resources)}: {outcome}",
            REMEDY,
            line=self.demands[last].behavior.line,
            severity=Severity.WARNING if caught else Severity.ERROR,
        )

    # --- tasks that may be active together --------------------------------------------------------

    def _sets(self) -> list[Resources]:
        """Return the sets of resources that tasks may compete for, the smallest first."""
        found = dict.fromkeys(
            able
            for demand in self.demands.values()
            for role, able in demand.places
            if role.need is not None
        )
        sets = sorted(found, key=len)
        for one in sets:
            for other in list(found):
                union = one | other
                if len(found) < MOST_SETS and not one.isdisjoint(other) and union not in found:
                    found[union] = None
                    sets.append(union)
        return sorted(sets, key=len)

    def _late(
        self, group: Together, resources: Resources, order: Mapping[int, Mapping[Activity, int]]
    ) -> Iterator[tuple[Activity, list[Activity]]]:
        """Yield tasks that do not wait and may find nothing, each with those that have it then."""
        weighted = [(each, self._within(resources, each.task)) for each in group.tasks]
        for late, own in weighted:
            if self.demands[late.task].waits or _is_caught(late.task, self.mission):
                continue
            others: list[Activity] = []
            demand = self.demands[late.task]
            total = own - sum(able <= resources for _, able in demand.kept)
            named = demand.named
            for other, more in sorted(weighted, key=lambda each: -each[1]):
                if other is late or total > len(resources):
                    continue
                its = self.demands[other.task].named
                if named.isdisjoint(its) and not _asks_before(late, other, order):
                    others.append(other.task)
                    total += more
                    named |= its
            if total > len(resources):
                yield late.task, others

    def _possible(
        self, late: Activity, others: Sequence[Activity], resources: Resources
    ) -> Finding:
        own = self._roles(late, resources, kept=False)
        return TaskFindings(self.mission.file_of(late), late).add(
            RULE,
            f"{own} may find none of {_listed(resources)} free, and does not wait: "
            f"{self._named(others, resources)} may have them at that time; it would end with "
            + UNAVAILABLE,
            f"{REMEDY}; or catch {UNAVAILABLE}",
            line=self.demands[late].behavior.line,
            severity=Severity.WARNING,
        )

    # --- words ------------------------------------------------------------------------------------

    def _named(self, tasks: Sequence[Activity], resources: Resources | None = None) -> str:
        counts: dict[Activity, int] = {}
        for task in tasks:
            counts[task] = counts.get(task, 0) + 1
        said = []
        for task, count in counts.items():
            places = 1 if resources is not None else len(self.demands[task].places)
            often = ", several instances" if count // places > 1 else ""
            said.append(f"{task.label} ({self._roles(task, resources)}{often})")
        return joined(said)

    def _roles(self, task: Activity, resources: Resources | None, *, kept: bool = True) -> str:
        demand = self.demands[task]
        names = dict.fromkeys(
            f"'{role.name}'"
            for role, able in (*demand.places, *(demand.kept if kept else ()))
            if resources is None or able <= resources
        )
        return f"role{'s' if len(names) > 1 else ''} {joined(list(names))}"


def _asks_before(
    one: Occurrence, other: Occurrence, order: Mapping[int, Mapping[Activity, int]]
) -> bool:
    """Whether a task certainly asks for its resources before another one of the same group."""
    for mine, its in zip_longest(one.where, other.where):
        if mine == its:
            continue
        if mine is None or its is None or INSTANCE in (mine[0], its[0]):
            return False
        if mine[0] == its[0] and HOST in (mine[1], its[1]):
            return mine[1] == HOST and one.where[-1] == mine
        begun = order.get(mine[0], {})
        if one.task not in begun:
            return False
        return other.task not in begun or begun[one.task] < begun[other.task]
    return False


def _violating(places: Sequence[Resources]) -> list[int]:
    """Return the numbers of places that together have fewer resources than they are; none: each
    can have one of its own (Hall)."""
    graph: rustworkx.PyGraph = rustworkx.PyGraph(multigraph=False)
    graph.add_nodes_from(range(len(places)))
    nodes: dict[ResourceId, int] = {}
    for place, resources in enumerate(places):
        for resource in sorted(resources):
            if resource not in nodes:
                nodes[resource] = graph.add_node(resource)
            graph.add_edge(place, nodes[resource], 1)
    pairs = rustworkx.max_weight_matching(graph, max_cardinality=True)
    owner = {max(pair): min(pair) for pair in pairs}
    unfilled = set(range(len(places))) - set(owner.values())
    if not unfilled:
        return []
    # Whatever an alternating path leads to from a place that is not filled.
    found = [min(unfilled)]
    for place in found:
        for resource in sorted(places[place]):
            holder = owner[nodes[resource]]
            if holder not in found:
                found.append(holder)
    return sorted(found)


def _is_caught(task: Activity, mission: Mission) -> bool:
    """Whether an event catches that a task finds its resources with others."""
    waiting: list[Activity] = [task]
    for activity in waiting:
        container = activity.container
        events = (*activity.boundary, *(s for e in container.event_subprocesses for s in e.starts))
        codes = {error_code(each) for event in events for each in event.definitions}
        if not codes.isdisjoint({"", UNAVAILABLE}):
            return True
        if isinstance(container, SubProcess):
            waiting.append(container)
        elif isinstance(container, Process):
            waiting += [
                node
                for node in mission.nodes
                if isinstance(node, CallActivity)
                and node.called is container
                and node not in waiting
            ]
    return False


def _united(sets: Sequence[Resources]) -> Resources:
    return frozenset(each for resources in sets for each in resources)


NAMED = 6
"""Resources that a finding names; it counts the others."""


def _listed(resources: Resources) -> str:
    names = sorted(resources)
    more = len(names) - NAMED
    return ", ".join(names[:NAMED]) + (f" and {more} others" if more > 0 else "")


def joined(words: Sequence[str]) -> str:
    """Return words as a sentence lists them; many are counted."""
    if len(words) > NAMED:
        return f"{', '.join(words[:NAMED])} and {len(words) - NAMED} others"
    return " and ".join((", ".join(words[:-1]), words[-1])) if len(words) > 1 else "".join(words)
