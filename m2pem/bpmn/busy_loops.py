"""Loops of a mission in which nothing waits: a run in one takes steps, and no time passes.

An executive pauses such a run after `steps_between_waits` of its fleet. A loop that evidently
counts its rounds is none: a number in it only grows (or only falls), and a flow that every round
takes is closed beyond a bound that the loop does not write.
"""

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from m2pem.bpmn.data_names import written_by
from m2pem.bpmn.rules.loops import BUSY_LOOP, ENDLESS_LOOP
from m2pem.findings import Finding
from m2pem.mission.behavior import Assignment, ThrowError
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    BoundaryEvent,
    CallActivity,
    ComplexGateway,
    Container,
    EndEvent,
    EventBasedGateway,
    ExclusiveGateway,
    FlowNode,
    InclusiveGateway,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    ParallelGateway,
    Process,
    ReceiveTask,
    ScriptTask,
    SendTask,
    SequenceFlow,
    ServiceTask,
    StartEvent,
    SubProcess,
    UserTask,
)
from m2pem.mission.events import (
    CancelEventDefinition,
    CompensateEventDefinition,
    ErrorEventDefinition,
    EscalationEventDefinition,
    TerminateEventDefinition,
)
from m2pem.mission.expression import Expression
from m2pem.mission.expression import tree as t
from m2pem.mission.loops import LOOP_COUNTER, StandardLoop
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import components, unreached

_NAMED = 8
"""Elements of a loop that a finding names."""

_AT_ONCE = (ErrorEventDefinition, EscalationEventDefinition, CancelEventDefinition)
"""What can trigger a boundary event of an activity that does not wait."""

_ENDING = (ErrorEventDefinition, CancelEventDefinition, TerminateEventDefinition)
_SYNCHRONIZING = ParallelGateway | InclusiveGateway

_Links: TypeAlias = Mapping[FlowNode, Sequence[FlowNode]]


def busy_loops(mission: Mission, known_names: Iterable[str]) -> Iterator[Finding]:
    """Find loops without a wait: an error when nothing ends one, else a warning.

    `known_names`: names that are written from outside.
    """
    look = _Look(mission, known_names)
    for container in _backward(mission):
        yield from look.loops(container)
    for node in mission.nodes:
        if isinstance(node, Activity) and isinstance(node.loop, StandardLoop):
            yield from look.standard_loop(node, node.loop)


def _backward(mission: Mission) -> dict[Container, None]:
    """The containers in which something leads back to what the file has before it."""
    flows = mission.flows
    found = dict.fromkeys(
        flow.source.container for flow in flows if flow.target.index <= flow.source.index
    )
    for node in mission.nodes:
        if isinstance(node, BoundaryEvent):
            if node.index < node.attached_to.index:
                found[node.container] = None
        elif isinstance(node, IntermediateCatchEvent) and node.linked_from:
            found[node.container] = None
    return found


# --- what waits ---------------------------------------------------------------------------------


def _waiting(mission: Mission) -> set[FlowNode]:
    """The nodes on which a token may wait, for the outside or for time.

    An activity with a subprocess or called process does so if anything in that does.
    """
    opened_by: dict[Container, list[FlowNode]] = {}
    for node in mission.nodes:
        if isinstance(node, SubProcess):
            opened_by.setdefault(node, []).append(node)
        elif isinstance(node, CallActivity):
            opened_by.setdefault(node.called, []).append(node)
    news = [node for node in mission.nodes if _waits(node)]
    waiting = set(news)
    while news:
        for each in opened_by.pop(news.pop().container, ()):
            if each not in waiting:
                waiting.add(each)
                news.append(each)
    return waiting


def _waits(node: FlowNode) -> bool:
    """Whether the node itself makes a token wait, whatever is in it."""
    match node:
        case UserTask() | AdHocSubProcess() | EventBasedGateway() | ComplexGateway():
            return True
        case ReceiveTask():
            return node.message is not None
        case ServiceTask():
            return node.behavior is not None or node.call is not None
        case ScriptTask() | SendTask():
            return node.behavior is not None or node.start_quantity > 1
        case Activity():
            return node.start_quantity > 1
        case IntermediateCatchEvent():
            return bool(node.definitions) and not node.linked_from
        case StartEvent():
            outer = node.container
            triggered = isinstance(outer, SubProcess) and outer.triggered_by_event
            return bool(node.definitions) and not triggered
        case IntermediateThrowEvent() | EndEvent():
            return any(isinstance(each, CompensateEventDefinition) for each in node.definitions)
    return False


# --- where a token can go without waiting -------------------------------------------------------


def _at_once(node: FlowNode) -> bool:
    """Whether a boundary event can be triggered while its activity does not wait."""
    return not isinstance(node, BoundaryEvent) or any(
        isinstance(each, _AT_ONCE) for each in node.definitions
    )


def _ends_with_error(node: FlowNode) -> bool:
    script = node.script if isinstance(node, ScriptTask) else None
    return script is not None and any(isinstance(each, ThrowError) for each in script.statements)


def _flows(node: FlowNode) -> tuple[SequenceFlow, ...]:
    return () if _ends_with_error(node) else node.outgoing


def _beside_flows(node: FlowNode) -> list[FlowNode]:
    """Return the nodes that a token can reach other than by a sequence flow."""
    if isinstance(node, Activity):
        return [each for each in node.boundary if _at_once(each)]
    if isinstance(node, IntermediateThrowEvent) and node.links_to is not None:
        return [node.links_to]
    return []


def _links(nodes: Collection[FlowNode], closed: Collection[SequenceFlow] = ()) -> _Links:
    """The graph of some nodes without the closed flows."""
    return {
        node: [flow.target for flow in _flows(node) if flow not in closed] + _beside_flows(node)
        for node in nodes
    }


def _cycles(links: _Links) -> list[list[FlowNode]]:
    """The components that have a cycle, and are entered without another token.

    A parallel join that needs a token from outside of the component waits for it.
    """
    number = components(links)
    members: dict[int, list[FlowNode]] = {}
    for node in links:
        members.setdefault(number[node], []).append(node)
    found: list[list[FlowNode]] = []
    for group in members.values():
        if len(group) == 1 and group[0] not in links[group[0]]:
            continue
        inside = set(group)
        joins = {
            node
            for node in group
            if isinstance(node, ParallelGateway)
            and any(flow.source not in inside for flow in node.incoming)
            and len(node.incoming) > 1
        }
        if joins:
            found += _cycles({node: links[node] for node in group if node not in joins})
        else:
            found.append(group)
    return found


# --- loops that count ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Counter:
    """A name that only grows (`sign` 1), or only falls (-1), in a loop."""

    key: str
    sign: int
    written: frozenset[str]
    """All that the loop writes: none of it is a bound."""

    def bounds(self, condition: t.Node, value: bool) -> bool:
        """Whether a condition cannot be `value` for ever."""
        match condition:
            case t.Not():
                return self.bounds(condition.operand, not value)
            case t.And() | t.Or():
                every = isinstance(condition, t.Or) == value
                each = (self.bounds(operand, value) for operand in condition.operands)
                return all(each) if every else any(each)
            case t.Compare(operator=operator, left=left, right=right):
                return self._compares(operator, left, right, value) or self._compares(
                    _TURNED.get(operator, operator), right, left, value
                )
        return False

    def _compares(self, how: t.Comparison, left: t.Node, right: t.Node, value: bool) -> bool:
        below = (t.Comparison.LESS, t.Comparison.LESS_EQUAL)
        above = (t.Comparison.GREATER, t.Comparison.GREATER_EQUAL)
        closes = below if value == (self.sign > 0) else above
        return how in closes and left == t.Name(self.key) and not _overlap(right, self.written)


_TURNED = {
    t.Comparison.LESS: t.Comparison.GREATER,
    t.Comparison.GREATER: t.Comparison.LESS,
    t.Comparison.LESS_EQUAL: t.Comparison.GREATER_EQUAL,
    t.Comparison.GREATER_EQUAL: t.Comparison.LESS_EQUAL,
}


def _overlap(node: t.Node, written: Iterable[str]) -> bool:
    return any(_same(name, each) for name in t.names(node) for each in written)


def _same(one: str, other: str) -> bool:
    """Whether writing one name changes the other: maps hold what is under their name."""
    return t.binds(one, other) or t.binds(other, one)


def _step(assignment: Assignment) -> int:
    """The sign of what an assignment adds to its own name; 0 for any other assignment."""
    match assignment.expression.tree:
        case t.Arithmetic(operator=operator, left=left, right=t.Literal(value=value)):
            pass
        case (
            t.Arithmetic(operator=t.Operation.ADD as operator, left=t.Literal(value=value)) as sum_
        ):
            left = sum_.right
        case _:
            return 0
    if left != t.Name(assignment.key) or not isinstance(value, int | float) or not value:
        return 0
    grows = value > 0
    match operator:
        case t.Operation.ADD:
            return 1 if grows else -1
        case t.Operation.SUBTRACT:
            return -1 if grows else 1
    return 0


def _assignments(node: FlowNode) -> list[Assignment]:
    """Return the assignments of each script task to the scope around it."""
    if not isinstance(node, ScriptTask) or node.script is None or node.loop is not None:
        return []
    statements = node.script.statements
    own = node.own_data
    return [each for each in statements if isinstance(each, Assignment) and each.key not in own]


def _always(node: FlowNode) -> list[FlowNode]:
    """What each execution of a node surely runs: itself, or what a subprocess begins with."""
    if not isinstance(node, SubProcess):
        return [node]
    if node.loop is not None or node.data or len(node.entries) != 1:
        return []
    found = list(node.entries)
    for each in found:  # grows while it is read
        if len(each.outgoing) == 1 and each.outgoing[0].target not in found:
            found.append(each.outgoing[0].target)
    return found


def _inside(nodes: Iterable[FlowNode]) -> list[FlowNode]:
    """The nodes with all that is in them, at any depth; called processes have data of their own."""
    found = list(nodes)
    for node in found:  # grows while it is read
        if isinstance(node, SubProcess):
            found += node.nodes
    return found


def _counters(group: Sequence[FlowNode]) -> Iterator[tuple[_Counter, set[FlowNode]]]:
    """The counters of a loop, each with the nodes of the loop that count."""
    writes = [(node, name) for node in _inside(group) for name in written_by(node)]
    written = frozenset(name for _, name in writes)
    counting: dict[tuple[str, int], set[FlowNode]] = {}
    for node in group:
        for inner in _always(node):
            for each in _assignments(inner):
                if sign := _step(each):
                    counting.setdefault((each.key, sign), set()).add(node)
    for (key, sign), nodes in counting.items():
        if all(
            name == key and _only_steps(node, key, sign)
            for node, name in writes
            if _same(name, key)
        ):
            yield _Counter(key, sign, written), nodes


def _only_steps(node: FlowNode, key: str, sign: int) -> bool:
    own = [each for each in _assignments(node) if each.key == key]
    return bool(own) and all(_step(each) == sign for each in own)


def _rejected(flow: SequenceFlow) -> list[Expression]:
    """The conditions that are false whenever the flow is taken."""
    source = flow.source
    default = getattr(source, "default", None)
    found: list[Expression] = []
    for each in source.outgoing:
        if each is flow:
            if flow is not default:
                break
            continue
        if each is not default and each.condition is not None:
            found.append(each.condition)
    return found if flow is default or isinstance(source, ExclusiveGateway) else []


# --- the findings -------------------------------------------------------------------------------


class _Look:
    """Looks for the loops of one mission."""

    def __init__(self, mission: Mission, known: Iterable[str]) -> None:
        self.mission = mission
        self._known = known

    @cached_property
    def waiting(self) -> set[FlowNode]:
        """The nodes on which a token may wait."""
        return _waiting(self.mission)

    @cached_property
    def begun(self) -> set[str]:
        """The names that something else than counting writes."""
        found = {*self._known, *self.mission.associated}
        for node in self.mission.nodes:
            steps = {each.key for each in _assignments(node) if _step(each)}
            found |= written_by(node) - steps
            found |= {each.key for each in _assignments(node) if not _step(each)}
        return found

    def loops(self, container: Container) -> Iterator[Finding]:
        at_once = [node for node in container.nodes if node not in self.waiting and _at_once(node)]
        groups = _cycles(_links(at_once))
        if not groups:
            return
        never = set(unreached(container))
        left = [(group, frozenset[SequenceFlow]()) for group in groups]
        for group, closed in left:  # grows while it is read
            if never.issuperset(group):
                continue
            counted = self._counted(group, closed)
            if counted:
                links = _links(group, counted | closed)
                left += [(part, counted | closed) for part in _cycles(links)]
            else:
                ends = bool(closed) or not _stays(group)
                yield self._finding(group, _path(_links(group, closed)), ends=ends)

    def standard_loop(self, node: Activity, loop: StandardLoop) -> Iterator[Finding]:
        if node in self.waiting or loop.maximum is not None or _ends_with_error(node):
            return
        if loop.condition is not None and _counts(node, loop.condition):
            return
        yield self._finding([node], [node], ends=loop.condition is not None)

    def _counted(
        self, group: Sequence[FlowNode], closed: frozenset[SequenceFlow]
    ) -> frozenset[SequenceFlow]:
        """The flows of a loop, without the closed ones, that can be taken only so often."""
        inside = set(group)
        flows = [flow for node in group for flow in _flows(node) if flow.target in inside]
        found: set[SequenceFlow] = set()
        for counter, nodes in _counters(group):
            rest = components(_links(inside - nodes, closed))
            found.update(
                flow
                for flow in flows
                if rest.get(flow.source, -1) != rest.get(flow.target, -2)
                and self._bounded(flow, counter)
            )
        return frozenset(found) - closed

    def _bounded(self, flow: SequenceFlow, counter: _Counter) -> bool:
        if flow.condition is not None and counter.bounds(flow.condition.tree, True):
            return True
        # A counter that nothing begins is null, and a comparison with it is never true.
        return counter.key in self.begun and any(
            counter.bounds(each.tree, False) for each in _rejected(flow)
        )

    def _finding(
        self, group: Sequence[FlowNode], path: Sequence[FlowNode], *, ends: bool
    ) -> Finding:
        ending = None if ends else _ending(self.mission, group)
        rule = BUSY_LOOP if ends or ending is not None else ENDLESS_LOOP
        named = [f"'{node.id}'" for node in path[:_NAMED]]
        if len(path) > _NAMED:
            named.append(f"{len(path) - _NAMED} more")
        what = (
            f"{', '.join(named[:-1])} and {named[-1]} follow each other"
            if len(named) > 1
            else f"{named[0]} repeats"
        )
        if not ends and ending is None:
            how = "for ever: nothing in the loop waits, and nothing ends it"
            remedy = "wait in each round, for a timer or an event, or draw a way out"
        else:
            until = f"only '{ending.id}' can end that" if ending is not None else _until(group)
            how = (
                f"without a wait; {until}, and a run that takes the fleet's steps_between_waits "
                "steps in it is paused"
            )
            remedy = "wait in each round, for a timer or an event, or count the rounds"
        return rule.finding(
            self.mission.file_of(path[0]),
            path[0].line,
            path[0].id,
            f"{what} {how}",
            remedy,
        )


def _until(group: Sequence[FlowNode]) -> str:
    """Return the condition that ends a loop, as far as it can be read."""
    conditions = [flow.condition for node in group for flow in node.outgoing if flow.condition]
    conditions += [
        node.loop.condition
        for node in group
        if isinstance(node, Activity)
        and isinstance(node.loop, StandardLoop)
        and node.loop.condition
    ]
    names = sorted({name for each in conditions for name in each.names})
    written = {name for node in _inside(group) for name in written_by(node)}
    if names and not any(_same(name, each) for name in names for each in written):
        read = ", ".join(f"'{name}'" for name in names[:3])
        return f"its conditions read {read}, which nothing in it writes"
    return "only data can end it"


def _counts(node: Activity, condition: Expression) -> bool:
    """Whether the condition of a standard loop becomes false by counting."""
    written = frozenset(name for each in _inside([node]) for name in written_by(each))
    counters = [_Counter(LOOP_COUNTER, 1, written)]
    if isinstance(node, ScriptTask) and node.script is not None:
        for each in node.script.statements:
            if isinstance(each, Assignment) and (sign := _step(each)):
                own = [
                    other
                    for other in node.script.statements
                    if isinstance(other, Assignment) and _same(other.key, each.key)
                ]
                if own == [each]:
                    counters.append(_Counter(each.key, sign, written))
    return any(counter.bounds(condition.tree, True) for counter in counters)


def _stays(group: Sequence[FlowNode]) -> bool:
    """Whether a token that has come into the group never leaves it, whatever the data."""
    inside = set(group)
    for node in group:
        if isinstance(node, _SYNCHRONIZING) and len(node.incoming) > 1:
            return False
        if isinstance(node, Activity) and any(
            each.interrupting and _at_once(each) for each in node.boundary
        ):
            return False
        if isinstance(node, IntermediateThrowEvent) and node.links_to is not None:
            continue
        if not _keeps(node, inside):
            return False
    return not any(_ends_its_scope(node) for node in _inside(group))


def _keeps(node: FlowNode, inside: Collection[FlowNode]) -> bool:
    """Whether one of the flows that a token leaves a node by leads back into the group."""
    default = getattr(node, "default", None)
    decided = [flow for flow in node.outgoing if flow is not default]
    certain = [flow for flow in decided if flow.condition is None]
    if isinstance(node, ExclusiveGateway):
        if certain:
            decided = decided[: decided.index(certain[0]) + 1]
        elif default is not None:
            decided.append(default)
        return all(flow.target in inside for flow in decided)
    return any(flow.target in inside for flow in certain) or all(
        flow.target in inside for flow in node.outgoing
    )


def _ends_its_scope(node: FlowNode) -> bool:
    return _ends_with_error(node) or (
        isinstance(node, EndEvent) and any(isinstance(each, _ENDING) for each in node.definitions)
    )


def _ending(mission: Mission, group: Sequence[FlowNode]) -> FlowNode | None:
    """Return the event, of the loop's scope or one around it, that can end the scope."""
    callers: dict[Process, list[CallActivity]] = {}
    for node in mission.nodes:
        if isinstance(node, CallActivity):
            callers.setdefault(node.called, []).append(node)
    waiting: list[Container] = [group[0].container]
    for container in waiting:  # grows while it is read
        for node in container.nodes:
            if _ends_its_scope(node):
                return node
        for each in container.event_subprocesses:
            if each not in waiting and any(start.interrupting for start in each.starts):
                return each
        around: list[Activity] = (
            [container] if isinstance(container, SubProcess) else list(callers.get(container, []))
        )
        for activity in around:
            for event in activity.boundary:
                if event.interrupting and not any(
                    isinstance(each, CompensateEventDefinition) for each in event.definitions
                ):
                    return event
            if activity.container not in waiting:
                waiting.append(activity.container)
    return None


def _path(links: _Links) -> list[FlowNode]:
    """A shortest cycle through the first node that is on one."""
    first = min(links, key=lambda node: node.index)
    came: dict[FlowNode, FlowNode] = {}
    waiting = deque([first])
    while waiting and first not in came:
        node = waiting.popleft()
        for each in links[node]:
            if each in links and each not in came:
                came[each] = node
                waiting.append(each)
    path = [came[first]]
    while path[-1] is not first:
        path.append(came[path[-1]])
    return path[::-1]
