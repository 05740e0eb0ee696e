"""Event definitions: what triggers, or results from, an event (BPMN 2.0.2, clause 10.5.5)."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from lxml import etree

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.model.bpmn.names import a, local
from m2pem.model.bpmn.near import did_you_mean
from m2pem.model.bpmn.reading import MessageUse, Reading, reference, text_of
from m2pem.model.bpmn.scan import Scan, scan
from m2pem.model.duration import cycle, date_us, duration_us
from m2pem.model.events import (
    Error,
    ErrorEventDefinition,
    Escalation,
    EscalationEventDefinition,
    EventDefinition,
    Message,
    MessageEventDefinition,
    RootElement,
    Signal,
    SignalEventDefinition,
    TerminateEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.model.values import Value

Root = TypeVar("Root", bound=RootElement)


def read_definition(
    reading: Reading, element: etree._Element, event: Scan, *, catches: bool
) -> EventDefinition | None:
    """One definition of an event; None when findings say why there is none."""
    scan(reading, element, event.id)
    line = reading.report.line(element)
    label = event.element.get("name", "")
    name = local(element.tag).removesuffix("EventDefinition")

    if name == "terminate":
        return TerminateEventDefinition(line)
    if name == "timer":
        return _timer(reading, element, event.id)
    if name == "message":
        return _message(reading, element, event, catches=catches)
    if name == "signal":
        signal = look_up(
            reading, element, "signal", reading.signals, event.id, lambda i: Signal(i, label, line)
        )
        if signal is None:
            _nameless(reading, event, "signal", catches=catches)
            signal = reading.signals.setdefault(event.id, Signal(event.id, label, line))
        return SignalEventDefinition(line, signal)
    if name == "error":
        error = look_up(
            reading, element, "error", reading.errors, event.id, lambda i: Error(i, label, line, i)
        )
        if error is None and not catches:
            _nameless(reading, event, "error", catches=catches)
            error = reading.errors.setdefault(event.id, Error(event.id, label, line, event.id))
        return ErrorEventDefinition(line, error)
    escalation = look_up(
        reading,
        element,
        "escalation",
        reading.escalations,
        event.id,
        lambda i: Escalation(i, label, line, i),
    )
    if escalation is None and not catches:
        _nameless(reading, event, "escalation", catches=catches)
        escalation = reading.escalations.setdefault(
            event.id, Escalation(event.id, label, line, event.id)
        )
    return EscalationEventDefinition(line, escalation)


def look_up(
    reading: Reading,
    element: etree._Element,
    what: str,
    table: Mapping[str, Root],
    identifier: str,
    stand_in: Callable[[str], Root],
) -> Root | None:
    """What an attribute such as `signalRef` names; None when it is absent.

    A reference to nothing gives a stand-in beside the finding, so that reading can go on.
    """
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
        identifier,
        "dangling-reference",
        f"{what}Ref names '{name}', but {because}",
        did_you_mean(name, table, f"name {a(what)} element that stands in definitions"),
    )
    return stand_in(name)


def _message(
    reading: Reading, element: etree._Element, event: Scan, *, catches: bool
) -> MessageEventDefinition:
    line = reading.report.line(element)
    label = event.element.get("name", "")
    message = look_up(
        reading, element, "message", reading.messages, event.id, lambda i: Message(i, label, line)
    )
    definition = MessageEventDefinition(line, message or Message(event.id, label, line))
    reading.message_uses.append(
        MessageUse(
            definition, event.id, label, reading.report.line(event.element), catches, message
        )
    )
    return definition


def _nameless(reading: Reading, event: Scan, what: str, *, catches: bool) -> None:
    reading.report.warning(
        event.element,
        event.id,
        "missing-reference",
        f"the event names no {what}; it {'catches' if catches else 'throws'} one of its own, "
        f"with the id '{event.id}'",
        f"add {what}Ref to its event definition",
    )


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
            "timer-time",
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
                times[0], identifier, "timer-time", f"{name}: {error}", "write it as ISO 8601"
            )
            return None
    return TimerEventDefinition(reading.report.line(element), kind, expression)


_CHECKS: dict[TimerKind, Callable[[Value], object]] = {
    TimerKind.DATE: date_us,
    TimerKind.DURATION: lambda text: duration_us(text, 0),
    TimerKind.CYCLE: cycle,
}
