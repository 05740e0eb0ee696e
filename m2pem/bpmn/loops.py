"""Loop and multi-instance markers of activities (BPMN 2.0.2, clause 10.3.8).

The collection of a multi-instance activity is a data object, or a data input or output of the
activity that data associations join to one (table 10.29). Those associations pass the collection
to the whole activity, not to each instance.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from lxml import etree

from m2pem.bpmn.children import Children, read_children
from m2pem.bpmn.context import (
    KEY,
    DataEnd,
    PendingCall,
    PendingDataFlow,
    PendingLoop,
    ReadingContext,
    reference,
    text_of,
)
from m2pem.bpmn.events import definition_elements, read_thrown, referred_definition
from m2pem.bpmn.foreign_elements import ENGINES
from m2pem.bpmn.rules.data import BAD_KEY
from m2pem.bpmn.rules.events import MISSING_REFERENCE
from m2pem.bpmn.rules.loops import (
    COMPLEX_BEHAVIOR,
    INSTANCE_COUNT,
    INSTANCES_BEHAVIOR,
    INSTANCES_COUNTED_TWICE,
    LOOP_MAXIMUM,
    LOOP_NOT_ALLOWED,
    NO_LOOP,
    TWO_LOOPS,
)
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.xml import BPMN, M2PEM, ZEEBE, local
from m2pem.mission.elements import Activity, SubProcess
from m2pem.mission.events import EventDefinition, Signal, SignalEventDefinition
from m2pem.mission.expression import Expression
from m2pem.mission.loops import ComplexBehavior, InstanceBehavior, MultiInstance, StandardLoop
from m2pem.suggestions import suggest_or

_STANDARD = BPMN + "standardLoopCharacteristics"
_MULTI_INSTANCE = BPMN + "multiInstanceLoopCharacteristics"
LOOPS = (_STANDARD, _MULTI_INSTANCE, BPMN + "loopCharacteristics")
_MARKERS = frozenset(LOOPS)

_EDITORS = (M2PEM, *ENGINES)
"""Whose attributes `collection` and `elementVariable` mean the same."""

_NUMBER = re.compile(r"[0-9]{1,18}")
_EVENT_REFS = {
    InstanceBehavior.NONE: "noneBehaviorEventRef",
    InstanceBehavior.ONE: "oneBehaviorEventRef",
}


def read_loop(context: ReadingContext, found: Children, node: Activity) -> None:
    """The marker of an activity, if it has any; `resolve_loops` adds what data objects say."""
    if _MARKERS.isdisjoint(found.children):
        return
    markers = [each for tag in LOOPS for each in found.children.get(tag, [])]
    element = markers[0]
    if len(markers) > 1:
        what = "an activity has one loop marker"
        context.findings.error(markers[1], node.id, TWO_LOOPS, what, "keep one")
    if isinstance(node, SubProcess) and node.triggered_by_event:
        context.findings.error(
            element,
            node.id,
            LOOP_NOT_ALLOWED,
            "an event subprocess is begun by its start event, as often as that is triggered; it "
            "cannot have a loop marker",
        )
    loop: StandardLoop | MultiInstance
    if element.tag == _STANDARD:
        loop = _standard_loop(context, element, node)
    elif element.tag == _MULTI_INSTANCE:
        loop = _multi_instance(context, found, element, node)
        if loop.output_item:
            own = frozenset({*node.own_data, loop.output_item})
            object.__setattr__(node, "own_data", own)
    else:
        context.findings.error(element, node.id, NO_LOOP, "it does not say which kind of loop")
        return
    object.__setattr__(node, "loop", loop)


# --- standard loops -----------------------------------------------------------------------------


def _standard_loop(
    context: ReadingContext, element: etree._Element, node: Activity
) -> StandardLoop:
    found = read_children(context, element, node.id)
    maximum: int | None = None
    text = element.get("loopMaximum")
    if text is not None and _NUMBER.fullmatch(text.strip()):
        maximum = int(text)
    elif text is not None:
        what = f"loopMaximum='{text}' is no number of rounds"
        context.findings.error(element, node.id, LOOP_MAXIMUM, what)
    return StandardLoop(
        context.first_expression(found.of("loopCondition"), node.id),
        context.boolean(element, "testBefore", False, node.id),
        maximum,
    )


# --- multi-instance -----------------------------------------------------------------------------


def _multi_instance(
    context: ReadingContext, activity: Children, element: etree._Element, node: Activity
) -> MultiInstance:
    found = read_children(context, element, node.id)
    zeebe = _zeebe(found)
    pending = PendingLoop(node, element, *(_reference(found, name) for name in _DATA_REFS))
    written = zeebe.get("inputCollection", "") or _editors(element, "collection")
    collection: Expression | None = None
    if written:
        collection = context.expression(element, node.id, written)
        pending.collection_ref = ""
    _check_count(context, found, node, bool(written or pending.collection_ref))
    item = zeebe.get("inputElement", "") or _editors(element, "elementVariable")
    result, output = _zeebe_output(context, element, node, zeebe)
    output_collection = zeebe.get("outputCollection", "")
    if output_collection:
        pending.output_ref = ""
    if pending.collection_ref or pending.output_ref:
        context.loops.append(pending)
    behavior = _behavior(context, element, node)
    return MultiInstance(
        sequential=context.boolean(element, "isSequential", False, node.id),
        cardinality=context.first_expression(found.of("loopCardinality"), node.id),
        collection=collection,
        item=_key(context, element, node, item or _data_item(context, found, "inputDataItem")),
        output_collection=_key(context, element, node, output_collection),
        output_item=_key(
            context, element, node, result or _data_item(context, found, "outputDataItem")
        ),
        output=output,
        completion=context.first_expression(found.of("completionCondition"), node.id),
        behavior=behavior,
        events=_events(context, activity, element, node, behavior),
        complex=_complex(context, found, node),
    )


_DATA_REFS = ("loopDataInputRef", "loopDataOutputRef")


def _reference(found: Children, name: str) -> str:
    return next((reference(text_of(each)) for each in found.of(name)), "")


def _editors(element: etree._Element, name: str) -> str:
    found = (element.get(prefix + name, "").strip() for prefix in _EDITORS)
    return next((text for text in found if text), "")


def _zeebe(found: Children) -> Mapping[str, str]:
    for each in found.extensions():
        if each.tag == ZEEBE + "loopCharacteristics":
            return {str(name): str(value).strip() for name, value in each.attrib.items()}
    return {}


def _zeebe_output(
    context: ReadingContext, element: etree._Element, node: Activity, zeebe: Mapping[str, str]
) -> tuple[str, Expression | None]:
    """The key that an instance has for its output, and what is collected instead of it."""
    text = zeebe.get("outputElement", "")
    key = text.removeprefix("=").strip()
    if text and not KEY.fullmatch(key):
        return "", context.expression(element, node.id, text)
    nested = context.expression(element, node.id, key, "m2pem") if "." in key else None
    return key.partition(".")[0], nested


def _data_item(context: ReadingContext, found: Children, name: str) -> str:
    """The key of an inputDataItem or outputDataItem; data associations can refer to it."""
    for each in found.of(name):
        read_children(context, each, found.id)
        identifier = context.optional_id(each)
        key = each.get("name") or identifier
        if identifier:
            context.data.setdefault(identifier, DataEnd(key, [each]))
        return key
    return ""


def _key(context: ReadingContext, element: etree._Element, node: Activity, key: str) -> str:
    if not key or KEY.fullmatch(key):
        return key
    what = f"'{key}' is no name of the data store"
    remedy = 'write a dotted name, for example "field"'
    context.findings.error(element, node.id, BAD_KEY, what, remedy)
    return ""


def _check_count(
    context: ReadingContext, found: Children, node: Activity, has_collection: bool
) -> None:
    has_cardinality = any(text_of(each) for each in found.of("loopCardinality"))
    if has_cardinality and has_collection:
        context.findings.error(
            found.element,
            node.id,
            INSTANCES_COUNTED_TWICE,
            "the multi-instance activity has both a loopCardinality and a collection, either of "
            "which says how many instances there are",
        )
    elif not has_cardinality and not has_collection:
        context.findings.error(
            found.element,
            node.id,
            INSTANCE_COUNT,
            "the multi-instance activity does not say how many instances it has",
        )


# --- what instances throw -----------------------------------------------------------------------


def _behavior(context: ReadingContext, element: etree._Element, node: Activity) -> InstanceBehavior:
    text = element.get("behavior", "All").strip()
    try:
        return InstanceBehavior(text)
    except ValueError:
        known = list(InstanceBehavior)
        remedy = suggest_or(text, known, f"write one of: {', '.join(known)}")
        what = f"behavior='{text}' is no behavior of a multi-instance activity"
        context.findings.error(element, node.id, INSTANCES_BEHAVIOR, what, remedy)
        return InstanceBehavior.ALL


def _events(
    context: ReadingContext,
    activity: Children,
    element: etree._Element,
    node: Activity,
    behavior: InstanceBehavior,
) -> tuple[EventDefinition, ...]:
    """What NONE and ONE throw: the event named, else a signal of the activity's own."""
    attribute = _EVENT_REFS.get(behavior)
    if attribute is None:
        return ()
    name = reference(element.get(attribute, ""))
    if name:
        definition = referred_definition(context, element, attribute, name, node.id)
        return () if definition is None else read_thrown(context, activity, [definition])
    signal = context.signals.setdefault(node.id, Signal(node.id, node.name, node.line))
    return (SignalEventDefinition(context.findings.line(element), signal),)


def _complex(
    context: ReadingContext, found: Children, node: Activity
) -> tuple[ComplexBehavior, ...]:
    result = []
    for each in found.of("complexBehaviorDefinition"):
        definition = read_children(context, each, node.id)
        condition = context.first_expression(definition.of("condition"), node.id)
        events = definition.of("event")
        if not events or not definition.of("condition"):
            context.findings.error(
                each,
                node.id,
                COMPLEX_BEHAVIOR,
                "a complexBehaviorDefinition says when something is thrown, and what",
            )
        elif condition is not None:
            thrower = read_children(context, events[0], events[0].get("id") or node.id)
            elements = definition_elements(context, thrower)
            thrown = read_thrown(context, thrower, elements)
            result.append(ComplexBehavior(condition, thrown))
    return tuple(result)


def resolve_loops(context: ReadingContext) -> None:
    """Give multi-instance activities their collections, now that all data objects are known."""
    flows: dict[Activity, PendingDataFlow | PendingCall] = {}
    for call in context.calls:
        flows[call.call] = call
    for flow in context.data_flows:
        if isinstance(flow.node, Activity):
            flows[flow.node] = flow
    for pending in context.loops:
        node = pending.node
        loop = node.loop
        assert isinstance(loop, MultiInstance)
        own = flows.get(node)
        if pending.collection_ref:
            loop = replace(loop, collection=_collection(context, pending, own))
        if pending.output_ref:
            loop = replace(loop, output_collection=_output_collection(context, pending, own))
        object.__setattr__(node, "loop", loop)


def _collection(
    context: ReadingContext, pending: PendingLoop, own: PendingDataFlow | PendingCall | None
) -> Expression | None:
    ref = pending.collection_ref
    key = context.data_key(ref)
    if not key and own is not None and ref in own.parameters:
        key = own.parameters[ref]
        passed = [each for each in own.inputs if each.target_ref == ref]
        own.inputs[:] = [each for each in own.inputs if each.target_ref != ref]
        _is_not_own(pending.node, key)
        for association in passed:
            for child in association.element:
                if local(child.tag) == "transformation":
                    return context.expression_in(child, pending.node.id)
            key = next(_keys(context, association.source_refs), key)
    key = key or _named(context, pending, "loopDataInputRef", ref)
    return context.expression(pending.element, pending.node.id, key, "m2pem") if key else None


def _output_collection(
    context: ReadingContext, pending: PendingLoop, own: PendingDataFlow | PendingCall | None
) -> str:
    ref = pending.output_ref
    key = context.data_key(ref)
    if not key and own is not None and ref in own.parameters:
        key = own.parameters[ref]
        passed = [each for each in own.outputs if ref in each.source_refs]
        own.outputs[:] = [each for each in own.outputs if ref not in each.source_refs]
        _is_not_own(pending.node, key)
        key = next(_keys(context, [each.target_ref for each in passed]), key)
    return key or _named(context, pending, "loopDataOutputRef", ref)


def _keys(context: ReadingContext, refs: list[str]) -> Iterator[str]:
    return (key for key in map(context.data_key, refs) if key)


def _is_not_own(node: Activity, key: str) -> None:
    """Take a key out of the data of each instance: the activity as a whole has it."""
    object.__setattr__(node, "own_data", node.own_data - {key})


def _named(context: ReadingContext, pending: PendingLoop, attribute: str, ref: str) -> str:
    """Some editors write a name of the data store where BPMN has a reference."""
    where, identifier = pending.element, pending.node.id
    if not KEY.fullmatch(ref):
        remedy = suggest_or(ref, context.data, "name a data object")
        what = f"{attribute} names '{ref}', which is no data object"
        context.findings.error(where, identifier, DANGLING_REFERENCE, what, remedy)
        return ""
    context.findings.warning(
        where,
        identifier,
        DANGLING_REFERENCE,
        f"{attribute} names '{ref}', which is no data object, data input or data output here; it "
        "is taken for a name of the data store",
        suggest_or(ref, context.data, 'name a data object, or write m2pem:collection="..."'),
    )
    return ref


# --- signals ------------------------------------------------------------------------------------


def join_default_signals(context: ReadingContext) -> None:
    """Let a boundary signal event that names no signal catch what its activity throws by default.

    A multi-instance activity whose behavior names no event throws a signal of its own (table
    10.29).
    """
    for node in context.nodes:
        if not isinstance(node, Activity) or not isinstance(node.loop, MultiInstance):
            continue
        for thrown in node.loop.events:
            if isinstance(thrown, SignalEventDefinition) and thrown.signal.id == node.id:
                _catch_default(context, node, thrown)


def _catch_default(context: ReadingContext, node: Activity, thrown: SignalEventDefinition) -> None:
    for event in node.boundary:
        definitions = tuple(
            replace(each, signal=thrown.signal)
            if isinstance(each, SignalEventDefinition) and each.signal.id == event.id
            else each
            for each in event.definitions
        )
        if definitions != event.definitions:
            object.__setattr__(event, "definitions", definitions)
            findings = context.findings.all
            findings[:] = [
                each
                for each in findings
                if (each.element, each.rule) != (event.id, MISSING_REFERENCE.slug)
            ]
