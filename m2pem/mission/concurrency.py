"""Which tasks of a mission may be active at the same time, by its structure alone.

Tokens come to be several at *forks*: gateways and activities with several outgoing flows, several
starts of a process or subprocess, non-interrupting boundary events, and activities of which several
may be begun. What only one branch of a fork leads to may be active together with what only another
one leads to. No states are searched: `m2pem verify` does that.

Nothing is said to be together that may exclude each other: elements behind conditions that read the
same data, or behind a signal, message or condition that another element of the mission brings
about. Whether one condition can be true by itself is not asked.
"""

import heapq
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from m2pem.errors import ExpressionError
from m2pem.mission.elements import (
    Activity,
    AdHocOrdering,
    AdHocSubProcess,
    BoundaryEvent,
    CallActivity,
    Container,
    Event,
    EventBasedGateway,
    ExclusiveGateway,
    FlowNode,
    Gateway,
    InclusiveGateway,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    ManualTask,
    ParallelGateway,
    ReceiveTask,
    SequenceFlow,
    StartEvent,
    SubProcess,
    Task,
    UserTask,
    thrown_by,
)
from m2pem.mission.events import (
    ConditionalEventDefinition,
    EventDefinition,
    signals_and_messages,
)
from m2pem.mission.loops import MultiInstance
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following, reach

MOST_INSTANCES = 10_000
"""Instances of an activity that are counted; there are no such fleets."""

MOST_NESTED = 60
"""Forks in each other that are looked into: recursion has a limit."""

HOST = -1
"""The branch of an activity at whose border are non-interrupting events."""

INSTANCE, EVENT_SUBPROCESS = -1, -2
"""Instead of a fork's number: instances of an activity, and event subprocesses, branch as well."""

Where: TypeAlias = tuple[tuple[int, int], ...]
"""The branches that lead to a task, outermost first: numbers of the fork and of its branch."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A task that is active, and the branches that led to it."""

    task: Activity
    where: Where = ()


@dataclass(frozen=True, slots=True)
class Together:
    """Tasks that may be active at the same time. `weight`: the sum of theirs. `names`: the data
    that conditions on the way to them read."""

    weight: int = 0
    tasks: tuple[Occurrence, ...] = ()
    names: frozenset[str] = frozenset()

    def behind(self, branch: tuple[int, int]) -> tuple[Occurrence, ...]:
        """Return its tasks behind one branch more: the number of a fork, and of its branch."""
        return tuple(Occurrence(each.task, (branch, *each.where)) for each in self.tasks)


@dataclass(frozen=True, slots=True)
class _Branch:
    """A branch of a fork. `names`: the data that its condition reads. `uncertain`: a condition or
    an event decides whether it begins. `only`: what it alone leads to, each with the data that
    conditions on the way read."""

    entry: FlowNode
    names: frozenset[str]
    uncertain: bool = False
    only: list[tuple[FlowNode, frozenset[str]]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Fork:
    """Where tokens come to be several, or where one begins. `node`: of a gateway or activity."""

    number: int
    branches: tuple[_Branch, ...]
    node: FlowNode | None

    @property
    def size(self) -> int:
        return sum(len(branch.only) for branch in self.branches)


def instances_at_once(activity: Activity) -> int:
    """Return how many instances of an activity run in parallel, as far as its number is literal."""
    loop = activity.loop
    if not isinstance(loop, MultiInstance) or loop.sequential or loop.cardinality is None:
        return 1
    if not loop.cardinality.constant:
        return 1
    try:
        count = loop.cardinality.evaluate(lambda _: None)
    except ExpressionError:
        return 1
    if isinstance(count, bool) or not isinstance(count, int):
        return 1
    return max(1, min(count, MOST_INSTANCES))


class ConcurrentTasks:
    """Finds tasks of a mission that may be active together.

    `matters`: whether a task counts; what leads to no such task is not looked at.
    """

    def __init__(self, mission: Mission, matters: Callable[[Activity], bool]) -> None:
        self._thrown = {each.id for node in mission.nodes for each in thrown_by(node)}
        self._thrown |= {each.id for each in mission.signals.values() if each.returned}
        self._matters = matters
        self._begins: dict[Container, _Fork] = {}
        self._forks: dict[FlowNode, _Fork] = {}
        self._inner: dict[Activity, Container] = {}
        containers: list[Container] = [*mission.processes]
        containers += [node for node in mission.nodes if isinstance(node, SubProcess)]
        for node in mission.nodes:
            if isinstance(node, Activity) and (inner := _inside(node)):
                self._inner[node] = inner
        for container in containers:
            self._begins[container] = self._fork(self._entries(container), None)
        for node in mission.nodes:
            if branches := self._branches(node):
                self._forks[node] = self._fork(branches, node)
        # Inner forks are smaller: those that others look into are known by then.
        forks = (*self._begins.values(), *self._forks.values())
        self._order = sorted(forks, key=lambda fork: fork.size)
        self._activities = list(mission.activities())

    # --- forks ------------------------------------------------------------------------------------

    def _fork(self, branches: Sequence[_Branch], barrier: FlowNode | None) -> _Fork:
        reached = [reach([branch.entry], barrier) for branch in branches]
        shared = Counter(node for nodes in reached for node in nodes) if len(branches) > 1 else {}
        for branch in branches:
            branch.only.extend(
                (node, names)
                for node, names in self._passable(branch, barrier, shared)
                if self._is_of_interest(node)
            )
        return _Fork(len(self._begins) + len(self._forks), tuple(branches), barrier)

    def _is_of_interest(self, node: FlowNode) -> bool:
        if isinstance(node, Activity) and (node in self._inner or self._matters(node)):
            return True
        return self._branches_off(node)

    def _branches_off(self, node: FlowNode) -> bool:
        if isinstance(node, Activity) and any(not each.interrupting for each in node.boundary):
            return True
        return len(node.outgoing) > 1 and not isinstance(node, ExclusiveGateway | EventBasedGateway)

    def _entries(self, container: Container) -> list[_Branch]:
        if isinstance(container, AdHocSubProcess):
            if container.ordering is AdHocOrdering.SEQUENTIAL or container.active_elements:
                return []
            return [_Branch(node, frozenset(), uncertain=True) for node in container.entries]
        return [
            _Branch(node, frozenset(), uncertain=bool(isinstance(node, Event) and node.definitions))
            for node in container.entries
            if self._may_begin(node)
        ]

    def _branches(self, node: FlowNode) -> list[_Branch]:
        """Return the branches on which tokens leave an element together; none, if it is one."""
        if not self._branches_off(node):
            return []
        default = getattr(node, "default", None)
        found: list[_Branch] = []
        for flow, names in _flows_together(node):
            uncertain = flow.condition is not None or flow is default
            found.append(_Branch(flow.target, names, uncertain=uncertain))
        if isinstance(node, Activity):
            found += [
                _Branch(each, frozenset(), uncertain=True)
                for each in node.boundary
                if not each.interrupting and self._may_begin(each)
            ]
        return found

    def _passable(
        self, branch: _Branch, barrier: FlowNode | None, shared: Mapping[FlowNode, int]
    ) -> Iterator[tuple[FlowNode, frozenset[str]]]:
        """Yield what only this branch leads to, with the data that conditions on the way read."""
        waiting: list[tuple[int, int, FlowNode, frozenset[str], frozenset[str]]] = []
        count = 0
        heapq.heappush(waiting, (0, 0, branch.entry, branch.names, frozenset()))
        seen: set[FlowNode] = set()
        while waiting:
            _, _, node, names, fresh = heapq.heappop(waiting)
            if node in seen or node is barrier or shared.get(node, 1) > 1:
                continue
            if not self._may_begin(node):
                continue
            seen.add(node)
            yield node, names
            if isinstance(node, UserTask) and node.prompt is not None:
                fresh |= {node.prompt.store}
            for target, read in _next(node):
                if (read - fresh) & names:
                    continue  # the one condition may exclude the other
                count += 1
                more = names | (read - fresh)
                heapq.heappush(waiting, (len(more), count, target, more, fresh))

    def _may_begin(self, node: FlowNode) -> bool:
        """Whether nothing else in the mission is needed for an element to begin."""
        if isinstance(node, ReceiveTask):
            return node.message is None or node.message.id not in self._thrown
        if isinstance(node, IntermediateCatchEvent | BoundaryEvent | StartEvent):
            return any(map(self._may_come, node.definitions)) or not node.definitions
        return True

    def _may_come(self, definition: EventDefinition) -> bool:
        if isinstance(definition, ConditionalEventDefinition):
            return False
        return all(each.id not in self._thrown for each in signals_and_messages([definition]))

    # --- what may be active together --------------------------------------------------------------

    def heaviest(self, weight: Callable[[Activity], int]) -> Iterator[Together]:
        """Yield the tasks of the greatest weight in sum that may be active together: for each fork,
        small ones first, for each process or subprocess with event subprocesses, and for each
        activity with several instances."""
        search = _Heaviest(self._begins, self._forks, self._inner, weight, self._may_begin)
        for fork in self._order:
            yield search.of_fork(fork, 0)
        for container in self._begins:
            if container.event_subprocesses:
                yield search.of_container(container, 0)
        for activity in self._activities:
            if instances_at_once(activity) > 1:
                yield search.of_node(activity, 0)

    def begun_together(self) -> dict[int, list[Activity]]:
        """Return by the number of a fork the tasks that certainly begin in one step of the mission,
        in order; small forks first. A task with several instances is there as often. Those of an
        activity with several instances have a negative number."""
        found: dict[int, list[Activity]] = {}
        for fork in self._order:
            entries = [branch.entry for branch in fork.branches if not branch.uncertain]
            found[fork.number] = [task for entry in entries for task in self._begun(entry)]
        for number, activity in enumerate(self._activities):
            if instances_at_once(activity) > 1:
                found[-1 - number] = self._begun(activity)
        return found

    def begun_first(self) -> dict[int, list[Activity]]:
        """Return by the number of a fork the tasks that begin in the step of the fork, or never as
        long as its other branches are active; in order."""
        return {fork.number: self._first(fork) for fork in self._order}

    def _first(self, fork: _Fork) -> list[Activity]:
        waiting = [
            each.entry for each in fork.branches if not isinstance(each.entry, BoundaryEvent)
        ]
        entered = dict.fromkeys(waiting)
        later: set[FlowNode] = set()
        for node in waiting:
            following_at_once = _leads_at_once_to(node)
            if following_at_once is None:
                for each in following(node):
                    later |= reach([each], fork.node) if each not in later else set()
                following_at_once = self._entries_of(node)
            for each in following_at_once:
                if each not in entered:
                    entered[each] = None
                    waiting.append(each)
        tasks = (each for each in entered if isinstance(each, Activity) and self._matters(each))
        return [each for each in tasks if each not in later]

    def _entries_of(self, node: FlowNode) -> Sequence[FlowNode]:
        inner = self._inner.get(node) if isinstance(node, Activity) else None
        return inner.entries if inner is not None and inner.event_subprocesses == () else ()

    def _begun(self, entry: FlowNode) -> list[Activity]:
        """Return the tasks that a token which enters here begins at once."""
        found: list[Activity] = []
        waiting: list[tuple[FlowNode, int, int]] = [(entry, 1, 0)]
        passed: set[FlowNode] = set()
        for node, times, depth in waiting:
            if node in passed or depth > MOST_NESTED:
                continue
            passed.add(node)
            if isinstance(node, Activity):
                if not _begins_at_once(node):
                    continue
                each_time = min(times * instances_at_once(node), MOST_INSTANCES)
                if self._matters(node):
                    found += [node] * each_time
                elif (inner := self._inner.get(node)) and not isinstance(inner, AdHocSubProcess):
                    waiting += [(entry, each_time, depth + 1) for entry in inner.entries]
            if _passes_at_once(node):
                waiting += [(flow.target, times, depth) for flow in node.outgoing]
        return found


@dataclass(slots=True)
class _Heaviest:
    """One search for the tasks of the greatest weight that may be active together."""

    begins: Mapping[Container, _Fork]
    forks: Mapping[FlowNode, _Fork]
    inner: Mapping[Activity, Container]
    weight: Callable[[Activity], int]
    may_begin: Callable[[FlowNode], bool]
    known: dict[object, Together] = field(default_factory=dict)
    entered: set[object] = field(default_factory=set)

    def of_fork(self, fork: _Fork, depth: int) -> Together:
        """Return the heaviest tasks of the branches of a fork, some of each branch."""
        return self._once(fork.number, depth, lambda: self._sum(fork, depth))

    def of_node(self, node: FlowNode, depth: int) -> Together:
        """Return the heaviest tasks that a token on an element, or what it became, makes active."""
        return self._once(node, depth, lambda: self._at(node, depth))

    def _once(self, key: object, depth: int, find: Callable[[], Together]) -> Together:
        if key in self.known:
            return self.known[key]
        if key in self.entered or depth > MOST_NESTED:
            return Together()  # a loop leads back to it
        self.entered.add(key)
        found = find()
        self.entered.discard(key)
        self.known[key] = found
        return found

    def _sum(self, fork: _Fork, depth: int, host: Together | None = None) -> Together:
        """Add up the branches of a fork; with `host`, only those of its events, beside it."""
        parts = [host] if host is not None else []
        names = host.names if host is not None else frozenset()
        for number, branch in enumerate(fork.branches):
            if host is not None and not isinstance(branch.entry, BoundaryEvent):
                continue
            best = Together()
            for node, read in branch.only:
                found = self.of_node(node, depth + 1)
                if found.weight > best.weight and names.isdisjoint(found.names | read):
                    tasks = found.behind((fork.number, number))
                    best = Together(found.weight, tasks, found.names | read)
            if best.weight:
                parts.append(best)
                names |= best.names
        return Together(
            sum(part.weight for part in parts),
            tuple(each for part in parts for each in part.tasks),
            names,
        )

    def _at(self, node: FlowNode, depth: int) -> Together:
        active = self._active(node, depth) if isinstance(node, Activity) else Together()
        fork = self.forks.get(node)
        if fork is None:
            return active
        if active.weight:
            host = replace(active, tasks=active.behind((fork.number, HOST)))
            active = self._sum(fork, depth + 1, host)
        left = self.of_fork(fork, depth + 1)
        return left if left.weight > active.weight else active

    def _active(self, activity: Activity, depth: int) -> Together:
        """Return the heaviest tasks while an activity is active: its own and those in it."""
        inner = self.inner.get(activity)
        if inner is not None:
            found = self.of_container(inner, depth)
        else:
            weight = self.weight(activity)
            found = Together(weight, (Occurrence(activity),) if weight else ())
        times = instances_at_once(activity) if found.weight else 1
        if times > 1:
            numbers = range(min(times, 1 + MOST_INSTANCES // len(found.tasks)))
            tasks = tuple(each for number in numbers for each in found.behind((INSTANCE, number)))
            found = Together(found.weight * times, tasks, found.names)
        return found

    def of_container(self, container: Container, depth: int) -> Together:
        """Return the heaviest tasks in a process or subprocess, event subprocesses included."""
        fork = self.begins[container]
        found = self.of_fork(fork, depth + 1)
        for each in container.event_subprocesses:
            (start,) = each.starts[:1] or (None,)
            if start is None or start.interrupting or not self.may_begin(start):
                continue
            more = self.of_container(each, depth + 1)
            if more.weight and found.names.isdisjoint(more.names):
                tasks = (*found.tasks, *more.behind((EVENT_SUBPROCESS, each.index)))
                found = Together(found.weight + more.weight, tasks, found.names | more.names)
        return found


# --- the graph ------------------------------------------------------------------------------------


def _next(node: FlowNode) -> Iterator[tuple[FlowNode, frozenset[str]]]:
    """Yield where a token can go next, with the data that is read to send it there."""
    if isinstance(node, ExclusiveGateway | EventBasedGateway):
        read = _names(node.outgoing)
        for flow in node.outgoing:
            yield flow.target, read
        return
    for flow, names in _flows_together(node):
        yield flow.target, names
    for each in following(node)[len(node.outgoing) :]:
        yield each, frozenset()


def _flows_together(node: FlowNode) -> Iterator[tuple[SequenceFlow, frozenset[str]]]:
    """Yield the flows by which tokens leave an element together, with the data that is read."""
    if isinstance(node, ExclusiveGateway | EventBasedGateway):
        return
    default = getattr(node, "default", None)
    for flow in node.outgoing:
        if flow.condition is not None:
            yield flow, flow.condition.names
        else:
            yield flow, _names(node.outgoing) if flow is default else frozenset()


def _names(flows: Iterable[SequenceFlow]) -> frozenset[str]:
    return frozenset(name for flow in flows if flow.condition for name in flow.condition.names)


def _inside(node: FlowNode) -> Container | None:
    if isinstance(node, SubProcess) and not node.triggered_by_event:
        return node
    return node.called if isinstance(node, CallActivity) else None


def _begins_at_once(activity: Activity) -> bool:
    """Whether an activity certainly begins, once, or all its instances, as a token enters it."""
    loop = activity.loop
    if loop is not None and instances_at_once(activity) < 2:
        return False
    conditions = (
        isinstance(each, ConditionalEventDefinition)
        for event in activity.boundary
        if event.interrupting
        for each in event.definitions
    )
    return activity.start_quantity == 1 and not any(conditions)


def _leads_at_once_to(node: FlowNode) -> Sequence[FlowNode] | None:
    """Return where a token may be in the step in which it enters an element; None: it waits."""
    is_passed = isinstance(node, Gateway) and not isinstance(node, EventBasedGateway)
    if is_passed or _passes_at_once(node):
        return [flow.target for flow in node.outgoing]
    return None


def _passes_at_once(node: FlowNode) -> bool:
    """Whether a token leaves an element by all its flows in the step in which it enters."""
    if any(flow.condition is not None for flow in node.outgoing):
        return False
    if isinstance(node, Task | ManualTask):
        return node.loop is None and not node.boundary
    if isinstance(node, ParallelGateway | InclusiveGateway):
        return len(node.incoming) <= 1
    if isinstance(node, ExclusiveGateway):
        return len(node.outgoing) == 1
    if isinstance(node, StartEvent | IntermediateThrowEvent):
        return not node.definitions
    return False
