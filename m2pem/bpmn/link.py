"""Links what was read: references to elements, flows to nodes, nodes to containers, both ways.

The only place that sets the fields of elements after they were made.
"""

from m2pem.bpmn.links import is_link_target, resolve_links
from m2pem.bpmn.names import a
from m2pem.bpmn.reading import FlowEnds, Reading
from m2pem.bpmn.rules.events import BAD_ATTACHMENT
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.rules.sequence_flows import (
    DEFAULT_NOT_OWN,
    DEFAULT_WITH_CONDITION,
    FLOW_CROSSES_BORDER,
    FLOW_INTO_BOUNDARY,
    FLOW_INTO_START,
    FLOW_OUT_OF_END,
)
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    ComplexGateway,
    Container,
    DataObject,
    EndEvent,
    ExclusiveGateway,
    FlowNode,
    Gateway,
    InclusiveGateway,
    Process,
    SequenceFlow,
    StartEvent,
    SubProcess,
)
from m2pem.mission.near import did_you_mean
from m2pem.mission.reach import begins_by_itself, instantiates

_set = object.__setattr__

_NO_TARGETS = (StartEvent, BoundaryEvent)
"""No sequence flow leads to them."""


def link(reading: Reading) -> None:
    """Link all elements."""
    nodes: dict[str, FlowNode] = {}
    for index, (node, container) in enumerate(zip(reading.nodes, reading.containers, strict=True)):
        _set(node, "index", index)
        _set(node, "container", container)
        if node.id not in nodes:
            nodes[node.id] = node
        else:
            reading.broken.add(container)
    _link_flows(reading, nodes)
    _link_containers(reading)
    _link_defaults(reading)
    _link_boundary(reading, nodes)
    resolve_links(reading)


def _link_flows(reading: Reading, nodes: dict[str, FlowNode]) -> None:
    incoming: list[list[SequenceFlow]] = [[] for _ in reading.nodes]
    outgoing: list[list[SequenceFlow]] = [[] for _ in reading.nodes]
    for index, ends in enumerate(reading.flows):
        flow = ends.flow
        _set(flow, "index", index)
        source = nodes.get(ends.source_ref)
        target = nodes.get(ends.target_ref)
        if source is None or target is None:
            if source is None:
                _dangling_end(reading, ends, "sourceRef", ends.source_ref, nodes)
            if target is None:
                _dangling_end(reading, ends, "targetRef", ends.target_ref, nodes)
            reading.broken.add(ends.container)
            continue
        _set(flow, "source", source)
        _set(flow, "target", target)
        if source.container is not target.container:
            _crossing(reading, flow, source, target)
            continue
        outgoing[source.index].append(flow)
        incoming[target.index].append(flow)
        if isinstance(target, _NO_TARGETS) or isinstance(source, EndEvent):
            _wrong_end(reading, flow, source, target)
    for node, comes, goes in zip(reading.nodes, incoming, outgoing, strict=True):
        _set(node, "incoming", tuple(comes))
        _set(node, "outgoing", tuple(goes))


def _dangling_end(
    reading: Reading, ends: FlowEnds, attribute: str, name: str, nodes: dict[str, FlowNode]
) -> None:
    reading.broken.add(ends.container)
    if not name:
        message = f"the sequence flow has no {attribute}"
    elif name in reading.ids:
        message = (
            f"{attribute} names '{name}', but the element on line {reading.ids[name]} is no "
            "activity, gateway or event"
        )
    else:
        message = f"{attribute} names '{name}', but no element has that id"
    reading.report.error(
        ends.flow.line,
        ends.flow.id,
        DANGLING_REFERENCE,
        message,
        did_you_mean(name, nodes, "name an activity, gateway or event, or delete the flow"),
    )


def _crossing(reading: Reading, flow: SequenceFlow, source: FlowNode, target: FlowNode) -> None:
    reading.broken |= {source.container, target.container}
    reading.report.error(
        flow.line,
        flow.id,
        FLOW_CROSSES_BORDER,
        f"the sequence flow leads from '{source.id}' in {_called(source.container)} to "
        f"'{target.id}' in {_called(target.container)}",
        "let it lead from or to the subprocess itself; between pools, draw a message flow",
    )


def _called(container: Container) -> str:
    word = "process" if isinstance(container, Process) else "subprocess"
    return f"{word} '{container.id}'"


def _wrong_end(reading: Reading, flow: SequenceFlow, source: FlowNode, target: FlowNode) -> None:
    if isinstance(source, EndEvent):
        rule = FLOW_OUT_OF_END
        said = f"out of the end event '{source.id}'"
        remedy = "make it an intermediate throw event, or delete the flow"
    elif isinstance(target, BoundaryEvent):
        rule = FLOW_INTO_BOUNDARY
        said = f"into the boundary event '{target.id}'"
        remedy = "lead it to the activity, or to what follows the boundary event"
    else:
        rule = FLOW_INTO_START
        said = f"into the start event '{target.id}'"
        remedy = "lead it to what follows the start event"
    reading.report.error(flow.line, flow.id, rule, f"no sequence flow can lead {said}", remedy)


def _link_containers(reading: Reading) -> None:
    nodes: dict[Container, list[FlowNode]] = {}
    flows: dict[Container, list[SequenceFlow]] = {}
    data: dict[Container, list[DataObject]] = {}
    for node in reading.nodes:
        nodes.setdefault(node.container, []).append(node)
    for ends in reading.flows:
        flows.setdefault(ends.container, []).append(ends.flow)
    for container, declared in reading.declared:
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
            tuple(starts or [node for node in inside if _begins(reading, node)]),
        )
        handlers = [n for n in inside if isinstance(n, SubProcess) and n.triggered_by_event]
        _set(container, "event_subprocesses", tuple(handlers))
    for container, between in flows.items():
        _set(container, "flows", tuple(between))
    for container, objects in data.items():
        _set(container, "data", tuple(objects))


def _begins(reading: Reading, node: FlowNode) -> bool:
    return (
        not node.incoming
        and not isinstance(node, BoundaryEvent)
        and not begins_by_itself(node)
        and not is_link_target(node)
        and node not in reading.self_starting
    )


def _link_defaults(reading: Reading) -> None:
    flows = {ends.flow.id for ends in reading.flows} if reading.defaults else set()
    for node, ref, line in reading.defaults:
        flow = next((flow for flow in node.outgoing if flow.id == ref), None)
        if flow is not None:
            if isinstance(node, Activity | ComplexGateway | ExclusiveGateway | InclusiveGateway):
                _set(node, "default", flow)
            if flow.condition is not None:
                reading.report.warning(
                    flow.line,
                    flow.id,
                    DEFAULT_WITH_CONDITION,
                    f"the condition of a default flow is ignored (it is that of '{node.id}')",
                    "delete the condition, or make another flow the default",
                )
                _set(flow, "condition", None)
        elif ref in flows:
            reading.report.error(
                line,
                node.id,
                DEFAULT_NOT_OWN,
                f"the default flow '{ref}' does not leave '{node.id}'",
                "name one of its own outgoing sequence flows",
            )
        else:
            reading.report.error(
                line,
                node.id,
                DANGLING_REFERENCE,
                f"default names '{ref}', but no sequence flow has that id",
                did_you_mean(
                    ref,
                    [flow.id for flow in node.outgoing],
                    "name one of its own outgoing sequence flows, or delete it",
                ),
            )


def _link_boundary(reading: Reading, nodes: dict[str, FlowNode]) -> None:
    attached: dict[Activity, list[BoundaryEvent]] = {}
    for event, ref in reading.attachments:
        host = nodes.get(ref)
        if isinstance(host, Activity) and host.container is event.container:
            _set(event, "attached_to", host)
            attached.setdefault(host, []).append(event)
            continue
        reading.broken.add(event.container)
        rule, remedy = BAD_ATTACHMENT, "attach it to an activity of the same process"
        if not ref:
            message = "the boundary event says not to which activity it is attached"
        elif host is None:
            rule = DANGLING_REFERENCE
            message = f"attachedToRef names '{ref}', but no flow node has that id"
            remedy = did_you_mean(ref, nodes, remedy)
        elif isinstance(host, Activity):
            message = f"attachedToRef names '{ref}', which is in {_called(host.container)}"
        else:
            word = "gateway" if isinstance(host, Gateway) else "event"
            message = f"attachedToRef names '{ref}', which is {a(word)} and no activity"
        reading.report.error(event.line, event.id, rule, message, remedy)
    for host, events in attached.items():
        _set(host, "boundary", tuple(events))
