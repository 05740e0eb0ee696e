"""Sequence flows: read, linked to their nodes, checked as a graph (BPMN 2.0.2, 8.4.13 and 13.2).

`link` also links the other elements. Readers set fields of elements after these are made; nothing
does so once the mission is read.
"""

from lxml import etree

from m2pem.bpmn.children import ChildOrder
from m2pem.bpmn.context import FlowEnds, ReadingContext, reference, text_of
from m2pem.bpmn.events import is_link_target, resolve_links
from m2pem.bpmn.rules.events import BAD_ATTACHMENT
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.rules.sequence_flows import (
    CONDITION_IGNORED,
    CONDITION_NOT_ALLOWED,
    DEFAULT_NOT_OWN,
    DEFAULT_WITH_CONDITION,
    EMPTY_CONDITION,
    FLOW_CROSSES_BORDER,
    FLOW_INTO_BOUNDARY,
    FLOW_INTO_START,
    FLOW_OUT_OF_END,
)
from m2pem.bpmn.rules.subprocesses import EMPTY_PROCESS, EMPTY_SUBPROCESS, NO_START, UNREACHABLE
from m2pem.bpmn.schema import SHAPES
from m2pem.bpmn.xml import BPMN, a
from m2pem.findings import Finding
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    ComplexGateway,
    Container,
    DataObject,
    EndEvent,
    Event,
    ExclusiveGateway,
    FlowNode,
    Gateway,
    InclusiveGateway,
    IntermediateCatchEvent,
    ParallelGateway,
    Process,
    SequenceFlow,
    StartEvent,
    SubProcess,
)
from m2pem.mission.events import LinkEventDefinition
from m2pem.mission.expression import Expression
from m2pem.mission.reachability import begins_by_itself, instantiates, unreached
from m2pem.suggestions import suggest_or

SEQUENCE_FLOW = BPMN + "sequenceFlow"
_CONDITION = BPMN + "conditionExpression"
_SHAPE = SHAPES[SEQUENCE_FLOW]


def read_flow(context: ReadingContext, element: etree._Element, container: Container) -> None:
    """Read a sequence flow; its ends are linked when all nodes are known."""
    identifier = context.claim(element)
    context.check_attributes(element, _SHAPE, identifier)
    condition = None
    if len(element):
        order = ChildOrder()
        for child in element:
            order.check(context, element, child, _SHAPE, identifier)
            if child.tag == _CONDITION:
                condition = _condition(context, child, identifier)
    flow = SequenceFlow(*context.head(element, identifier), condition)
    context.flows.append(
        FlowEnds(
            flow,
            reference(element.get("sourceRef", "")),
            reference(element.get("targetRef", "")),
            container,
        )
    )


def _condition(
    context: ReadingContext, element: etree._Element, identifier: str
) -> Expression | None:
    context.check_attributes(element, SHAPES[_CONDITION], identifier)
    if not text_of(element):
        context.findings.warning(
            element,
            identifier,
            EMPTY_CONDITION,
            "the condition is empty; the flow counts as one without a condition",
        )
        return None
    return context.expression_in(element, identifier)


_set = object.__setattr__

_NO_TARGETS = (StartEvent, BoundaryEvent)
"""No sequence flow leads to them."""


def link(context: ReadingContext) -> None:
    """Link nodes, flows and containers to each other, and report references to nothing."""
    nodes: dict[str, FlowNode] = {}
    for index, (node, container) in enumerate(zip(context.nodes, context.containers, strict=True)):
        _set(node, "index", index)
        _set(node, "container", container)
        if node.id not in nodes:
            nodes[node.id] = node
        else:
            context.broken.add(container)
    _link_flows(context, nodes)
    _link_containers(context)
    _link_defaults(context)
    _link_boundary(context, nodes)
    resolve_links(context)


def _link_flows(context: ReadingContext, nodes: dict[str, FlowNode]) -> None:
    incoming: list[list[SequenceFlow]] = [[] for _ in context.nodes]
    outgoing: list[list[SequenceFlow]] = [[] for _ in context.nodes]
    for index, ends in enumerate(context.flows):
        flow = ends.flow
        _set(flow, "index", index)
        source = nodes.get(ends.source_ref)
        target = nodes.get(ends.target_ref)
        if source is None or target is None:
            if source is None:
                _dangling_end(context, ends, "sourceRef", ends.source_ref, nodes)
            if target is None:
                _dangling_end(context, ends, "targetRef", ends.target_ref, nodes)
            context.broken.add(ends.container)
            continue
        _set(flow, "source", source)
        _set(flow, "target", target)
        if source.container is not target.container:
            _crossing(context, flow, source, target)
            continue
        outgoing[source.index].append(flow)
        incoming[target.index].append(flow)
        if isinstance(target, _NO_TARGETS) or isinstance(source, EndEvent):
            _wrong_end(context, flow, source, target)
    for node, comes, goes in zip(context.nodes, incoming, outgoing, strict=True):
        _set(node, "incoming", tuple(comes))
        _set(node, "outgoing", tuple(goes))


def _dangling_end(
    context: ReadingContext, ends: FlowEnds, attribute: str, name: str, nodes: dict[str, FlowNode]
) -> None:
    context.broken.add(ends.container)
    if not name:
        message = f"the sequence flow has no {attribute}"
    elif name in context.ids:
        message = (
            f"{attribute} names '{name}', but the element on line {context.ids[name]} is no "
            "activity, gateway or event"
        )
    else:
        message = f"{attribute} names '{name}', but no element has that id"
    context.findings.error(
        ends.flow.line,
        ends.flow.id,
        DANGLING_REFERENCE,
        message,
        suggest_or(name, nodes, "name an activity, gateway or event, or delete the flow"),
    )


def _crossing(
    context: ReadingContext, flow: SequenceFlow, source: FlowNode, target: FlowNode
) -> None:
    context.broken |= {source.container, target.container}
    context.findings.error(
        flow.line,
        flow.id,
        FLOW_CROSSES_BORDER,
        f"the sequence flow leads from '{source.id}' in {_called(source.container)} to "
        f"'{target.id}' in {_called(target.container)}",
    )


def _called(container: Container) -> str:
    word = "process" if isinstance(container, Process) else "subprocess"
    return f"{word} '{container.id}'"


def _wrong_end(
    context: ReadingContext, flow: SequenceFlow, source: FlowNode, target: FlowNode
) -> None:
    if isinstance(source, EndEvent):
        rule, said = FLOW_OUT_OF_END, f"out of the end event '{source.id}'"
    elif isinstance(target, BoundaryEvent):
        rule, said = FLOW_INTO_BOUNDARY, f"into the boundary event '{target.id}'"
    else:
        rule, said = FLOW_INTO_START, f"into the start event '{target.id}'"
    context.findings.error(flow.line, flow.id, rule, f"no sequence flow can lead {said}")


def _link_containers(context: ReadingContext) -> None:
    nodes: dict[Container, list[FlowNode]] = {}
    flows: dict[Container, list[SequenceFlow]] = {}
    data: dict[Container, list[DataObject]] = {}
    for node in context.nodes:
        nodes.setdefault(node.container, []).append(node)
    for ends in context.flows:
        flows.setdefault(ends.container, []).append(ends.flow)
    for container, declared in context.declared:
        data.setdefault(container, []).append(declared)
    for container, inside in nodes.items():
        _set(container, "nodes", tuple(inside))
        starts = [
            node
            for node in inside
            if isinstance(node, StartEvent) or (instantiates(node) and not node.incoming)
        ]
        _set(
            container,
            "entries",
            tuple(starts or [node for node in inside if _begins(context, node)]),
        )
        handlers = [n for n in inside if isinstance(n, SubProcess) and n.triggered_by_event]
        _set(container, "event_subprocesses", tuple(handlers))
    for container, between in flows.items():
        _set(container, "flows", tuple(between))
    for container, objects in data.items():
        _set(container, "data", tuple(objects))


def _begins(context: ReadingContext, node: FlowNode) -> bool:
    return (
        not node.incoming
        and not isinstance(node, BoundaryEvent)
        and not begins_by_itself(node)
        and not is_link_target(node)
        and node not in context.self_starting
    )


def _link_defaults(context: ReadingContext) -> None:
    flows = {ends.flow.id for ends in context.flows} if context.defaults else set()
    for node, ref, line in context.defaults:
        flow = next((flow for flow in node.outgoing if flow.id == ref), None)
        if flow is not None:
            if isinstance(node, Activity | ComplexGateway | ExclusiveGateway | InclusiveGateway):
                _set(node, "default", flow)
            if flow.condition is not None:
                context.findings.warning(
                    flow.line,
                    flow.id,
                    DEFAULT_WITH_CONDITION,
                    f"the condition of a default flow is ignored (it is that of '{node.id}')",
                )
                _set(flow, "condition", None)
        elif ref in flows:
            context.findings.error(
                line,
                node.id,
                DEFAULT_NOT_OWN,
                f"the default flow '{ref}' does not leave '{node.id}'",
            )
        else:
            context.findings.error(
                line,
                node.id,
                DANGLING_REFERENCE,
                f"default names '{ref}', but no sequence flow has that id",
                suggest_or(
                    ref,
                    [flow.id for flow in node.outgoing],
                    "name one of its own outgoing sequence flows, or delete it",
                ),
            )


def _link_boundary(context: ReadingContext, nodes: dict[str, FlowNode]) -> None:
    attached: dict[Activity, list[BoundaryEvent]] = {}
    for event, ref in context.attachments:
        host = nodes.get(ref)
        if isinstance(host, Activity) and host.container is event.container:
            _set(event, "attached_to", host)
            attached.setdefault(host, []).append(event)
            continue
        context.broken.add(event.container)
        rule, remedy = BAD_ATTACHMENT, "attach it to an activity of the same process"
        if not ref:
            message = "the boundary event says not to which activity it is attached"
        elif host is None:
            rule = DANGLING_REFERENCE
            message = f"attachedToRef names '{ref}', but no flow node has that id"
            remedy = suggest_or(ref, nodes, remedy)
        elif isinstance(host, Activity):
            message = f"attachedToRef names '{ref}', which is in {_called(host.container)}"
        else:
            word = "gateway" if isinstance(host, Gateway) else "event"
            message = f"attachedToRef names '{ref}', which is {a(word)} and no activity"
        context.findings.error(event.line, event.id, rule, message, remedy)
    for host, events in attached.items():
        _set(host, "boundary", tuple(events))


def check_graph(context: ReadingContext) -> None:
    """Report elements that can never begin, and conditions that are not evaluated."""
    _check_processes(context)
    for container in _containers(context):
        if container in context.broken:
            continue
        if container.nodes:
            _check_start(context, container)
        elif isinstance(container, SubProcess):
            context.findings.warning(
                container.line,
                container.id,
                EMPTY_SUBPROCESS,
                "the subprocess is empty; it ends as soon as it is entered",
            )
    _check_conditions(context)


def _check_processes(context: ReadingContext) -> None:
    called = {pending.call.called_id for pending in context.calls}
    filled = any(process.nodes for process in context.processes)
    for process in context.processes:
        if process.nodes:
            continue
        say = context.findings.error
        if filled and process.id not in called:
            say = context.findings.warning  # a pool that was drawn closed
        say(process.line, process.id, EMPTY_PROCESS, "the process has no elements")


def _check_start(context: ReadingContext, container: Container) -> None:
    if isinstance(container, SubProcess) and container.triggered_by_event:
        if not container.starts:
            context.findings.error(
                container.line,
                container.id,
                NO_START,
                "an event subprocess begins with its start event, and it has none",
                "add a start event that says what it waits for",
            )
    elif not container.entries and context.self_starting.isdisjoint(container.nodes):
        context.findings.error(
            container.line,
            container.id,
            NO_START,
            "nothing in it can start: there is no start event, and every element has an incoming "
            "flow or waits for a trigger",
        )


def add_unreachable(context: ReadingContext) -> None:
    """Report the unreachable elements of a mission that has errors, as `lint` does of others."""
    for container in _containers(context):
        if container in context.broken or not container.entries:
            continue
        loose = [node for node in container.nodes if node in context.self_starting]
        for node in unreached(container, loose):
            finding = unreachable(context.findings.file, node)
            context.findings.all.append(finding)


def unreachable(file: str, node: FlowNode) -> Finding:
    """Return the finding about an unreachable node."""
    what = "no start event can reach it" if node.container.starts else "nothing can reach it"
    remedy = "draw a sequence flow to it, or delete it"
    if isinstance(node, IntermediateCatchEvent):
        for definition in node.definitions:
            if isinstance(definition, LinkEventDefinition):
                remedy = f"add a link throw event of the name '{definition.name}', or delete it"
    message = f"{what}, so it would never run"
    return UNREACHABLE.finding(file, node.line, node.id, message, remedy)


def _containers(context: ReadingContext) -> list[Container]:
    inner = [node for node in context.nodes if isinstance(node, SubProcess)]
    return [*context.processes, *inner]


def _check_conditions(context: ReadingContext) -> None:
    for ends in context.flows:
        flow = ends.flow
        if flow.condition is None or ends.container in context.broken:
            continue
        if isinstance(flow.source, ParallelGateway):
            context.findings.warning(
                flow.line,
                flow.id,
                CONDITION_IGNORED,
                "a parallel gateway takes every flow; the condition is ignored",
            )
            _set(flow, "condition", None)
        elif isinstance(flow.source, Event):
            context.findings.error(
                flow.line,
                flow.id,
                CONDITION_NOT_ALLOWED,
                "BPMN allows no condition on a flow out of an event",
            )
