"""What undoes what: compensation activities, and transactions that are cancelled.

BPMN 2.0.2, clauses 10.5.6 (cancel, compensation), 10.7 and 13.5.5. A compensation boundary event
and the activity that it leads to are joined by an association, not by a sequence flow.
"""

from collections.abc import Iterator, Mapping

from lxml import etree

from m2pem.model.bpmn.names import BPMN
from m2pem.model.bpmn.reading import Drawn, Reading, reference
from m2pem.model.bpmn.scan import scan
from m2pem.model.elements import (
    Activity,
    BoundaryEvent,
    Container,
    Element,
    EndEvent,
    Event,
    IntermediateThrowEvent,
    SubProcess,
    Transaction,
)
from m2pem.model.events import CancelEventDefinition, CompensateEventDefinition, EventDefinition
from m2pem.model.near import did_you_mean

_set = object.__setattr__

ASSOCIATION = BPMN + "association"


def read_association(reading: Reading, element: etree._Element) -> None:
    """An association; only one of a compensation event has an effect."""
    identifier = element.get("id", "")
    scan(reading, element, identifier)
    reading.associations.append(
        Drawn(
            reading.report.line(element),
            identifier,
            reference(element.get("sourceRef", "")),
            reference(element.get("targetRef", "")),
            element.get("associationDirection", "None"),
        )
    )


def link_compensation(reading: Reading, elements: Mapping[str, Element]) -> None:
    """Give each activity what undoes it; check what triggers compensation, and cancel events."""
    for node in reading.undoing:
        _set(node, "for_compensation", True)
    partners = _partners(reading, elements)
    used: set[Activity] = set()
    for node in reading.nodes:
        if isinstance(node, Activity):
            for boundary in node.boundary:
                if _has(boundary, CompensateEventDefinition):
                    _link_handler(reading, node, boundary, partners.get(boundary, []), used)
                if _has(boundary, CancelEventDefinition):
                    _check_cancel_boundary(reading, node, boundary)
            if isinstance(node, Transaction):
                _check_cancel_caught(reading, node)
        elif isinstance(node, EndEvent | IntermediateThrowEvent):
            _check_throw(reading, node, elements)
    for node in reading.nodes:
        if node in reading.undoing and node not in used:
            reading.report.warning(
                node.line,
                node.id,
                "unused-compensation",
                "no compensation event leads to this compensation activity; it never runs",
                "draw an association to it from a compensation event on the border of an activity",
            )


def _has(event: Event, kind: type[EventDefinition]) -> bool:
    return any(isinstance(definition, kind) for definition in event.definitions)


# --- compensation activities --------------------------------------------------------------------


def _partners(
    reading: Reading, elements: Mapping[str, Element]
) -> dict[BoundaryEvent, list[Activity]]:
    """The activities that associations lead to from compensation events.

    An association without a direction may have been drawn from either end.
    """
    found: dict[BoundaryEvent, list[Activity]] = {}
    for drawn in reading.associations:
        source = elements.get(drawn.source_ref)
        target = elements.get(drawn.target_ref)
        ends = [(source, target)]
        if drawn.direction != "One":
            ends.append((target, source))
        for event, activity in ends:
            if (
                isinstance(event, BoundaryEvent)
                and _has(event, CompensateEventDefinition)
                and isinstance(activity, Activity)
            ):
                known = found.setdefault(event, [])
                if activity not in known:
                    known.append(activity)
    return found


def _link_handler(
    reading: Reading,
    activity: Activity,
    event: BoundaryEvent,
    handlers: list[Activity],
    used: set[Activity],
) -> None:
    if not handlers:
        reading.report.warning(
            event.line,
            event.id,
            "no-compensation",
            f"the compensation event leads to no activity; it undoes nothing of '{activity.id}'",
            "draw an association from it to a compensation activity, or delete it",
        )
        return
    handler = handlers[0]
    used.add(handler)
    if len(handlers) > 1 or activity.compensation is not None:
        reading.report.error(
            event.line,
            event.id,
            "several-compensations",
            f"more than one activity would undo '{activity.id}'",
            "put them into one subprocess that is marked for compensation",
        )
    elif handler not in reading.undoing:
        reading.report.error(
            handler.line,
            handler.id,
            "not-for-compensation",
            f"'{event.id}' leads to it, but it is no compensation activity",
            'mark it isForCompensation="true"',
        )
    elif handler.container is not activity.container:
        reading.report.error(
            event.line,
            event.id,
            "association-crosses-border",
            f"'{handler.id}', which undoes '{activity.id}', is not in the same process or "
            "subprocess",
            "move it to where the activity is",
        )
    else:
        _set(activity, "compensation", handler)


# --- throwing -----------------------------------------------------------------------------------


def _check_throw(
    reading: Reading, event: EndEvent | IntermediateThrowEvent, elements: Mapping[str, Element]
) -> None:
    for definition in event.definitions:
        if not isinstance(definition, CompensateEventDefinition) or not definition.activity:
            continue
        known = {each.id: each for scope in _visible(event.container) for each in _in(scope)}
        if definition.activity in known:
            continue
        activity = elements.get(definition.activity)
        rule = "dangling-reference"
        message = f"activityRef names '{definition.activity}', which is no activity"
        if isinstance(activity, Activity):
            rule = "not-visible"
            message = (
                f"activityRef names '{activity.id}', which cannot be compensated from here: it is "
                f"in '{activity.container.id}'"
            )
        reading.report.error(
            definition.line,
            event.id,
            rule,
            message,
            did_you_mean(
                definition.activity,
                known,
                "name an activity of the same process or subprocess, or, inside an event "
                "subprocess, of the one around it",
            ),
        )


def _visible(container: Container) -> Iterator[Container]:
    """The containers whose activities a compensation event sees (tables 10.88 and 10.89)."""
    yield container
    if isinstance(container, SubProcess) and container.triggered_by_event:
        yield container.container


def _in(container: Container) -> Iterator[Activity]:
    """The activities of a container, and itself: "all that was completed in it"."""
    if isinstance(container, SubProcess):
        yield container
    for node in container.nodes:
        if isinstance(node, Activity):
            yield node


# --- transactions -------------------------------------------------------------------------------


def _check_cancel_boundary(reading: Reading, activity: Activity, event: BoundaryEvent) -> None:
    if not isinstance(activity, Transaction):
        reading.report.error(
            event.line,
            event.id,
            "cancel-outside-transaction",
            f"the cancel event is attached to '{activity.id}', which is no transaction",
            "attach it to a transaction, or throw and catch an error",
        )
    elif not event.interrupting:
        reading.report.error(
            event.line,
            event.id,
            "cancel-not-interrupting",
            'a boundary event that catches a cancellation cannot have cancelActivity="false": the '
            "transaction is over",
            "make it interrupting",
        )


def _check_cancel_caught(reading: Reading, transaction: Transaction) -> None:
    if any(_has(event, CancelEventDefinition) for event in transaction.boundary):
        return
    for node in transaction.nodes:
        if isinstance(node, EndEvent) and _has(node, CancelEventDefinition):
            reading.report.warning(
                node.line,
                node.id,
                "uncaught-cancel",
                f"'{transaction.id}' has no boundary event that catches the cancellation; its "
                "token ends there",
                "attach a cancel boundary event to the transaction",
            )
