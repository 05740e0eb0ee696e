"""Processes and subprocesses to any depth: walks their elements with a stack of its own."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from lxml import etree

from m2pem.bpmn.compensation import ASSOCIATION, read_association
from m2pem.bpmn.correlation import read_subscription
from m2pem.bpmn.data import read_data
from m2pem.bpmn.data_flow import read_data_flow
from m2pem.bpmn.flows import SEQUENCE_FLOW, read_flow
from m2pem.bpmn.lanes import read_lanes
from m2pem.bpmn.loops import LOOPS, read_loop
from m2pem.bpmn.names import BPMN, a, kind, local
from m2pem.bpmn.nodes import read_node
from m2pem.bpmn.reading import Reading
from m2pem.bpmn.rules.attributes import UNKNOWN_ELEMENT
from m2pem.bpmn.rules.files import TOO_DEEP
from m2pem.bpmn.scan import Order, Scan
from m2pem.bpmn.schema import FLOW_ELEMENT_NAMES, SHAPES, Shape
from m2pem.mission.elements import Container, Process, SubProcess
from m2pem.mission.near import did_you_mean

MAX_DEPTH = 1000
"""How deep subprocesses may nest in a process."""

_DATA = frozenset(
    BPMN + name for name in ("dataObject", "dataObjectReference", "dataStoreReference", "property")
)
_LANES = BPMN + "laneSet"
_SUBSCRIPTION = BPMN + "correlationSubscription"
_COMPLETION = BPMN + "completionCondition"
_DATA_FLOW = ("ioSpecification", "dataInputAssociation", "dataOutputAssociation")
_MARKS = frozenset((*LOOPS, *(BPMN + name for name in _DATA_FLOW)))


@dataclass(slots=True)
class _Frame:
    container: Container
    element: etree._Element
    shape: Shape
    children: Iterator[etree._Element]
    marks: Scan
    """Its children that say what it does as an activity, read when all others have been."""
    order: Order = field(default_factory=Order)


def read_process(reading: Reading, element: etree._Element) -> None:
    """A process and all that it contains."""
    identifier = reading.claim(element)
    process = Process(
        identifier,
        element.get("name", ""),
        reading.report.line(element),
        reading.boolean(element, "isExecutable", False, identifier),
    )
    reading.processes.append(process)
    stack = [_frame(reading, process, element)]
    while stack:
        frame = stack[-1]
        for child in frame.children:
            inner = _read_child(reading, process, frame, child)
            if inner is None:
                continue
            if len(stack) <= MAX_DEPTH:
                stack.append(_frame(reading, inner, child))
                break
            reading.broken.add(inner)
            reading.report.error(
                child,
                inner.id,
                TOO_DEEP,
                f"subprocesses are nested more than {MAX_DEPTH} deep",
                "move inner subprocesses to processes of their own and call them",
            )
        else:
            stack.pop()
            if isinstance(frame.container, SubProcess):
                read_data_flow(reading, frame.marks, frame.container)
                read_loop(reading, frame.marks, frame.container)


def _frame(reading: Reading, container: Container, element: etree._Element) -> _Frame:
    shape = SHAPES[element.tag]
    reading.check_attributes(element, shape, container.id)
    return _Frame(container, element, shape, iter(element), Scan(element, container.id))


def _read_child(
    reading: Reading, process: Process, frame: _Frame, child: etree._Element
) -> SubProcess | None:
    """Read one child; gives back a subprocess, whose content is still to be read."""
    tag = child.tag
    container = frame.container
    rank = frame.shape.ranks.get(tag)
    if rank is None:
        if tag.startswith(BPMN):
            _refuse_unknown(reading, frame, child)
        return None
    if rank < frame.order.reached:
        frame.order.check(reading, frame.element, child, frame.shape, container.id)
    else:
        frame.order.reached = rank
        frame.order.last = tag
    if tag == SEQUENCE_FLOW:
        read_flow(reading, child, container)
        return None
    if tag in _DATA:
        read_data(reading, child, container)
        return None
    if tag == ASSOCIATION:
        read_association(reading, child)
        return None
    if tag == _LANES:
        read_lanes(reading, child, process)
        return None
    if tag in _MARKS:
        frame.marks.children.setdefault(tag, []).append(child)
        return None
    if tag == _SUBSCRIPTION:
        read_subscription(reading, child, process)
        return None
    if tag == _COMPLETION:
        return None
    node = read_node(reading, child, container)
    if node is None:
        return None
    reading.nodes.append(node)
    reading.containers.append(container)
    return node if isinstance(node, SubProcess) else None


def _refuse_unknown(reading: Reading, frame: _Frame, child: etree._Element) -> None:
    name = local(child.tag)
    reading.broken.add(frame.container)
    reading.report.error(
        child,
        child.get("id", "") or frame.container.id,
        UNKNOWN_ELEMENT,
        f"BPMN has no '{name}' in {a(kind(frame.element.tag))}",
        did_you_mean(name, FLOW_ELEMENT_NAMES, "delete it"),
    )
