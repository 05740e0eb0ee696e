"""What multi-instance activities refer to: collections, and signals of their own.

A collection is a data object, or a data input or output of the activity that data associations
join to one (BPMN 2.0.2, table 10.29). Those associations pass the collection to the whole, not to
each instance.
"""

from collections.abc import Iterator
from dataclasses import replace

from m2pem.bpmn.names import local
from m2pem.bpmn.reading import (
    KEY,
    PendingCall,
    PendingDataFlow,
    PendingLoop,
    Reading,
    text_of,
)
from m2pem.bpmn.rules.events import MISSING_REFERENCE
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.mission.elements import Activity
from m2pem.mission.events import SignalEventDefinition
from m2pem.mission.expression import Expression
from m2pem.mission.loops import MultiInstance
from m2pem.mission.near import did_you_mean


def resolve_loops(reading: Reading) -> None:
    """Give multi-instance activities their collections, now that all data objects are known."""
    flows: dict[Activity, PendingDataFlow | PendingCall] = {}
    for call in reading.calls:
        flows[call.call] = call
    for flow in reading.data_flows:
        if isinstance(flow.node, Activity):
            flows[flow.node] = flow
    for pending in reading.loops:
        node = pending.node
        loop = node.loop
        assert isinstance(loop, MultiInstance)
        own = flows.get(node)
        if pending.collection_ref:
            loop = replace(loop, collection=_collection(reading, pending, own))
        if pending.output_ref:
            loop = replace(loop, output_collection=_output_collection(reading, pending, own))
        object.__setattr__(node, "loop", loop)


def _collection(
    reading: Reading, pending: PendingLoop, own: PendingDataFlow | PendingCall | None
) -> Expression | None:
    ref = pending.collection_ref
    key = reading.data_key(ref)
    if not key and own is not None and ref in own.parameters:
        key = own.parameters[ref]
        passed = [each for each in own.inputs if each.target_ref == ref]
        own.inputs[:] = [each for each in own.inputs if each.target_ref != ref]
        _is_not_own(pending.node, key)
        for association in passed:
            for child in association.element:
                if local(child.tag) == "transformation":
                    text, language = text_of(child), child.get("language")
                    return reading.expression(child, pending.node.id, text, language)
            key = next(_keys(reading, association.source_refs), key)
    key = key or _named(reading, pending, "loopDataInputRef", ref)
    return reading.expression(pending.element, pending.node.id, key, "m2pem") if key else None


def _output_collection(
    reading: Reading, pending: PendingLoop, own: PendingDataFlow | PendingCall | None
) -> str:
    ref = pending.output_ref
    key = reading.data_key(ref)
    if not key and own is not None and ref in own.parameters:
        key = own.parameters[ref]
        passed = [each for each in own.outputs if ref in each.source_refs]
        own.outputs[:] = [each for each in own.outputs if ref not in each.source_refs]
        _is_not_own(pending.node, key)
        key = next(_keys(reading, [each.target_ref for each in passed]), key)
    return key or _named(reading, pending, "loopDataOutputRef", ref)


def _keys(reading: Reading, refs: list[str]) -> Iterator[str]:
    return (key for key in map(reading.data_key, refs) if key)


def _is_not_own(node: Activity, key: str) -> None:
    """The whole has it, not each instance."""
    object.__setattr__(node, "own_data", node.own_data - {key})


def _named(reading: Reading, pending: PendingLoop, attribute: str, ref: str) -> str:
    """Some editors write a name of the data store where BPMN has a reference."""
    where, identifier = pending.element, pending.node.id
    if not KEY.fullmatch(ref):
        remedy = did_you_mean(ref, reading.data, "name a data object")
        what = f"{attribute} names '{ref}', which is no data object"
        reading.report.error(where, identifier, DANGLING_REFERENCE, what, remedy)
        return ""
    reading.report.warning(
        where,
        identifier,
        DANGLING_REFERENCE,
        f"{attribute} names '{ref}', which is no data object, data input or data output here; it "
        "is taken for a name of the data store",
        did_you_mean(ref, reading.data, 'name a data object, or write m2pem:collection="..."'),
    )
    return ref


# --- signals ------------------------------------------------------------------------------------


def join_default_signals(reading: Reading) -> None:
    """Let a boundary signal event that names no signal catch what its activity throws by default.

    A multi-instance activity whose behavior names no event throws a signal of its own (table
    10.29).
    """
    for node in reading.nodes:
        if not isinstance(node, Activity) or not isinstance(node.loop, MultiInstance):
            continue
        for thrown in node.loop.events:
            if isinstance(thrown, SignalEventDefinition) and thrown.signal.id == node.id:
                _catch_default(reading, node, thrown)


def _catch_default(reading: Reading, node: Activity, thrown: SignalEventDefinition) -> None:
    for event in node.boundary:
        definitions = tuple(
            replace(each, signal=thrown.signal)
            if isinstance(each, SignalEventDefinition) and each.signal.id == event.id
            else each
            for each in event.definitions
        )
        if definitions != event.definitions:
            object.__setattr__(event, "definitions", definitions)
            findings = reading.report.findings
            findings[:] = [
                each
                for each in findings
                if (each.element, each.rule) != (event.id, MISSING_REFERENCE.slug)
            ]
