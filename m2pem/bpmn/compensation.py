"""Compensation: which activity compensates which (BPMN 2.0.2, clauses 10.7.1 and 13.5.5).

A compensation boundary event and the activity that it leads to are joined by an association, not
by a sequence flow. `rules/compensation.py` checks them.
"""

from collections.abc import Iterator

from lxml import etree

from m2pem.bpmn.children import read_children
from m2pem.bpmn.context import Drawn, ReadingContext, reference
from m2pem.bpmn.xml import BPMN
from m2pem.mission.elements import Activity, BoundaryEvent
from m2pem.mission.events import CompensateEventDefinition

_set = object.__setattr__

ASSOCIATION = BPMN + "association"


def read_association(context: ReadingContext, element: etree._Element) -> None:
    """Read an association; only one of a compensation event has an effect."""
    identifier = element.get("id", "")
    read_children(context, element, identifier)
    context.associations.append(
        Drawn(
            reference(element.get("sourceRef", "")),
            reference(element.get("targetRef", "")),
            element.get("associationDirection", "None"),
        )
    )


def note_compensation(context: ReadingContext) -> None:
    """Mark compensation handlers, before elements are linked: they do not begin by themselves.

    They are marked `isForCompensation`, or a compensation event leads to them.
    """
    for _, handler in _pairs(context):
        context.compensation_handlers.add(handler)
    for node in context.compensation_handlers:
        context.self_starting.add(node)
        _set(node, "for_compensation", True)


def link_compensation(context: ReadingContext) -> None:
    """Link each activity to its compensation handler: the first, when several were drawn."""
    for event, handler in _pairs(context):
        activity = getattr(event, "attached_to", None)  # a dangling one has none
        if isinstance(activity, Activity) and activity.compensation is None:
            _set(activity, "compensation", handler)


def _pairs(context: ReadingContext) -> Iterator[tuple[BoundaryEvent, Activity]]:
    """Compensation events and the activities in the same container that they lead to.

    An association without a direction may have been drawn from either end.
    """
    if not context.associations:
        return
    hosts = dict(context.attachments)
    events = {
        event.id: (event, container)
        for event, container in zip(context.nodes, context.containers, strict=True)
        if isinstance(event, BoundaryEvent)
        and any(isinstance(each, CompensateEventDefinition) for each in event.definitions)
    }
    activities = {
        node.id: (node, container)
        for node, container in zip(context.nodes, context.containers, strict=True)
        if isinstance(node, Activity)
    }
    for drawn in context.associations:
        ends = [(drawn.source_ref, drawn.target_ref)]
        if drawn.direction != "One":
            ends.append((drawn.target_ref, drawn.source_ref))
        for source, target in ends:
            if source in events and target in activities:
                (event, here), (activity, there) = events[source], activities[target]
                if here is there and hosts[event] != target:
                    yield event, activity
