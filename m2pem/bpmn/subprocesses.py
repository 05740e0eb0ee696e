"""Processes and subprocesses to any depth, with their flow nodes.

They are walked with a stack of frames, not by recursion: files may nest as deep as `MAX_DEPTH`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from lxml import etree

from m2pem.bpmn.activities import TASKS, read_activity_attributes
from m2pem.bpmn.children import EXTENSIONS, ChildOrder, Children, read_children
from m2pem.bpmn.collaboration import read_lanes, read_subscription
from m2pem.bpmn.compensation import ASSOCIATION, read_association
from m2pem.bpmn.context import ReadingContext
from m2pem.bpmn.data import read_data, read_data_flow
from m2pem.bpmn.events import read_event
from m2pem.bpmn.gateways import GATEWAYS, read_gateway
from m2pem.bpmn.geometries import read_geometries
from m2pem.bpmn.loops import LOOPS, read_loop
from m2pem.bpmn.rules.attributes import BAD_VALUE, UNKNOWN_ELEMENT
from m2pem.bpmn.rules.files import NOT_EXECUTED, TOO_DEEP
from m2pem.bpmn.rules.subprocesses import AD_HOC_ORDERING
from m2pem.bpmn.rules.tree import EVENTS, SUBPROCESSES, names
from m2pem.bpmn.schema import FLOW_ELEMENT_NAMES, SHAPES, Shape
from m2pem.bpmn.sequence_flows import SEQUENCE_FLOW, read_flow
from m2pem.bpmn.xml import BPMN, M2PEM, ZEEBE, a, kind, local
from m2pem.mission.elements import (
    Activity,
    AdHocOrdering,
    AdHocSubProcess,
    Container,
    ErrorPolicy,
    FlowNode,
    Process,
    SubProcess,
    Transaction,
)
from m2pem.suggestions import suggest_or

_REFUSED = {
    "choreographyTask": "draw the mission as processes",
    "callChoreography": "draw the mission as processes",
    "subChoreography": "draw the mission as processes",
    "event": "use a start, end or intermediate event",
    "implicitThrowEvent": "use an intermediate throw event",
}


def read_node(
    context: ReadingContext, element: etree._Element, container: Container
) -> FlowNode | None:
    """A flow node with all but its flows; None when the tag is that of none."""
    tag = element.tag
    if tag in EVENTS:
        return read_event(context, element, container)
    if tag in GATEWAYS:
        return read_gateway(context, element)
    task = TASKS.get(tag)
    if task is None and tag not in SUBPROCESSES:
        return _refuse(context, element)
    identifier = context.claim(element)
    node: Activity
    if task is None:
        # Its children are read with its content, by `read_process`.
        node = _subprocess(context, element, identifier)
    else:
        found = read_children(context, element, identifier)
        node = task(context, found)
        if tag != BPMN + "callActivity":
            read_data_flow(context, found, node)
        read_loop(context, found, node)
    read_activity_attributes(context, element, node)
    return node


def _refuse(context: ReadingContext, element: etree._Element) -> FlowNode | None:
    instead = _REFUSED.get(local(element.tag))
    if instead is None:
        return None
    not_executed(context, element, instead)
    return FlowNode(*context.head(element, context.claim(element)))


def _subprocess(context: ReadingContext, element: etree._Element, identifier: str) -> SubProcess:
    triggered = context.boolean(element, "triggeredByEvent", False, identifier)
    if triggered and element.tag != BPMN + "subProcess":
        context.findings.error(
            element,
            identifier,
            BAD_VALUE,
            f"{a(kind(element.tag))} cannot be an event subprocess too",
            'put it into a plain <subProcess triggeredByEvent="true">, behind a start event',
        )
    if element.tag == BPMN + "adHocSubProcess":
        return read_ad_hoc(context, element, identifier)
    made = Transaction if element.tag == BPMN + "transaction" else SubProcess
    return made(*context.head(element, identifier), triggered)


def not_executed(context: ReadingContext, element: etree._Element, instead: str) -> None:
    """Report an element of BPMN that m2pem does not execute."""
    what = f"m2pem does not execute {a(kind(element.tag))} yet"
    context.findings.error(element, element.get("id", ""), NOT_EXECUTED, what, instead)


MAX_DEPTH = 1000
"""How deep subprocesses may nest in a process."""

_DATA = names("dataObject dataObjectReference dataStoreReference property")
_LANES = BPMN + "laneSet"
_SUBSCRIPTION = BPMN + "correlationSubscription"
_COMPLETION = BPMN + "completionCondition"
_MARKS = names("ioSpecification dataInputAssociation dataOutputAssociation") | {*LOOPS, EXTENSIONS}


@dataclass(slots=True)
class _Frame:
    container: Container
    element: etree._Element
    shape: Shape
    children: Iterator[etree._Element]
    marks: Children
    """Its children that say what it does as an activity, read when all others have been."""
    order: ChildOrder = field(default_factory=ChildOrder)


def _on_error(
    context: ReadingContext, element: etree._Element, identifier: str
) -> ErrorPolicy | None:
    """Read what an error of the process does that no event catches; None: it does not say."""
    text = element.get(M2PEM + "onError")
    if text is None or text in list(ErrorPolicy):
        return None if text is None else ErrorPolicy(text)
    context.findings.error(
        element,
        identifier,
        BAD_VALUE,
        f"m2pem:onError='{text}' says nothing that m2pem knows",
        'write m2pem:onError="incident" or m2pem:onError="end", or delete it',
    )
    return None


def read_process(context: ReadingContext, element: etree._Element) -> None:
    """Read a process and all that it contains."""
    identifier = context.claim(element)
    process = Process(
        *context.head(element, identifier),
        context.boolean(element, "isExecutable", False, identifier),
        on_error=_on_error(context, element, identifier),
        incident_role=(element.get(M2PEM + "incidentRole") or "").strip(),
    )
    context.processes.append(process)
    read_geometries(context, element, identifier)
    stack = [_frame(context, process, element)]
    while stack:
        frame = stack[-1]
        for child in frame.children:
            inner = _read_child(context, process, frame, child)
            if inner is None:
                continue
            if len(stack) <= MAX_DEPTH:
                stack.append(_frame(context, inner, child))
                break
            context.broken.add(inner)
            context.findings.error(
                child,
                inner.id,
                TOO_DEEP,
                f"subprocesses are nested more than {MAX_DEPTH} deep",
            )
        else:
            stack.pop()
            if isinstance(frame.container, SubProcess):
                read_data_flow(context, frame.marks, frame.container)
                read_loop(context, frame.marks, frame.container)


def _frame(context: ReadingContext, container: Container, element: etree._Element) -> _Frame:
    shape = SHAPES[element.tag]
    context.check_attributes(element, shape, container.id)
    return _Frame(container, element, shape, iter(element), Children(element, container.id))


def _read_child(
    context: ReadingContext, process: Process, frame: _Frame, child: etree._Element
) -> SubProcess | None:
    """Read one child; gives back a subprocess, whose content is still to be read."""
    tag = child.tag
    container = frame.container
    rank = frame.shape.ranks.get(tag)
    if rank is None:
        if tag.startswith(BPMN):
            _refuse_unknown(context, frame, child)
        return None
    if rank < frame.order.reached:
        frame.order.check(context, frame.element, child, frame.shape, container.id)
    else:
        frame.order.reached = rank
        frame.order.last = tag
    if tag == SEQUENCE_FLOW:
        read_flow(context, child, container)
    elif tag in _DATA:
        read_data(context, child, container)
    elif tag == ASSOCIATION:
        read_association(context, child)
    elif tag == _LANES:
        read_lanes(context, child, process)
    elif tag in _MARKS:
        frame.marks.children.setdefault(tag, []).append(child)
    elif tag == _SUBSCRIPTION:
        read_subscription(context, child, process)
    elif tag != _COMPLETION and (node := read_node(context, child, container)) is not None:
        context.nodes.append(node)
        context.containers.append(container)
        return node if isinstance(node, SubProcess) else None
    return None


def _refuse_unknown(context: ReadingContext, frame: _Frame, child: etree._Element) -> None:
    name = local(child.tag)
    context.broken.add(frame.container)
    context.findings.error(
        child,
        child.get("id", "") or frame.container.id,
        UNKNOWN_ELEMENT,
        f"BPMN has no '{name}' in {a(kind(frame.element.tag))}",
        suggest_or(name, FLOW_ELEMENT_NAMES, "delete it"),
    )


def read_ad_hoc(
    context: ReadingContext, element: etree._Element, identifier: str
) -> AdHocSubProcess:
    """An ad-hoc subprocess; what is in it is read with the content of all subprocesses."""
    ordering = element.get("ordering", AdHocOrdering.PARALLEL.value)
    if ordering not in [each.value for each in AdHocOrdering]:
        context.findings.error(
            element, identifier, AD_HOC_ORDERING, f"ordering='{ordering}' is none that BPMN knows"
        )
        ordering = AdHocOrdering.PARALLEL.value
    return AdHocSubProcess(
        *context.head(element, identifier),
        ordering=AdHocOrdering(ordering),
        completion=context.first_expression(element.iterchildren(_COMPLETION), identifier),
        cancel_remaining=context.boolean(element, "cancelRemainingInstances", True, identifier),
        active_elements=context.own_expression(
            element, identifier, "activeElements", (ZEEBE + "adHoc", "activeElementsCollection")
        ),
    )
