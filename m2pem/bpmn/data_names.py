"""Which names of the data store each process reads and writes, as far as the file says."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from m2pem.bpmn.rules.data import UNWRITTEN_NAME
from m2pem.bpmn.value_kinds import doubts
from m2pem.findings import Finding
from m2pem.mission.behavior import Assignment, Behavior, Parameter, Role
from m2pem.mission.behavior import Mapping as DataMapping
from m2pem.mission.candidate_facts import is_fact
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    CallActivity,
    ComplexGateway,
    Container,
    Event,
    FlowNode,
    Process,
    ScriptTask,
    SendTask,
    ServiceTask,
    StartEvent,
    SubProcess,
    UserTask,
)
from m2pem.mission.events import ConditionalEventDefinition, TimerEventDefinition, caught_data
from m2pem.mission.expression import Expression, parse
from m2pem.mission.expression.kinds import DATA, kinds
from m2pem.mission.expression.operators import kind
from m2pem.mission.expression.temporal import NOW
from m2pem.mission.loops import INSTANCE_COUNTS, LOOP_COUNTER, MultiInstance, StandardLoop
from m2pem.mission.mission import Mission
from m2pem.mission.remaining import GEOMETRIES, split_name
from m2pem.suggestions import suggest_or

_OF_ANY_KIND: Mapping[str, frozenset[str]] = {}


class Read(NamedTuple):
    """An expression that is evaluated over a process's data, and its element.

    `of_role`: it is of a role, and reads the facts of candidates as well.
    """

    expression: Expression
    element: str
    line: int
    of_role: bool = False

    @property
    def names(self) -> frozenset[str]:
        """The names of the data store that it reads."""
        names = self.expression.names
        return frozenset(each for each in names if not is_fact(each)) if self.of_role else names


@dataclass(slots=True)
class _Store:
    """Reads and writes of the data of one process; embedded subprocesses share it."""

    reads: list[Read] = field(default_factory=list)
    written: set[str] = field(default_factory=set)
    anything: bool = False
    """Whether something may write any name, such as a service that is not registered."""
    kinds: dict[str, frozenset[str]] = field(default_factory=dict)
    """What all that writes a name may make it, besides null."""

    def write(
        self, names: Iterable[str], known: Mapping[str, frozenset[str]] = _OF_ANY_KIND
    ) -> None:
        """Note what writes some names. `known`: the kinds of values; of others, any."""
        self.written.update(names)
        for name in names:
            self.kinds[name] = self.kinds.get(name, frozenset()) | known.get(name, DATA)

    def kinds_of(self, name: str) -> frozenset[str]:
        """What a name may be, besides null."""
        return DATA if self.anything else self.kinds.get(name, DATA)

    def has(self, name: str) -> bool:
        """Whether the name, or a map that holds it, is written."""
        if self.anything or name in self.written:
            return True
        parts = name.split(".")
        return any(".".join(parts[:count]) in self.written for count in range(1, len(parts)))


def unwritten(
    mission: Mission,
    known_names: Iterable[str],
    service_writes: Mapping[str, Sequence[str]],
    behavior_writes: Mapping[str, Sequence[str]],
) -> Iterator[Finding]:
    """A warning for each name that a process reads and nothing writes, which would be null; and for
    each expression that the kinds of what it reads let have no value, or another one than before.

    `known_names`: written from outside; a mapping has their values, too.
    """
    within: dict[Container, _Store] = {process: _Store() for process in mission.processes}
    stores = {process: within[process] for process in mission.processes}
    given = known_names if isinstance(known_names, Mapping) else {}
    known = {name: frozenset({kind(each)}) for name, each in given.items() if each is not None}
    for store in stores.values():
        store.write(known_names, known)
        store.write(mission.associated)
    main = mission.process()
    called = {node.called for node in mission.nodes if isinstance(node, CallActivity)}
    for node in mission.nodes:
        store = within[node.container]
        if isinstance(node, SubProcess):
            within[node] = store
        for mapping in _data_mappings(node):
            if mapping.source.text not in mapping.source.names:  # a copy may well copy nothing
                store.reads.append(Read(mapping.source, node.id, mapping.line))
        store.reads += _reads(node)
        store.reads += _flow_conditions(node)
        begins = isinstance(node, StartEvent) and isinstance(node.container, Process)
        # A condition that begins a process reads the data of the main one.
        of_main = begins and node.container not in called
        if isinstance(node, Event):
            (stores[main] if of_main else store).reads += _conditions(node)
        store.write(written_by(node), _kinds_written_by(node))
        if isinstance(node, ServiceTask) and node.call is not None:
            writes = service_writes.get(node.call.service)
            store.write(writes or ())
            store.anything |= writes is None
        behavior = getattr(node, "behavior", None)
        if isinstance(behavior, Behavior):
            store.write(behavior_writes.get(behavior.name, ()))
        if isinstance(node, CallActivity):
            _note_mappings(node, store, stores[node.called])
    shared = {
        name
        for store in stores.values()
        for name in store.written
        if name in mission.data_stores or name.partition(".")[0] in mission.data_stores
    }
    for store in stores.values():
        store.write(shared)
    for container, store in within.items():
        store.kinds |= {each.key: frozenset({each.kind}) for each in container.data if each.kind}
    for process, store in stores.items():
        yield from _findings(mission, process, store)
        for read in store.reads:
            for rule, said, remedy in doubts(read.expression, store.kinds_of):
                file = _file(mission, process, read)
                yield rule.finding(file, read.line, read.element, said, remedy)


def _file(mission: Mission, process: Process, read: Read) -> str:
    """The file of what reads: a call reads what another file's process has."""
    reader = mission.elements.get(read.element)
    return mission.file_of(reader if isinstance(reader, FlowNode) else process)


def _findings(mission: Mission, process: Process, store: _Store) -> Iterator[Finding]:
    said: set[tuple[str, str]] = set()
    for read in store.reads:
        names = read.names - {NOW}
        if names <= store.written:
            continue
        for name in sorted(name for name in names if not store.has(name)):
            if (read.element, name) in said:
                continue
            said.add((read.element, name))
            yield UNWRITTEN_NAME.finding(
                _file(mission, process, read),
                read.line,
                read.element,
                f"'{name}' is read, but nothing in process '{process.id}' writes it; unless "
                "--data or an operator does, it is null",
                suggest_or(name, store.written, "write it in a task before, or pass it in"),
            )


def remaining_names(nodes: Iterable[FlowNode]) -> frozenset[str]:
    """Return the names that elements read of what is left of tasks."""
    found: set[str] = set()
    for node in nodes:
        found |= read_by(node)
        found.update(name for each in _flow_conditions(node) for name in each.names)
    return frozenset(filter(split_name, found))


def read_by(node: FlowNode) -> set[str]:
    """The names that a node itself reads; those of the conditions of its flows are not there."""
    conditions = _conditions(node) if isinstance(node, Event) else ()
    inputs = node.mappings.inputs if isinstance(node, CallActivity) else ()
    found = {name for each in (*_reads(node), *conditions) for name in each.names}
    return found.union(*(each.source.names for each in (*_data_mappings(node), *inputs)))


def _data_mappings(node: FlowNode) -> tuple[DataMapping, ...]:
    if isinstance(node, Activity | Event):
        return (*node.data_flow.inputs, *node.data_flow.outputs)
    return ()


def _reads(node: FlowNode) -> Iterator[Read]:
    if isinstance(node, AdHocSubProcess):
        for expression in (node.completion, node.active_elements):
            if expression is not None:
                yield Read(expression, node.id, node.line)
    if isinstance(node, ComplexGateway) and node.activation is not None:
        yield Read(node.activation, node.id, node.line)
    if isinstance(node, Activity) and node.loop is not None:
        yield from _loop_reads(node, node.loop)
    if isinstance(node, ScriptTask | ServiceTask | SendTask) and node.behavior is not None:
        yield from _parameters(node, node.behavior.parameters)
        yield from _needs(node, node.behavior.roles)
    for statement in _assignments(node):
        yield Read(statement.expression, node.id, statement.line)
    if isinstance(node, ServiceTask) and node.call is not None:
        yield from _parameters(node, node.call.properties)
    elif isinstance(node, UserTask) and node.prompt is not None and node.prompt.timeout is not None:
        yield Read(node.prompt.timeout, node.id, node.line)
    elif isinstance(node, Event):
        for definition in node.definitions:
            if isinstance(definition, TimerEventDefinition):
                yield Read(definition.expression, node.id, definition.line)


def _flow_conditions(node: FlowNode) -> Iterator[Read]:
    for flow in node.outgoing:
        if flow.condition is not None:
            yield Read(flow.condition, flow.id, flow.line)


def _assignments(node: FlowNode) -> Iterator[Assignment]:
    if isinstance(node, ScriptTask) and node.script is not None:
        yield from (each for each in node.script.statements if isinstance(each, Assignment))


def _conditions(node: Event) -> Iterator[Read]:
    for definition in node.definitions:
        if isinstance(definition, ConditionalEventDefinition):
            yield Read(definition.condition, node.id, definition.line)


def _loop_reads(node: Activity, loop: StandardLoop | MultiInstance) -> Iterator[Read]:
    found: list[Expression | None]
    if isinstance(loop, StandardLoop):
        found = [loop.condition]
    else:
        found = [loop.cardinality, loop.collection, loop.completion]
        found += [each.condition for each in loop.complex]
        if loop.output is not None and loop.output.text not in loop.output.names:
            found.append(loop.output)
    for expression in found:
        if expression is not None:
            yield Read(expression, node.id, node.line)


def _parameters(node: FlowNode, parameters: Iterable[Parameter]) -> Iterator[Read]:
    for parameter in parameters:
        if isinstance(parameter.value, Expression):
            yield Read(parameter.value, node.id, parameter.line)


def _needs(node: FlowNode, roles: Iterable[Role]) -> Iterator[Read]:
    for role in roles:
        if role.need is None:
            continue
        for expression in role.need.expressions:
            yield Read(expression, node.id, role.line, of_role=True)
        if role.need.same:
            yield Read(parse(role.need.same), node.id, role.line)
        if role.need.wait_limit is not None:
            yield Read(role.need.wait_limit, node.id, role.line)


def written_by(node: FlowNode) -> set[str]:
    """The names that a node itself writes, without those of its service or behavior."""
    written = stored_by(node)
    if isinstance(node, Event):
        written |= set(caught_data(node.definitions, ""))
    if isinstance(node, Activity | Event):
        written.update(mapping.target for mapping in node.data_flow.inputs)
    if isinstance(node, Activity) and node.loop is not None:
        written.add(LOOP_COUNTER)
        if isinstance(node.loop, MultiInstance):
            written |= {*INSTANCE_COUNTS, node.loop.item, node.loop.output_item}
    if isinstance(node, ComplexGateway):
        written |= {"activationCount", "waitingForStart"}
        written.update(flow.local_id for flow in node.incoming)
    behavior = getattr(node, "behavior", None)
    if isinstance(behavior, Behavior) and any(
        parameter.name in GEOMETRIES for parameter in behavior.parameters
    ):
        written.add(f"{node.local_id}.remaining")
    return written - {""}


def stored_by(node: FlowNode) -> set[str]:
    """The names under which a node stores what comes of it, as its element says."""
    stored = {each.key for each in _assignments(node)}
    if isinstance(node, Activity | Event):
        stored.update(each.target for each in node.data_flow.outputs)
    if isinstance(node, Activity) and isinstance(node.loop, MultiInstance):
        stored.add(node.loop.output_collection)
    if isinstance(node, UserTask) and node.prompt is not None:
        stored.add(node.prompt.store)
    elif isinstance(node, CallActivity):
        stored.update(each.target for each in node.mappings.outputs)
    behavior = getattr(node, "behavior", None)
    for role in behavior.roles if isinstance(behavior, Behavior) else ():
        if role.need is not None:
            stored.add(role.need.store)
    return stored - {""}


def _kinds_written_by(node: FlowNode) -> dict[str, frozenset[str]]:
    """The kinds of the values that a node writes itself, where they are known."""
    found: dict[str, frozenset[str]] = {}
    if isinstance(node, Activity) and node.loop is not None:
        found |= dict.fromkeys((LOOP_COUNTER, *INSTANCE_COUNTS), frozenset({"number"}))
    for each in _assignments(node):
        found[each.key] = found.get(each.key, frozenset()) | kinds(each.expression.tree)
    if isinstance(node, UserTask) and node.prompt is not None:
        found[node.prompt.store] = frozenset({"text"})
    return found


def _note_mappings(call: CallActivity, caller: _Store, called: _Store) -> None:
    for mapping in call.mappings.inputs:
        caller.reads.append(Read(mapping.source, call.id, mapping.line))
        called.write([mapping.target])
    for mapping in call.mappings.outputs:
        called.reads.append(Read(mapping.source, call.id, mapping.line))
