"""One mission of all its files.

The ids of other files' elements get the file's name in front (`survey:Start`; no XML id has a
colon), and only the processes that are called take part. Signals, messages and correlation
properties with one id are one, whatever files they are in.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from m2pem.bpmn.files import Files, Part
from m2pem.mission.elements import (
    CallActivity,
    Container,
    Element,
    FlowNode,
    Process,
    SequenceFlow,
    SubProcess,
)
from m2pem.mission.events import CorrelationProperty, Message, RootElement, Signal
from m2pem.mission.mission import Mission

Root = TypeVar("Root", bound=RootElement)
Operated = TypeVar("Operated", Signal, Message)

_set = object.__setattr__


def merge(files: Files, reached: set[Process]) -> Mission:
    """The mission that files without an error make; `reached`: the processes that take part."""
    parts = [part for part in files.parts if part.is_read]
    for part in files.parts[1:]:
        _qualify(part)
    inside = _inside(reached, parts)
    nodes = [node for part in parts for node in part.reading.nodes if node.container in inside]
    flows = [ends.flow for part in parts for ends in part.reading.flows if ends.container in inside]
    processes = [p for part in parts for p in part.reading.processes if p in reached]
    for index, node in enumerate(nodes):
        if node.index != index:
            _set(node, "index", index)
        if isinstance(node, CallActivity):
            _set(node, "called_id", node.called.id)
    for index, flow in enumerate(flows):
        if flow.index != index:
            _set(flow, "index", index)
    readings = [part.reading for part in parts]
    main = files.main.reading
    return Mission(
        file=files.main.name,
        source=files.main.data,
        processes=tuple(processes),
        nodes=tuple(nodes),
        flows=tuple(flows),
        signals=_operated([reading.signals for reading in readings]),
        messages=_operated([reading.messages for reading in readings]),
        errors=_first([reading.errors for reading in readings]),
        escalations=_first([reading.escalations for reading in readings]),
        participants=tuple(main.participants),
        message_flows=tuple(flow for flow, _ in main.message_flows),
        lanes=tuple(main.lanes),
        warnings=tuple(each for part in files.parts for each in part.reading.report.sorted()),
        elements=_elements(nodes, flows, processes),
        associated=frozenset().union(*(reading.written_keys for reading in readings)),
        data_stores=frozenset(
            reading.data_key(store) for reading in readings for store in reading.data_stores
        ),
        correlation_properties=_correlation(parts),
        library=files.sources(),
    )


def _inside(reached: set[Process], parts: list[Part]) -> set[Container]:
    """Those processes, and the subprocesses in them."""
    inner = [each for part in parts for each in part.reading.nodes if isinstance(each, SubProcess)]
    return {*reached, *(each for each in inner if each.process in reached)}


def _qualify(part: Part) -> None:
    """Put the file's name in front of ids; also of events' own signals and the like, which have
    the id of their event and are nobody else's."""
    reading = part.reading
    elements: list[Element] = [*reading.processes, *reading.nodes]
    elements += [ends.flow for ends in reading.flows]
    for element in elements:
        _set(element, "qualifier", part.qualifier)
        _set(element, "id", f"{part.qualifier}:{element.id}")
    for process in reading.processes:
        _set(process, "file", part.name)
    _qualify_roots(part, reading.signals)
    _qualify_roots(part, reading.messages)
    _qualify_roots(part, reading.errors)
    _qualify_roots(part, reading.escalations)


def _qualify_roots(part: Part, table: dict[str, Root]) -> None:
    for identifier, root in list(table.items()):
        if not root.file:
            _set(root, "file", part.name)
        if identifier not in part.reading.declared_roots:
            _set(root, "id", f"{part.qualifier}:{identifier}")
            table[root.id] = table.pop(identifier)


def _elements(
    nodes: list[FlowNode], flows: list[SequenceFlow], processes: list[Process]
) -> dict[str, Element]:
    """By id. A global task's process has the id of the task, which is the one to be found."""
    drawn = [process for process in processes if not process.global_task]
    everything: list[Element] = [*flows, *nodes, *drawn]
    return {element.id: element for element in everything}


def _first(tables: list[dict[str, Root]]) -> dict[str, Root]:
    found: dict[str, Root] = {}
    for table in tables:
        for identifier, root in table.items():
            found.setdefault(identifier, root)
    return found


def _operated(tables: list[dict[str, Operated]]) -> Mapping[str, Operated]:
    """Operators send what any file says they send."""
    found = _first(tables)
    for table in tables:
        for identifier, root in table.items():
            first = found[identifier]
            if root.from_operator and not first.from_operator:
                found[identifier] = replace(first, from_operator=True)
                _set(found[identifier], "file", first.file)
    return found


def _correlation(parts: list[Part]) -> tuple[CorrelationProperty, ...]:
    found: dict[str, CorrelationProperty] = {}
    for part in parts:
        for each in part.correlation:
            known = found.setdefault(each.id, each)
            found[each.id] = replace(known, retrieve={**each.retrieve, **known.retrieve})
    return tuple(found.values())
