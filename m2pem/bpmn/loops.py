"""Loop and multi-instance markers of activities (BPMN 2.0.2, clause 10.3.8)."""

import re
from collections.abc import Mapping

from lxml import etree

from m2pem.bpmn.events import definition_elements, read_thrown, referred_definition
from m2pem.bpmn.names import ACTIVITI, BPMN, CAMUNDA, FLOWABLE, M2PEM, ZEEBE
from m2pem.bpmn.reading import KEY, DataEnd, PendingLoop, Reading, reference, text_of
from m2pem.bpmn.rules.data import BAD_KEY
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
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.scan import Scan, scan
from m2pem.mission.elements import Activity, SubProcess
from m2pem.mission.events import EventDefinition, Signal, SignalEventDefinition
from m2pem.mission.expression import Expression
from m2pem.mission.loops import ComplexBehavior, InstanceBehavior, MultiInstance, StandardLoop
from m2pem.mission.near import did_you_mean

_STANDARD = BPMN + "standardLoopCharacteristics"
_MULTI_INSTANCE = BPMN + "multiInstanceLoopCharacteristics"
LOOPS = (_STANDARD, _MULTI_INSTANCE, BPMN + "loopCharacteristics")
_MARKERS = frozenset(LOOPS)

_EDITORS = (M2PEM, CAMUNDA, FLOWABLE, ACTIVITI)
"""Whose attributes `collection` and `elementVariable` mean the same."""

_NUMBER = re.compile(r"[0-9]{1,18}")
_EVENT_REFS = {
    InstanceBehavior.NONE: "noneBehaviorEventRef",
    InstanceBehavior.ONE: "oneBehaviorEventRef",
}


def read_loop(reading: Reading, found: Scan, node: Activity) -> None:
    """The marker of an activity, if it has any; `resolve_loops` adds what data objects say."""
    if _MARKERS.isdisjoint(found.children):
        return
    markers = [each for tag in LOOPS for each in found.children.get(tag, [])]
    element = markers[0]
    if len(markers) > 1:
        _error(reading, markers[1], node, TWO_LOOPS, "an activity has one loop marker", "keep one")
    if isinstance(node, SubProcess) and node.triggered_by_event:
        _error(
            reading,
            element,
            node,
            LOOP_NOT_ALLOWED,
            "an event subprocess is begun by its start event, as often as that is triggered; it "
            "cannot have a loop marker",
            "delete the marker, or put it on an activity inside",
        )
    loop: StandardLoop | MultiInstance
    if element.tag == _STANDARD:
        loop = _standard_loop(reading, element, node)
    elif element.tag == _MULTI_INSTANCE:
        loop = _multi_instance(reading, found, element, node)
        if loop.output_item:
            own = frozenset({*node.own_data, loop.output_item})
            object.__setattr__(node, "own_data", own)
    else:
        remedy = "write standardLoopCharacteristics or multiInstanceLoopCharacteristics"
        _error(reading, element, node, NO_LOOP, "it does not say which kind of loop", remedy)
        return
    object.__setattr__(node, "loop", loop)


def _error(
    reading: Reading, where: etree._Element, node: Activity, rule: Rule, what: str, remedy: str
) -> None:
    reading.report.error(where, node.id, rule, what, remedy)


def _expression(reading: Reading, found: Scan, name: str, node: Activity) -> Expression | None:
    for each in found.of(name):
        text = text_of(each)
        if text:
            return reading.expression(each, node.id, text, each.get("language"))
    return None


# --- standard loops -----------------------------------------------------------------------------


def _standard_loop(reading: Reading, element: etree._Element, node: Activity) -> StandardLoop:
    found = scan(reading, element, node.id)
    maximum: int | None = None
    text = element.get("loopMaximum")
    if text is not None and _NUMBER.fullmatch(text.strip()):
        maximum = int(text)
    elif text is not None:
        what = f"loopMaximum='{text}' is no number of rounds"
        _error(reading, element, node, LOOP_MAXIMUM, what, 'write for example loopMaximum="5"')
    return StandardLoop(
        _expression(reading, found, "loopCondition", node),
        reading.boolean(element, "testBefore", False, node.id),
        maximum,
    )


# --- multi-instance -----------------------------------------------------------------------------


def _multi_instance(
    reading: Reading, activity: Scan, element: etree._Element, node: Activity
) -> MultiInstance:
    found = scan(reading, element, node.id)
    zeebe = _zeebe(found)
    pending = PendingLoop(node, element, *(_reference(found, name) for name in _DATA_REFS))
    written = zeebe.get("inputCollection", "") or _editors(element, "collection")
    collection: Expression | None = None
    if written:
        collection = reading.expression(element, node.id, written)
        pending.collection_ref = ""
    _check_count(reading, found, node, bool(written or pending.collection_ref))
    item = zeebe.get("inputElement", "") or _editors(element, "elementVariable")
    result, output = _zeebe_output(reading, element, node, zeebe)
    output_collection = zeebe.get("outputCollection", "")
    if output_collection:
        pending.output_ref = ""
    if pending.collection_ref or pending.output_ref:
        reading.loops.append(pending)
    behavior = _behavior(reading, element, node)
    return MultiInstance(
        sequential=reading.boolean(element, "isSequential", False, node.id),
        cardinality=_expression(reading, found, "loopCardinality", node),
        collection=collection,
        item=_key(reading, element, node, item or _data_item(reading, found, "inputDataItem")),
        output_collection=_key(reading, element, node, output_collection),
        output_item=_key(
            reading, element, node, result or _data_item(reading, found, "outputDataItem")
        ),
        output=output,
        completion=_expression(reading, found, "completionCondition", node),
        behavior=behavior,
        events=_events(reading, activity, element, node, behavior),
        complex=_complex(reading, found, node),
    )


_DATA_REFS = ("loopDataInputRef", "loopDataOutputRef")


def _reference(found: Scan, name: str) -> str:
    return next((reference(text_of(each)) for each in found.of(name)), "")


def _editors(element: etree._Element, name: str) -> str:
    found = (element.get(prefix + name, "").strip() for prefix in _EDITORS)
    return next((text for text in found if text), "")


def _zeebe(found: Scan) -> Mapping[str, str]:
    for each in found.extensions():
        if each.tag == ZEEBE + "loopCharacteristics":
            return {str(name): str(value).strip() for name, value in each.attrib.items()}
    return {}


def _zeebe_output(
    reading: Reading, element: etree._Element, node: Activity, zeebe: Mapping[str, str]
) -> tuple[str, Expression | None]:
    """The key that an instance has for its output, and what is collected instead of it."""
    text = zeebe.get("outputElement", "")
    key = text.removeprefix("=").strip()
    if not text or KEY.fullmatch(key):
        return key.partition(".")[0], _nested(reading, element, node, key)
    return "", reading.expression(element, node.id, text)


def _nested(
    reading: Reading, element: etree._Element, node: Activity, key: str
) -> Expression | None:
    return reading.expression(element, node.id, key, "m2pem") if "." in key else None


def _data_item(reading: Reading, found: Scan, name: str) -> str:
    """The key of an inputDataItem or outputDataItem; data associations can refer to it."""
    for each in found.of(name):
        scan(reading, each, found.id)
        identifier = reading.optional_id(each)
        key = each.get("name") or identifier
        if identifier:
            reading.data.setdefault(identifier, DataEnd(key, [each]))
        return key
    return ""


def _key(reading: Reading, element: etree._Element, node: Activity, key: str) -> str:
    if not key or KEY.fullmatch(key):
        return key
    what = f"'{key}' is no name of the data store"
    _error(reading, element, node, BAD_KEY, what, 'write a dotted name, for example "field"')
    return ""


def _check_count(reading: Reading, found: Scan, node: Activity, has_collection: bool) -> None:
    has_cardinality = any(text_of(each) for each in found.of("loopCardinality"))
    if has_cardinality and has_collection:
        _error(
            reading,
            found.element,
            node,
            INSTANCES_COUNTED_TWICE,
            "the multi-instance activity has both a loopCardinality and a collection, either of "
            "which says how many instances there are",
            "keep one",
        )
    elif not has_cardinality and not has_collection:
        _error(
            reading,
            found.element,
            node,
            INSTANCE_COUNT,
            "the multi-instance activity does not say how many instances it has",
            "add a loopCardinality (a number or an expression), or name a collection: "
            'm2pem:collection="fields" m2pem:elementVariable="field"',
        )


# --- what instances throw -----------------------------------------------------------------------


def _behavior(reading: Reading, element: etree._Element, node: Activity) -> InstanceBehavior:
    text = element.get("behavior", "All").strip()
    try:
        return InstanceBehavior(text)
    except ValueError:
        known = list(InstanceBehavior)
        remedy = did_you_mean(text, known, f"write one of: {', '.join(known)}")
        what = f"behavior='{text}' is no behavior of a multi-instance activity"
        _error(reading, element, node, INSTANCES_BEHAVIOR, what, remedy)
        return InstanceBehavior.ALL


def _events(
    reading: Reading,
    activity: Scan,
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
        definition = referred_definition(reading, element, attribute, name, node.id)
        return () if definition is None else read_thrown(reading, activity, [definition])
    signal = reading.signals.setdefault(node.id, Signal(node.id, node.name, node.line))
    return (SignalEventDefinition(reading.report.line(element), signal),)


def _complex(reading: Reading, found: Scan, node: Activity) -> tuple[ComplexBehavior, ...]:
    result = []
    for each in found.of("complexBehaviorDefinition"):
        definition = scan(reading, each, node.id)
        condition = _expression(reading, definition, "condition", node)
        events = definition.of("event")
        if not events or not definition.of("condition"):
            _error(
                reading,
                each,
                node,
                COMPLEX_BEHAVIOR,
                "a complexBehaviorDefinition says when something is thrown, and what",
                "give it a condition, and an event with an event definition",
            )
        elif condition is not None:
            thrower = scan(reading, events[0], events[0].get("id") or node.id)
            elements = definition_elements(reading, thrower)
            thrown = read_thrown(reading, thrower, elements)
            result.append(ComplexBehavior(condition, thrown))
    return tuple(result)
