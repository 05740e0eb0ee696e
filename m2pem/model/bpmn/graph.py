"""What BPMN asks of the linked graph: a beginning, reachable elements, conditions in place."""

from m2pem.model.bpmn.reading import Reading
from m2pem.model.elements import (
    Activity,
    Container,
    Event,
    FlowNode,
    ParallelGateway,
    SubProcess,
)

_set = object.__setattr__


def check_graph(reading: Reading) -> None:
    """Find what no token can begin, reach or decide."""
    _check_processes(reading)
    containers: list[Container] = list(reading.processes)
    containers += [node for node in reading.nodes if isinstance(node, SubProcess)]
    for container in containers:
        if container.nodes and container not in reading.broken:
            _check_reached(reading, container)
        elif not container.nodes and isinstance(container, SubProcess):
            reading.report.warning(
                container.line,
                container.id,
                "empty-subprocess",
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
            "empty-process",
            "the process has no elements",
            "draw its content, or delete it",
        )


def _check_reached(reading: Reading, container: Container) -> None:
    loose = [node for node in container.nodes if node in reading.self_starting]
    waiting: list[FlowNode] = [*container.entries, *loose]
    if not waiting:
        reading.report.error(
            container.line,
            container.id,
            "no-start",
            "nothing in it can start: there is no start event, and every element has an incoming "
            "flow",
            "add a start event",
        )
        return
    reached = set(waiting)
    while waiting:
        node = waiting.pop()
        following = [flow.target for flow in node.outgoing]
        if isinstance(node, Activity):
            following += node.boundary
        for each in following:
            if each not in reached:
                reached.add(each)
                waiting.append(each)
    for node in container.nodes:
        if node not in reached:
            what = "no start event can reach it" if container.starts else "nothing can reach it"
            reading.report.error(
                node.line,
                node.id,
                "unreachable",
                f"{what}, so it would never run",
                "draw a sequence flow to it, or delete it",
            )


def _check_conditions(reading: Reading) -> None:
    for ends in reading.flows:
        flow = ends.flow
        if flow.condition is None or ends.container in reading.broken:
            continue
        if isinstance(flow.source, ParallelGateway):
            reading.report.warning(
                flow.line,
                flow.id,
                "condition-ignored",
                "a parallel gateway takes every flow; the condition is ignored",
                "delete the condition, or make the gateway inclusive",
            )
            _set(flow, "condition", None)
        elif isinstance(flow.source, Event):
            reading.report.error(
                flow.line,
                flow.id,
                "condition-not-allowed",
                "BPMN allows no condition on a flow out of an event",
                "put an exclusive gateway behind the event",
            )
