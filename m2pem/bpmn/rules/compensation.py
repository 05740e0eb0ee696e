"""Compensation: handlers, and what triggers them (BPMN 2.0.2, 10.5.5 and 10.7)."""

from lxml import etree

from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    CATCHING,
    CONTAINERS,
    EVENTS,
    SUBPROCESSES,
    Checks,
    Tree,
    has_trigger,
    is_false,
    is_true,
    named,
    names,
    parent,
    what,
)
from m2pem.bpmn.xml import BPMN

error, warning = family("10.7.1")

COMPENSATED_ACTIVITY = error(
    10535,
    "activityRef names no activity",
    "name the activity that is to be compensated, or delete it to compensate all",
    clause="10.5.5",
)
COMPENSATED_ELSEWHERE = error(
    10708,
    "the activity to be compensated is not in the scope of the event",
    "throw it in the scope of the activity, or in an event subprocess there",
    clause="10.7.2",
)
COMPENSATED_WITHOUT_HANDLER = warning(
    10537,
    "the activity to be compensated has nothing that compensates it",
    "attach a compensation boundary event with a handler to it",
    clause="10.5.4",
)
COMPENSATION_CATCH_ACTIVITY = warning(
    10538,
    "an event that catches compensation must not name an activity: its place determines it",
    "delete activityRef",
    clause="10.5.5",
)
COMPENSATION_BOUNDARY_FLOW = error(
    10518,
    "a compensation boundary event must not have an outgoing sequence flow",
    "draw an association to the activity that compensates",
    clause="10.5.4",
)
COMPENSATION_BOUNDARY_NOT_INTERRUPTING = warning(
    10522,
    "cancelActivity has no meaning on a compensation boundary event: its activity has completed",
    'delete cancelActivity="false"',
    clause="10.5.4",
)
HANDLER_INCOMING = error(
    10701,
    "a compensation activity must not have an incoming flow",
    "delete the flow; an association from a compensation boundary event leads to it",
)
HANDLER_OUTGOING = error(
    10702,
    "a compensation activity must not have an outgoing flow",
    "delete the flow; put what follows into a subprocess for compensation",
)
HANDLER_UNUSED = warning(
    10703,
    "no compensation boundary event leads to the compensation activity",
    "draw an association to it, or delete isForCompensation",
)
COMPENSATION_WITHOUT_HANDLER = warning(
    10704,
    "the compensation boundary event leads to no activity that compensates",
    "draw an association from it to one",
)
TWO_HANDLERS = warning(
    10705,
    "the compensation boundary event leads to several activities",
    "put them into one subprocess for compensation",
)
TWO_COMPENSATION_EVENTS = warning(
    10709,
    "the activity has several compensation boundary events; the first counts",
    "keep one of them",
)
HANDLER_NOT_MARKED = warning(
    10706,
    "the activity that compensates is not marked as such",
    'add isForCompensation="true" to it',
)
HANDLER_ELSEWHERE = error(
    10707,
    "the activity that compensates is in another process or subprocess",
    "put it beside the activity whose work it undoes",
)

_BOUNDARY = names("boundaryEvent")


def _definition(tree: Tree, definition: etree._Element) -> None:
    name = definition.get("activityRef")
    event = parent(definition)
    if not name:
        return
    if event.tag in CATCHING:
        tree.report(COMPENSATION_CATCH_ACTIVITY, definition)
        return
    if tree.leads_nowhere(definition, name, ACTIVITIES):
        unless = (DANGLING_REFERENCE,)
        tree.report(COMPENSATED_ACTIVITY, definition, f"'{name}'", unless=unless)
        return
    activity = tree.find(definition, name)
    if activity is None or event.tag not in EVENTS:
        return
    if not _visible(event, activity):
        tree.report(COMPENSATED_ELSEWHERE, definition, what(activity))
    inner = activity.tag in SUBPROCESSES or activity.tag == BPMN + "callActivity"
    attached = tree.boundary.get(activity.get("id", ""), [])
    if not inner and not any(has_trigger(tree, each, "compensate") for each in attached):
        tree.report(COMPENSATED_WITHOUT_HANDLER, definition, what(activity))


def _visible(event: etree._Element, activity: etree._Element) -> bool:
    """Beside the event, or beside a subprocess around it, at any depth."""
    scope: etree._Element | None = event.getparent()
    home = parent(activity)
    while scope is not None and scope.tag in CONTAINERS:
        if scope is home:
            return True
        scope = scope.getparent()
    return False


def _boundary(tree: Tree, event: etree._Element) -> None:
    if not has_trigger(tree, event, "compensate"):
        return
    if tree.out(event):
        tree.report(COMPENSATION_BOUNDARY_FLOW, event)
    if is_false(event, "cancelActivity"):
        tree.report(COMPENSATION_BOUNDARY_NOT_INTERRUPTING, event)
    beside = tree.boundary.get(named(event.get("attachedToRef", "")), [])
    if [each for each in beside if has_trigger(tree, each, "compensate")][:1] != [event]:
        tree.report(TWO_COMPENSATION_EVENTS, event)
    handlers = _associated(tree, event, ACTIVITIES)
    if not handlers:
        tree.report(COMPENSATION_WITHOUT_HANDLER, event)
    if len(handlers) > 1:
        tree.report(TWO_HANDLERS, event, ", ".join(map(what, handlers)))
    for handler in handlers:
        if handler.getparent() is not event.getparent():
            tree.report(HANDLER_ELSEWHERE, handler, f"{what(event)} leads to it")
        if not is_true(handler, "isForCompensation"):
            tree.report(HANDLER_NOT_MARKED, handler)


def _associated(tree: Tree, element: etree._Element, tags: frozenset[str]) -> list[etree._Element]:
    found: list[etree._Element] = []
    for association in tree.associations.get(element.get("id", ""), []):
        for attribute in ("sourceRef", "targetRef"):
            other = tree.find(association, association.get(attribute, ""))
            if other is not None and other is not element and other.tag in tags:
                found.append(other)
    return found


def _handlers(tree: Tree) -> None:
    if not tree.mentions("isForCompensation"):
        return
    for element in tree.root.iter(*ACTIVITIES):
        if not is_true(element, "isForCompensation"):
            continue
        if tree.into(element):
            tree.report(HANDLER_INCOMING, element)
        if tree.out(element):
            tree.report(HANDLER_OUTGOING, element)
        by_event = is_true(element, "triggeredByEvent")
        if not by_event and not _associated(tree, element, _BOUNDARY):
            tree.report(HANDLER_UNUSED, element)


CHECKS = Checks(
    {"compensateEventDefinition": _definition, "boundaryEvent": _boundary},
    (_handlers,),
)
