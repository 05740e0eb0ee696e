"""What is doubtful about a mission as a whole; what is wrong with one element, reading finds.

The findings are warnings, but for elements that no start event can reach and loops that never wait
and have no end: those load, and are errors of `check`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain

from m2pem.bpmn import garbage_collection
from m2pem.bpmn.busy_loops import busy_loops
from m2pem.bpmn.covering_conditions import WrittenValues, uncovered
from m2pem.bpmn.data_names import unwritten
from m2pem.bpmn.rules.activities import CALL_RECURSION
from m2pem.bpmn.rules.events import OUTSIDE_ONLY
from m2pem.bpmn.rules.gateways import INCOMPLETE_CONDITIONS, NO_CONDITIONS
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.sequence_flows import unreachable
from m2pem.findings import Finding
from m2pem.mission.elements import (
    Activity,
    CallActivity,
    Container,
    Event,
    ExclusiveGateway,
    FlowNode,
    InclusiveGateway,
    Process,
    SubProcess,
    caught_by,
    thrown_by,
)
from m2pem.mission.events import ErrorEventDefinition, Message, Signal, signals_and_messages
from m2pem.mission.loops import MultiInstance
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import components, unreached


def lint(
    mission: Mission,
    known_names: Iterable[str] = (),
    service_writes: Mapping[str, Sequence[str]] | None = None,
    behavior_writes: Mapping[str, Sequence[str]] | None = None,
) -> list[Finding]:
    """Look over a whole mission; findings are sorted by file and line.

    `known_names`: names that are written from outside (`--data`), with values in a mapping.
    `service_writes`: what each
    registered service class writes; a class that is not there may write anything.
    `behavior_writes`: what behaviors write, by their names.
    """
    with garbage_collection.paused():
        findings = [
            *_unreachable(mission),
            *_undecided_gateways(mission),
            *_incomplete_conditions(mission, known_names, service_writes, behavior_writes),
            *_outside_only(mission),
            *_recursion(mission),
            *busy_loops(mission, known_names),
            *unwritten(mission, known_names, service_writes or {}, behavior_writes or {}),
        ]
    order = by_file(mission)
    return sorted(findings, key=lambda finding: (order(finding), finding.line))


def by_file(mission: Mission) -> Callable[[Finding], tuple[bool, str]]:
    """Orders findings by file, the mission's own first."""
    return lambda finding: (finding.file != mission.file, finding.file)


def _warning(
    mission: Mission, about: FlowNode | Signal | Message, rule: Rule, message: str, remedy: str = ""
) -> Finding:
    return rule.finding(mission.file_of(about), about.line, about.id, message, remedy)


def _unreachable(mission: Mission) -> Iterator[Finding]:
    inner = [node for node in mission.nodes if isinstance(node, SubProcess)]
    containers: list[Container] = [*mission.processes, *inner]
    for container in containers:
        for node in unreached(container):
            yield unreachable(mission.file_of(node), node)


def _undecided_gateways(mission: Mission) -> Iterator[Finding]:
    for node in mission.nodes:
        if (
            isinstance(node, ExclusiveGateway | InclusiveGateway)
            and len(node.outgoing) > 1
            and all(flow.condition is None for flow in node.outgoing)
        ):
            what = (
                f"it always takes the first, '{node.outgoing[0].id}'"
                if isinstance(node, ExclusiveGateway) and node.default is None
                else "it always takes the same ones"
            )
            yield _warning(
                mission,
                node,
                NO_CONDITIONS,
                f"none of the gateway's {len(node.outgoing)} outgoing flows has a condition; "
                f"{what}",
            )


def _incomplete_conditions(
    mission: Mission,
    known_names: Iterable[str],
    service_writes: Mapping[str, Sequence[str]] | None,
    behavior_writes: Mapping[str, Sequence[str]] | None,
) -> Iterator[Finding]:
    """A warning for each gateway without a default that may find no condition true."""
    undefaulted = [
        node
        for node in mission.nodes
        if isinstance(node, ExclusiveGateway | InclusiveGateway) and node.default is None
    ]
    if not undefaulted or any(_catches_no_flow(node) for node in mission.nodes):
        return
    outside = {
        *known_names,
        *mission.associated,
        *chain.from_iterable((service_writes or {}).values()),
        *chain.from_iterable((behavior_writes or {}).values()),
    }
    written = WrittenValues(mission.nodes, outside)
    for node in undefaulted:
        if not node.outgoing or any(flow.condition is None for flow in node.outgoing):
            continue
        case = uncovered(node, written)
        if case is None:
            continue
        kind = "exclusiveGateway" if isinstance(node, ExclusiveGateway) else "inclusiveGateway"
        last = node.outgoing[-1].id
        yield _warning(
            mission,
            node,
            INCOMPLETE_CONDITIONS,
            "no flow out of the gateway may be true"
            + (f", for example if {case}" if case else "")
            + "; the run then ends with error NO_FLOW, unless an event catches it",
            f'make one the default, <{kind} id="{node.id}" default="{last}">, or cover the case; '
            "m2pem verify shows whether a run can get there",
        )


def _catches_no_flow(node: FlowNode) -> bool:
    """Whether an event names the error, so that the author has thought of it."""
    return isinstance(node, Event) and any(
        isinstance(each, ErrorEventDefinition)
        and each.error is not None
        and each.error.code == "NO_FLOW"
        for each in node.definitions
    )


# --- signals and messages -----------------------------------------------------------------------


def _outside_only(mission: Mission) -> Iterator[Finding]:
    thrown: set[tuple[str, str]] = set()
    caught: dict[tuple[str, str], tuple[Signal | Message, list[FlowNode]]] = {}
    for node in mission.nodes:
        if isinstance(node, Activity) and isinstance(node.loop, MultiInstance):
            for root in _thrown_by_instances(node.loop):
                thrown.add((type(root).__name__, root.id))
        thrown.update((type(root).__name__, root.id) for root in thrown_by(node))
        for root in caught_by(node):
            caught.setdefault((type(root).__name__, root.id), (root, []))[1].append(node)
    for key, (root, catchers) in caught.items():
        known = (mission.signals if isinstance(root, Signal) else mission.messages).get(root.id)
        sent = root.from_operator or (known is not None and known.from_operator)
        if key in thrown or sent or (isinstance(root, Signal) and root.returned):
            continue
        what = key[0].lower()
        waiting = ", ".join(f"'{node.id}'" for node in catchers)
        yield _warning(
            mission,
            root,
            OUTSIDE_ONLY,
            f"{waiting} {'wait' if len(catchers) > 1 else 'waits'} for the {what} "
            f"'{root.name or root.id}', which nothing in the file "
            f"{'throws' if what == 'signal' else 'sends'}",
            f'if operators send it, say so: <{what} id="{root.id}" m2pem:from="operator"/>',
        )


def _thrown_by_instances(loop: MultiInstance) -> Iterator[Signal | Message]:
    yield from signals_and_messages(loop.events)
    for each in loop.complex:
        yield from signals_and_messages(each.events)


# --- calls --------------------------------------------------------------------------------------


def _recursion(mission: Mission) -> Iterator[Finding]:
    """Return one warning for each call through which a process can call itself."""
    calls: dict[Process, list[CallActivity]] = {process: [] for process in mission.processes}
    for node in mission.nodes:
        if isinstance(node, CallActivity):
            calls[node.container.process].append(node)
    group = components(
        {process: [call.called for call in inside] for process, inside in calls.items()}
    )
    for process, inside in calls.items():
        for call in inside:
            if group[call.called] == group[process]:
                yield _warning(
                    mission,
                    call,
                    CALL_RECURSION,
                    f"process '{process.id}' calls itself through '{call.called.id}'"
                    if call.called is not process
                    else f"process '{process.id}' calls itself",
                )
