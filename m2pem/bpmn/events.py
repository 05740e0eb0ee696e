"""Events: which definitions may stand where (BPMN 2.0.2, clause 10.5), and what they say."""

from collections.abc import Iterable

from lxml import etree

from m2pem.bpmn.data_flow import read_data_flow
from m2pem.bpmn.definitions import read_definition
from m2pem.bpmn.names import BPMN, a, kind, local
from m2pem.bpmn.reading import Reading, reference, text_of
from m2pem.bpmn.rules.events import (
    ERROR_NOT_INTERRUPTING,
    EVENT_NOT_ALLOWED,
    NO_TRIGGER,
    TYPED_START_IN_SUBPROCESS,
    allowed_triggers,
)
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.scan import Scan, scan
from m2pem.mission.elements import (
    BoundaryEvent,
    Container,
    EndEvent,
    Event,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    Process,
    StartEvent,
    SubProcess,
)
from m2pem.mission.events import ErrorEventDefinition, EventDefinition
from m2pem.mission.near import did_you_mean

_THROWN_IMPLICITLY = frozenset({"message", "signal", "escalation", "error", "compensate"})
_CATCHING = frozenset({"startEvent", "intermediateCatchEvent", "boundaryEvent"})
_NEEDS_TRIGGER = frozenset({"intermediateCatchEvent", "boundaryEvent"})


def read_event(reading: Reading, element: etree._Element, container: Container) -> Event:
    """A start, end, intermediate or boundary event."""
    identifier = reading.claim(element)
    found = scan(reading, element, identifier)
    place = local(element.tag)
    definitions = _definitions(reading, found, place, container)
    name = element.get("name", "")
    line = reading.report.line(element)
    parallel = reading.boolean(element, "parallelMultiple", False, identifier)
    event: Event
    if place == "startEvent":
        interrupting = reading.boolean(element, "isInterrupting", True, identifier)
        event = StartEvent(identifier, name, line, definitions, parallel, interrupting)
        if not interrupting:
            _no_error(reading, element, event)
    elif place == "endEvent":
        event = EndEvent(identifier, name, line, definitions)
    elif place == "intermediateThrowEvent":
        event = IntermediateThrowEvent(identifier, name, line, definitions)
    elif place == "intermediateCatchEvent":
        event = IntermediateCatchEvent(identifier, name, line, definitions, parallel)
    else:
        event = _boundary(reading, element, identifier, definitions, parallel)
    read_data_flow(reading, found, event)
    return event


def _boundary(
    reading: Reading,
    element: etree._Element,
    identifier: str,
    definitions: tuple[EventDefinition, ...],
    parallel: bool,
) -> BoundaryEvent:
    interrupting = reading.boolean(element, "cancelActivity", True, identifier)
    event = BoundaryEvent(
        identifier,
        element.get("name", ""),
        reading.report.line(element),
        definitions,
        parallel,
        interrupting,
    )
    reading.attachments.append((event, reference(element.get("attachedToRef", ""))))
    if not interrupting:
        _no_error(reading, element, event)
    return event


def _no_error(reading: Reading, element: etree._Element, event: Event) -> None:
    """What catches an error cannot leave running what failed (clause 10.5.6)."""
    if not any(isinstance(each, ErrorEventDefinition) for each in event.definitions):
        return
    word, attribute, what = "boundary", "cancelActivity", "activity"
    if isinstance(event, StartEvent):
        word, attribute, what = "start", "isInterrupting", "scope"
    reading.report.error(
        element,
        event.id,
        ERROR_NOT_INTERRUPTING,
        f'a {word} event that catches an error cannot have {attribute}="false": the {what} has '
        "already failed",
        "make it interrupting, or throw and catch an escalation",
    )


def _definitions(
    reading: Reading, found: Scan, place: str, container: Container
) -> tuple[EventDefinition, ...]:
    elements = definition_elements(reading, found)
    awaited = place in _NEEDS_TRIGGER or (place == "startEvent" and _is_handler(container))
    if awaited and not elements and not found.of("eventDefinitionRef"):
        _no_trigger(reading, found, place)
    read = [_definition(reading, found, place, container, each) for each in elements]
    return tuple(definition for definition in read if definition is not None)


def definition_elements(reading: Reading, found: Scan) -> list[etree._Element]:
    """The definitions that stand in an event, then those of the file that it refers to."""
    elements = [
        each
        for each in found.element
        if each.tag.startswith(BPMN) and each.tag.endswith("EventDefinition")
    ]
    for each in found.of("eventDefinitionRef"):
        name = reference(text_of(each))
        target = referred_definition(reading, each, "eventDefinitionRef", name, found.id)
        if target is not None:
            elements.append(target)
    return elements


def read_thrown(
    reading: Reading, found: Scan, elements: Iterable[etree._Element]
) -> tuple[EventDefinition, ...]:
    """What a multi-instance activity throws by itself (table 10.30): an implicit throw event."""
    read = []
    for element in elements:
        name = local(element.tag).removesuffix("EventDefinition")
        if name in _THROWN_IMPLICITLY:
            read.append(read_definition(reading, element, found, catches=False))
        else:
            reading.report.error(
                element,
                found.id,
                EVENT_NOT_ALLOWED,
                f"a multi-instance activity cannot throw {a(kind(element.tag))} by itself",
                f"use one of: {', '.join(sorted(_THROWN_IMPLICITLY))}",
            )
    return tuple(definition for definition in read if definition is not None)


def _is_handler(container: Container) -> bool:
    return isinstance(container, SubProcess) and container.triggered_by_event


def _definition(
    reading: Reading, found: Scan, place: str, container: Container, definition: etree._Element
) -> EventDefinition | None:
    """One of its definitions; None when a finding says what is wrong with it."""
    name = local(definition.tag).removesuffix("EventDefinition")
    embedded = not _is_handler(container) and not isinstance(container, Process)
    if place == "startEvent" and embedded:
        reading.report.error(
            found.element,
            found.id,
            TYPED_START_IN_SUBPROCESS,
            f"a start event in an embedded subprocess cannot wait for {a(kind(definition.tag))}",
            "use a plain start event, and a catching intermediate event after it",
        )
        return None
    if name not in allowed_triggers(found.element):
        return None  # which a rule says
    return read_definition(reading, definition, found, catches=place in _CATCHING)


def referred_definition(
    reading: Reading, referring: etree._Element, attribute: str, name: str, identifier: str
) -> etree._Element | None:
    """The event definition of the file that has an id; says so when there is none."""
    target = reading.event_definitions.get(name)
    if target is None:
        reading.report.error(
            referring,
            identifier,
            DANGLING_REFERENCE,
            f"{attribute} names '{name}', which is no event definition of this file",
            did_you_mean(name, reading.event_definitions, "name one that stands in definitions"),
        )
    return target


def _no_trigger(reading: Reading, found: Scan, place: str) -> None:
    word = kind(found.element.tag)
    also = ", or make it an intermediateThrowEvent" if place == "intermediateCatchEvent" else ""
    reading.report.error(
        found.element,
        found.id,
        NO_TRIGGER,
        f"{a(word)} must say what it waits for",
        f"give it a signal, message, timer or conditional event definition{also}",
    )
