"""Event definitions: what triggers, or results from, an event (BPMN 2.0.2, clause 10.5.5)."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from lxml import etree

from m2pem.bpmn.names import local
from m2pem.bpmn.reading import MessageUse, Reading, reference, text_of
from m2pem.bpmn.rewriting import time_remedy
from m2pem.bpmn.rules.events import MISSING_REFERENCE, NO_CONDITION, TIMER_TIME
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.scan import Scan, scan
from m2pem.bpmn.schema import SHAPES
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.cycle import cycle
from m2pem.mission.duration import date_us, duration_us
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
from m2pem.mission.near import did_you_mean
from m2pem.mission.values import Value

Root = TypeVar("Root", bound=RootElement)


def read_definition(
    reading: Reading, element: etree._Element, event: Scan, *, catches: bool
) -> EventDefinition | None:
    """One definition of an event; None when findings say why there is none."""
    found = scan(reading, element, event.id)
    line = reading.report.line(element)
    label = event.element.get("name", "")
    name = local(element.tag).removesuffix("EventDefinition")

    if name == "terminate":
        return TerminateEventDefinition(line)
    if name == "cancel":
        return CancelEventDefinition(line)
    if name == "compensate":
        wait = reading.boolean(element, "waitForCompletion", True, event.id)
        activity = "" if catches else reference(element.get("activityRef", ""))
        return CompensateEventDefinition(line, activity, wait)
    if name == "timer":
        return _timer(reading, element, event.id)
    if name == "conditional":
        return _conditional(reading, found)
    if name == "link":
        return LinkEventDefinition(line, (element.get("name") or label).strip())
    if name == "message":
        return _message(reading, element, event, catches=catches)
    if name == "signal":
        sign = Signal(event.id, label, line)
        signal = look_up(reading, element, reading.signals, sign)
        return SignalEventDefinition(line, signal or _own(reading, event, reading.signals, sign))
    if name == "error":
        own = Error(event.id, label, line, event.id)
        error = look_up(reading, element, reading.errors, own)
        if error is None and not catches:
            error = _own(reading, event, reading.errors, own)
        return ErrorEventDefinition(line, error)
    notice = Escalation(event.id, label, line, event.id)
    escalation = look_up(reading, element, reading.escalations, notice)
    if escalation is None and not catches:
        escalation = _own(reading, event, reading.escalations, notice)
    return EscalationEventDefinition(line, escalation)


def look_up(
    reading: Reading, element: etree._Element, table: Mapping[str, Root], stand_in: Root
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
    taken = reading.ids.get(name)
    because = f"the element on line {taken} is none" if taken else f"no {what} has that id"
    reading.report.error(
        element,
        stand_in.id,
        DANGLING_REFERENCE,
        f"{what}Ref names '{name}', but {because}",
        did_you_mean(name, table, f'put <{what} id="{name}"/> into definitions, or name another'),
    )
    return stand_in


def _own(reading: Reading, event: Scan, table: dict[str, Root], root: Root) -> Root:
    """The root element of an event that names none."""
    what = type(root).__name__.lower()
    reading.report.warning(
        event.element,
        event.id,
        MISSING_REFERENCE,
        f"the event names no {what}; it has one of its own, with the id '{event.id}'",
        f"add {what}Ref to its event definition",
    )
    return table.setdefault(event.id, root)


def _message(
    reading: Reading, element: etree._Element, event: Scan, *, catches: bool
) -> MessageEventDefinition:
    line = reading.report.line(element)
    label = event.element.get("name", "")
    own = Message(event.id, label, line)
    message = look_up(reading, element, reading.messages, own)
    definition = MessageEventDefinition(line, message or own)
    where = reading.report.line(event.element)
    reading.message_uses.append(MessageUse(definition, event.id, label, where, catches, message))
    return definition


def _conditional(reading: Reading, found: Scan) -> ConditionalEventDefinition | None:
    for element in found.of("condition"):
        text = text_of(element)
        reading.check_attributes(element, SHAPES[element.tag], found.id)
        if text:
            condition = reading.expression(element, found.id, text, element.get("language"))
            if condition is None:
                return None
            return ConditionalEventDefinition(reading.report.line(found.element), condition)
    reading.report.error(
        found.element,
        found.id,
        NO_CONDITION,
        "the conditional event has no condition",
        "add one, for example <condition>battery.level &lt; 20</condition>",
    )
    return None


_TIMES = {kind.value: kind for kind in TimerKind}


def _timer(
    reading: Reading, element: etree._Element, identifier: str
) -> TimerEventDefinition | None:
    times = [child for child in element if local(child.tag) in _TIMES]
    texts = [(local(child.tag), text_of(child)) for child in times]
    written = [(name, text) for name, text in texts if text]
    if len(written) != 1:
        said = "several times" if written else "no time"
        reading.report.error(
            element,
            identifier,
            TIMER_TIME,
            f"the timer has {said}",
            "give it one timeDuration (PT30S), timeDate (2026-01-31T12:00:00Z) or timeCycle "
            "(R3/PT10S)",
        )
        return None
    name, text = written[0]
    expression = reading.template(times[0], identifier, text)
    if expression is None:
        return None
    kind = _TIMES[name]
    if expression.constant:
        try:
            _CHECKS[kind](expression.evaluate(lambda _: None))
        except (ExpressionSyntaxError, ExpressionError) as error:
            reading.report.error(
                times[0], identifier, TIMER_TIME, f"{name}: {error}", time_remedy(name, text)
            )
            return None
    return TimerEventDefinition(reading.report.line(element), kind, expression)


_CHECKS: dict[TimerKind, Callable[[Value], object]] = {
    TimerKind.DATE: date_us,
    TimerKind.DURATION: lambda text: duration_us(text, 0),
    TimerKind.CYCLE: cycle,
}
