"""What BPMN asks of the linked graph: a beginning, and conditions in place."""

from m2pem.bpmn.reading import Reading
from m2pem.bpmn.rules.sequence_flows import CONDITION_IGNORED, CONDITION_NOT_ALLOWED
from m2pem.bpmn.rules.subprocesses import EMPTY_PROCESS, EMPTY_SUBPROCESS, NO_START, UNREACHABLE
from m2pem.findings import Finding
from m2pem.mission.elements import (
    Container,
    Event,
    FlowNode,
    IntermediateCatchEvent,
    ParallelGateway,
    SubProcess,
)
from m2pem.mission.events import LinkEventDefinition
from m2pem.mission.reach import unreached

_set = object.__setattr__


def check_graph(reading: Reading) -> None:
    """Find what can never begin, and conditions that nothing decides."""
    _check_processes(reading)
    for container in _containers(reading):
        if container in reading.broken:
            continue
        if container.nodes:
            _check_start(reading, container)
        elif isinstance(container, SubProcess):
            reading.report.warning(
                container.line,
                container.id,
                EMPTY_SUBPROCESS,
                "the subprocess is empty; it ends as soon as it is entered",
                "draw its content, or make it a task",
            )
    _check_conditions(reading)


def _check_processes(reading: Reading) -> None:
    called = {pending.call.called_id for pending in reading.calls}
    filled = any(process.nodes for process in reading.processes)
    for process in reading.processes:
        if process.nodes:
            continue
        say = reading.report.error
        if filled and process.id not in called:
            say = reading.report.warning  # a pool that was drawn closed
        say(
            process.line,
            process.id,
            EMPTY_PROCESS,
            "the process has no elements",
            "draw its content, or delete it",
        )


def _check_start(reading: Reading, container: Container) -> None:
    if isinstance(container, SubProcess) and container.triggered_by_event:
        if not container.starts:
            reading.report.error(
                container.line,
                container.id,
                NO_START,
                "an event subprocess begins with its start event, and it has none",
                "add a start event that says what it waits for",
            )
    elif not container.entries and reading.self_starting.isdisjoint(container.nodes):
        reading.report.error(
            container.line,
            container.id,
            NO_START,
            "nothing in it can start: there is no start event, and every element has an incoming "
            "flow or waits for a trigger",
            "add a start event",
        )


def add_unreachable(reading: Reading) -> None:
    """Say, of a mission that is refused anyway, what `lint` says of others."""
    for container in _containers(reading):
        if container in reading.broken or not container.entries:
            continue
        loose = [node for node in container.nodes if node in reading.self_starting]
        for node in unreached(container, loose):
            finding = unreachable(reading.report.file, node)
            reading.report.findings.append(finding)


def unreachable(file: str, node: FlowNode) -> Finding:
    """The finding about one of them."""
    what = "no start event can reach it" if node.container.starts else "nothing can reach it"
    remedy = "draw a sequence flow to it, or delete it"
    if isinstance(node, IntermediateCatchEvent):
        for definition in node.definitions:
            if isinstance(definition, LinkEventDefinition):
                remedy = f"add a link throw event of the name '{definition.name}', or delete it"
    message = f"{what}, so it would never run"
    return UNREACHABLE.finding(file, node.line, node.id, message, remedy)


def _containers(reading: Reading) -> list[Container]:
    inner = [node for node in reading.nodes if isinstance(node, SubProcess)]
    return [*reading.processes, *inner]


def _check_conditions(reading: Reading) -> None:
    for ends in reading.flows:
        flow = ends.flow
        if flow.condition is None or ends.container in reading.broken:
            continue
        if isinstance(flow.source, ParallelGateway):
            reading.report.warning(
                flow.line,
                flow.id,
                CONDITION_IGNORED,
                "a parallel gateway takes every flow; the condition is ignored",
                "delete the condition, or make the gateway inclusive",
            )
            _set(flow, "condition", None)
        elif isinstance(flow.source, Event):
            reading.report.error(
                flow.line,
                flow.id,
                CONDITION_NOT_ALLOWED,
                "BPMN allows no condition on a flow out of an event",
                "put an exclusive gateway behind the event",
            )
