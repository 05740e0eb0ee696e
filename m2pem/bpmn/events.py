"""Events, their definitions, and links (BPMN 2.0.2, clauses 10.5 and 10.5.5, table 10.98).

A link joins throwing link events of one container to one catching event of their name, like a
sequence flow that is not drawn.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from lxml import etree

from m2pem.bpmn.children import Children, read_children
from m2pem.bpmn.context import KEY, MessageUse, ReadingContext, reference, text_of
from m2pem.bpmn.data import read_data_flow
from m2pem.bpmn.foreign_elements import ENGINES
from m2pem.bpmn.foreign_syntax import time_remedy
from m2pem.bpmn.rules.data import BAD_KEY
from m2pem.bpmn.rules.events import (
    DANGLING_LINK,
    DUPLICATE_LINK,
    ERROR_NOT_INTERRUPTING,
    EVENT_NOT_ALLOWED,
    LINK_CATCH_INCOMING,
    LINK_CROSSES_BORDER,
    LINK_NAME,
    LINK_THROW_OUTGOING,
    MISSING_REFERENCE,
    NO_CONDITION,
    NO_TRIGGER,
    TIMER_TIME,
    TYPED_START_IN_SUBPROCESS,
    allowed_triggers,
)
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.schema import SHAPES
from m2pem.bpmn.times import wrong_time
from m2pem.bpmn.xml import BPMN, a, kind, local
from m2pem.mission.elements import (
    BoundaryEvent,
    Container,
    EndEvent,
    Event,
    FlowNode,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    Process,
    StartEvent,
    SubProcess,
)
from m2pem.mission.events import (
    CancelEventDefinition,
    CompensateEventDefinition,
    ConditionalEventDefinition,
    Error,
    ErrorEventDefinition,
    Escalation,
    EscalationEventDefinition,
    EventDefinition,
    LinkEventDefinition,
    Message,
    MessageEventDefinition,
    RootElement,
    Signal,
    SignalEventDefinition,
    TerminateEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.suggestions import suggest_or

Root = TypeVar("Root", bound=RootElement)


def read_definition(
    context: ReadingContext, element: etree._Element, event: Children, *, catches: bool
) -> EventDefinition | None:
    """Read one definition of an event; return None when it has errors, which are reported."""
    found = read_children(context, element, event.id)
    line = context.findings.line(element)
    label = event.element.get("name", "")
    name = local(element.tag).removesuffix("EventDefinition")

    if name == "terminate":
        return TerminateEventDefinition(line)
    if name == "cancel":
        return CancelEventDefinition(line)
    if name == "compensate":
        wait = context.boolean(element, "waitForCompletion", True, event.id)
        activity = "" if catches else reference(element.get("activityRef", ""))
        return CompensateEventDefinition(line, activity, wait)
    if name == "timer":
        return _timer(context, element, event.id)
    if name == "conditional":
        return _conditional(context, found)
    if name == "link":
        return LinkEventDefinition(line, (element.get("name") or label).strip())
    if name == "message":
        return _message(context, element, event, catches=catches)
    if name == "signal":
        sign = Signal(event.id, label, line)
        signal = look_up(context, element, context.signals, sign)
        return SignalEventDefinition(line, signal or _own(context, event, context.signals, sign))
    if name == "error":
        own = Error(event.id, label, line, event.id)
        error = look_up(context, element, context.errors, own)
        if error is None and not catches:
            error = _own(context, event, context.errors, own)
        names = ("errorCodeVariable", "errorMessageVariable")
        return ErrorEventDefinition(line, error, *_variables(context, element, event.id, names))
    notice = Escalation(event.id, label, line, event.id)
    escalation = look_up(context, element, context.escalations, notice)
    if escalation is None and not catches:
        escalation = _own(context, event, context.escalations, notice)
    variables = _variables(context, element, event.id, ("escalationCodeVariable",))
    return EscalationEventDefinition(line, escalation, *variables)


def _variables(
    context: ReadingContext, element: etree._Element, identifier: str, names: tuple[str, ...]
) -> Iterator[str]:
    """The names of data that get what is caught, as Camunda 7 and its forks write them."""
    for name in names:
        written = (element.get(engine + name, "").strip() for engine in ENGINES)
        key = next((each for each in written if each), "")
        if key and not KEY.fullmatch(key):
            what = f"{name}='{key}' is no name of the data"
            context.findings.error(
                element, identifier, BAD_KEY, what, f'write for example {name}="error.code"'
            )
            key = ""
        yield key


def look_up(
    context: ReadingContext, element: etree._Element, table: Mapping[str, Root], stand_in: Root
) -> Root | None:
    """What an attribute such as `signalRef` names; None when it is absent.

    A reference to nothing gives the stand-in beside a finding, so that reading can go on. The
    stand-in has the id of the event or task that refers.
    """
    what = type(stand_in).__name__.lower()
    text = element.get(f"{what}Ref")
    if not text:
        return None
    name = reference(text)
    found = table.get(name)
    if found is not None:
        return found
    taken = context.ids.get(name)
    because = f"the element on line {taken} is none" if taken else f"no {what} has that id"
    context.findings.error(
        element,
        stand_in.id,
        DANGLING_REFERENCE,
        f"{what}Ref names '{name}', but {because}",
        suggest_or(name, table, f'put <{what} id="{name}"/> into definitions, or name another'),
    )
    return stand_in


def _own(context: ReadingContext, event: Children, table: dict[str, Root], root: Root) -> Root:
    """Return a root element made up for an event that names none, and warn of that."""
    what = type(root).__name__.lower()
    context.findings.warning(
        event.element,
        event.id,
        MISSING_REFERENCE,
        f"the event names no {what}; it has one of its own, with the id '{event.id}'",
        f"add {what}Ref to its event definition",
    )
    return table.setdefault(event.id, root)


def _message(
    context: ReadingContext, element: etree._Element, event: Children, *, catches: bool
) -> MessageEventDefinition:
    line = context.findings.line(element)
    label = event.element.get("name", "")
    own = Message(event.id, label, line)
    message = look_up(context, element, context.messages, own)
    definition = MessageEventDefinition(line, message or own)
    where = context.findings.line(event.element)
    context.message_uses.append(MessageUse(definition, event.id, label, where, catches, message))
    return definition


def _conditional(context: ReadingContext, found: Children) -> ConditionalEventDefinition | None:
    for element in found.of("condition"):
        context.check_attributes(element, SHAPES[element.tag], found.id)
        if text_of(element):
            condition = context.expression_in(element, found.id)
            if condition is None:
                return None
            return ConditionalEventDefinition(context.findings.line(found.element), condition)
    context.findings.error(
        found.element, found.id, NO_CONDITION, "the conditional event has no condition"
    )
    return None


_TIMES = {kind.value: kind for kind in TimerKind}


def _timer(
    context: ReadingContext, element: etree._Element, identifier: str
) -> TimerEventDefinition | None:
    times = [child for child in element if local(child.tag) in _TIMES]
    texts = [(local(child.tag), text_of(child)) for child in times]
    written = [(name, text) for name, text in texts if text]
    if len(written) != 1:
        said = "several times" if written else "no time"
        context.findings.error(
            element,
            identifier,
            TIMER_TIME,
            f"the timer has {said}",
            "give it one timeDuration (PT30S), timeDate (2026-01-31T12:00:00Z) or timeCycle "
            "(R3/PT10S)",
        )
        return None
    name, text = written[0]
    expression = context.template(times[0], identifier, text)
    if expression is None:
        return None
    kind = _TIMES[name]
    if wrong := wrong_time(expression, kind):
        remedy = time_remedy(name, text)
        context.findings.error(times[0], identifier, TIMER_TIME, f"{name}: {wrong}", remedy)
        return None
    return TimerEventDefinition(context.findings.line(element), kind, expression)


_THROWN_IMPLICITLY = frozenset({"message", "signal", "escalation", "error", "compensate"})
_CATCHING = frozenset({"startEvent", "intermediateCatchEvent", "boundaryEvent"})
_NEEDS_TRIGGER = frozenset({"intermediateCatchEvent", "boundaryEvent"})


def read_event(context: ReadingContext, element: etree._Element, container: Container) -> Event:
    """A start, end, intermediate or boundary event."""
    identifier = context.claim(element)
    found = read_children(context, element, identifier)
    tag_name = local(element.tag)
    definitions = _definitions(context, found, tag_name, container)
    head = context.head(element, identifier)
    parallel = context.boolean(element, "parallelMultiple", False, identifier)
    interrupting = True
    event: Event
    if tag_name == "startEvent":
        interrupting = context.boolean(element, "isInterrupting", True, identifier)
        event = StartEvent(*head, definitions, parallel, interrupting)
    elif tag_name == "endEvent":
        event = EndEvent(*head, definitions)
    elif tag_name == "intermediateThrowEvent":
        event = IntermediateThrowEvent(*head, definitions)
    elif tag_name == "intermediateCatchEvent":
        event = IntermediateCatchEvent(*head, definitions, parallel)
    else:
        interrupting = context.boolean(element, "cancelActivity", True, identifier)
        event = BoundaryEvent(*head, definitions, parallel, interrupting)
        context.attachments.append((event, reference(element.get("attachedToRef", ""))))
    if not interrupting:
        _no_error(context, element, event)
    read_data_flow(context, found, event)
    return event


def _no_error(context: ReadingContext, element: etree._Element, event: Event) -> None:
    """What catches an error cannot leave running what failed (clause 10.5.6)."""
    if not any(isinstance(each, ErrorEventDefinition) for each in event.definitions):
        return
    word, attribute, what = "boundary", "cancelActivity", "activity"
    if isinstance(event, StartEvent):
        word, attribute, what = "start", "isInterrupting", "scope"
    context.findings.error(
        element,
        event.id,
        ERROR_NOT_INTERRUPTING,
        f'a {word} event that catches an error cannot have {attribute}="false": the {what} has '
        "already failed",
    )


def _definitions(
    context: ReadingContext, found: Children, tag_name: str, container: Container
) -> tuple[EventDefinition, ...]:
    elements = definition_elements(context, found)
    awaited = tag_name in _NEEDS_TRIGGER or (tag_name == "startEvent" and _is_handler(container))
    if awaited and not elements and not found.of("eventDefinitionRef"):
        _no_trigger(context, found, tag_name)
    read = [_definition(context, found, tag_name, container, each) for each in elements]
    return tuple(definition for definition in read if definition is not None)


def definition_elements(context: ReadingContext, found: Children) -> list[etree._Element]:
    """The definitions in an event, then those of the file that it refers to."""
    elements = [
        each
        for each in found.element
        if each.tag.startswith(BPMN) and each.tag.endswith("EventDefinition")
    ]
    for each in found.of("eventDefinitionRef"):
        name = reference(text_of(each))
        target = referred_definition(context, each, "eventDefinitionRef", name, found.id)
        if target is not None:
            elements.append(target)
    return elements


def read_thrown(
    context: ReadingContext, found: Children, elements: Iterable[etree._Element]
) -> tuple[EventDefinition, ...]:
    """Read the implicit throw event of a multi-instance activity (table 10.30)."""
    read = []
    for element in elements:
        name = local(element.tag).removesuffix("EventDefinition")
        if name in _THROWN_IMPLICITLY:
            read.append(read_definition(context, element, found, catches=False))
        else:
            context.findings.error(
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
    context: ReadingContext,
    found: Children,
    tag_name: str,
    container: Container,
    definition: etree._Element,
) -> EventDefinition | None:
    """Read one definition of an event; None if it has an error, which is a finding."""
    name = local(definition.tag).removesuffix("EventDefinition")
    embedded = not _is_handler(container) and not isinstance(container, Process)
    if tag_name == "startEvent" and embedded:
        context.findings.error(
            found.element,
            found.id,
            TYPED_START_IN_SUBPROCESS,
            f"a start event in an embedded subprocess cannot wait for {a(kind(definition.tag))}",
        )
        return None
    if name not in allowed_triggers(found.element):
        return None  # which a rule says
    return read_definition(context, definition, found, catches=tag_name in _CATCHING)


def referred_definition(
    context: ReadingContext, referring: etree._Element, attribute: str, name: str, identifier: str
) -> etree._Element | None:
    """Return the event definition with an id, and report that there is none."""
    target = context.event_definitions.get(name)
    if target is None:
        context.findings.error(
            referring,
            identifier,
            DANGLING_REFERENCE,
            f"{attribute} names '{name}', which is no event definition of this file",
            suggest_or(name, context.event_definitions, "name one in definitions"),
        )
    return target


def _no_trigger(context: ReadingContext, found: Children, tag_name: str) -> None:
    word = kind(found.element.tag)
    also = ", or make it an intermediateThrowEvent" if tag_name == "intermediateCatchEvent" else ""
    context.findings.error(
        found.element,
        found.id,
        NO_TRIGGER,
        f"{a(word)} must say what it waits for",
        f"give it a signal, message, timer or conditional event definition{also}",
    )


_set = object.__setattr__


def is_link_target(node: FlowNode) -> bool:
    """Whether tokens come to it from link sources only."""
    return isinstance(node, IntermediateCatchEvent) and _link(node) is not None


def resolve_links(context: ReadingContext) -> None:
    """Link throwing and catching link events both ways; report those without a counterpart."""
    targets: dict[tuple[Container, str], IntermediateCatchEvent] = {}
    sources: dict[IntermediateCatchEvent, list[IntermediateThrowEvent]] = {}
    for node in context.nodes:
        link = _link(node)
        if link is None:
            continue
        if not link.name:
            _say(
                context,
                node,
                LINK_NAME,
                "the link event has no name, so nothing says what it is joined to",
            )
        elif isinstance(node, IntermediateCatchEvent):
            first = targets.setdefault((node.container, link.name), node)
            if first is not node:
                _say(
                    context,
                    node,
                    DUPLICATE_LINK,
                    f"the link '{link.name}' has another target, '{first.id}' on line {first.line}",
                )
        _check_flows(context, node)
    for node in context.nodes:
        link = _link(node)
        if link is None or not link.name or not isinstance(node, IntermediateThrowEvent):
            continue
        target = targets.get((node.container, link.name))
        if target is None:
            _no_target(context, node, link, targets)
        else:
            _set(node, "links_to", target)
            sources.setdefault(target, []).append(node)
    for target, found in sources.items():
        _set(target, "linked_from", tuple(found))


def _link(node: FlowNode) -> LinkEventDefinition | None:
    for definition in node.definitions if isinstance(node, Event) else ():
        if isinstance(definition, LinkEventDefinition):
            return definition
    return None


def _check_flows(context: ReadingContext, node: FlowNode) -> None:
    catches = isinstance(node, IntermediateCatchEvent)
    said = f"into the link target '{node.id}'" if catches else f"out of '{node.id}', a link"
    for flow in node.incoming if catches else node.outgoing:
        context.findings.error(
            flow.line,
            flow.id,
            LINK_CATCH_INCOMING if catches else LINK_THROW_OUTGOING,
            f"no sequence flow can lead {said}",
        )


def _no_target(
    context: ReadingContext,
    node: FlowNode,
    link: LinkEventDefinition,
    targets: dict[tuple[Container, str], IntermediateCatchEvent],
) -> None:
    here = [name for container, name in targets if container is node.container]
    elsewhere = [each.id for (_, name), each in targets.items() if name == link.name]
    rule, message = DANGLING_LINK, f"the link '{link.name}' has no target"
    remedy = f'add <intermediateCatchEvent> with <linkEventDefinition name="{link.name}"/>'
    if elsewhere:
        rule = LINK_CROSSES_BORDER
        message += f" here: '{elsewhere[0]}' is in another process or subprocess"
        remedy = "links join places of one container: let a sequence flow leave the subprocess"
    _say(context, node, rule, message, suggest_or(link.name, here, remedy))


def _say(
    context: ReadingContext, node: FlowNode, rule: Rule, message: str, remedy: str = ""
) -> None:
    context.broken.add(node.container)
    context.findings.error(node.line, node.id, rule, message, remedy)
