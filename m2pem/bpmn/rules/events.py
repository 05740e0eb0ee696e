"""Events: what may trigger them where they stand; their flows (BPMN 2.0.2, 10.5.2 to 10.5.4)."""

from lxml import etree

from m2pem.bpmn.names import BPMN, a, kind
from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    SUBPROCESSES,
    Tree,
    children,
    has,
    has_trigger,
    is_false,
    is_true,
    parent,
    trigger_name,
    triggers,
)

START = Rule(
    10501,
    "start-trigger",
    "10.5.2",
    E,
    "a process can begin only plainly, or by a message, timer, condition or signal",
    "give the start event one of these triggers, or none",
)
EVENT_SUBPROCESS_START = Rule(
    10502,
    "event-subprocess-start-trigger",
    "10.5.2",
    E,
    "an event subprocess can begin only by a message, timer, escalation, error, compensation, "
    "condition or signal",
    "give its start event one of these triggers",
)
END = Rule(
    10503,
    "end-result",
    "10.5.3",
    E,
    "an end event can result only in a message, error, escalation, cancellation, compensation, "
    "signal or termination, or in nothing",
    "give it one of these results, or none",
)
CATCH = Rule(
    10504,
    "catch-trigger",
    "10.5.4",
    E,
    "an intermediate event in the flow can wait only for a message, timer, condition, link or "
    "signal",
    "give it one of these triggers, or attach it to an activity",
)
THROW = Rule(
    10505,
    "throw-result",
    "10.5.4",
    E,
    "an intermediate event can throw only a message, escalation, link, compensation or signal",
    "give it one of these results, or none; or make it an end event",
)
BOUNDARY = Rule(
    10506,
    "boundary-trigger",
    "10.5.4",
    E,
    "a boundary event can wait only for a message, timer, escalation, error, cancellation, "
    "compensation, condition or signal",
    "give it one of these triggers",
)
OUTSIDE = Rule(
    10511,
    "not-interrupting-elsewhere",
    "10.5.2",
    W,
    "isInterrupting has no meaning on this start event, which is in no event subprocess",
    "delete it",
)
PARALLEL_MULTIPLE = Rule(
    10512,
    "parallel-multiple",
    "10.5.1",
    W,
    "an event with parallelMultiple must have several triggers",
    "add event definitions, or delete parallelMultiple",
)
NO_END = Rule(
    10513,
    "start-without-end",
    "10.5.3",
    W,
    "it has a start event and no end event",
    "add an end event to each path",
)
NO_START = Rule(
    10514,
    "end-without-start",
    "10.5.2",
    W,
    "it has an end event and no start event",
    "add a start event",
)
START_FLOW = Rule(
    10515,
    "start-without-flow",
    "10.5.2",
    W,
    "no sequence flow leads out of the start event",
    "draw one to what comes first",
)
INTERMEDIATE_FLOW = Rule(
    10516,
    "intermediate-without-flow",
    "10.5.4",
    W,
    "no sequence flow leads out of the intermediate event",
    "draw one to what follows, or make it an end event",
)
BOUNDARY_FLOW = Rule(
    10517,
    "boundary-without-flow",
    "10.5.4",
    W,
    "no sequence flow leads out of the boundary event",
    "draw one to what follows when it is triggered",
)

INTERMEDIATE_SOURCE = Rule(
    10520,
    "intermediate-without-incoming",
    "10.5.4",
    W,
    "no sequence flow leads into the intermediate event; it happens when its process begins",
    "draw one from what comes before",
)
COMPENSATION_START = Rule(
    10521,
    "compensation-not-interrupting",
    "10.5.2",
    W,
    "the start event of a compensation event subprocess cannot be non-interrupting",
    'delete isInterrupting="false"; what it compensates has ended',
)

SUBPROCESS_STARTS = Rule(
    13301,
    "subprocess-starts",
    "13.3.4",
    W,
    "an embedded subprocess must not have several start events; each gets a token",
    "keep one, with a parallel gateway after it if both paths are meant",
)


def _kinds(text: str) -> frozenset[str]:
    return frozenset(text.split())


_ALLOWED: dict[Rule, frozenset[str]] = {
    START: _kinds("message timer conditional signal"),
    EVENT_SUBPROCESS_START: _kinds("message timer escalation error compensate conditional signal"),
    END: _kinds("message error escalation cancel compensate signal terminate"),
    CATCH: _kinds("message timer conditional link signal"),
    THROW: _kinds("message escalation link compensate signal"),
    BOUNDARY: _kinds("message timer escalation error cancel compensate conditional signal"),
}


_AD_HOC = BPMN + "adHocSubProcess"
_RULES = {
    BPMN + "startEvent": START,
    BPMN + "endEvent": END,
    BPMN + "intermediateCatchEvent": CATCH,
    BPMN + "intermediateThrowEvent": THROW,
    BPMN + "boundaryEvent": BOUNDARY,
}


def allowed_triggers(event: etree._Element) -> frozenset[str]:
    """What may trigger an event where it stands, or result from it (tables 10.84 to 10.93)."""
    return _ALLOWED[_rule(event)]


def _rule(event: etree._Element) -> Rule:
    rule = _RULES[event.tag]
    if rule is START and is_true(parent(event), "triggeredByEvent"):
        return EVENT_SUBPROCESS_START
    return rule


def _allow(tree: Tree, event: etree._Element) -> None:
    found = triggers(tree, event)
    allowed = allowed_triggers(event)
    for each in found:
        if trigger_name(each) not in allowed:
            tree.say(_rule(event), event, f"this one has {a(kind(each.tag))}")
    if len(found) < 2 and is_true(event, "parallelMultiple"):
        tree.say(PARALLEL_MULTIPLE, event, f"this one has {len(found)}")


def _start(tree: Tree, event: etree._Element) -> None:
    outer = parent(event)
    if is_true(outer, "triggeredByEvent"):
        _allow(tree, event)
        if is_false(event, "isInterrupting") and has_trigger(tree, event, "compensate"):
            tree.say(COMPENSATION_START, event)
    else:
        if outer.tag not in SUBPROCESSES:
            _allow(tree, event)
        if is_false(event, "isInterrupting"):
            tree.say(OUTSIDE, event)
    if not tree.out(event):
        tree.say(START_FLOW, event)


def _end(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)


def _catch(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    if not has_trigger(tree, event, "link"):
        _has_source(tree, event)
    if not tree.out(event):
        tree.say(INTERMEDIATE_FLOW, event)


def _has_source(tree: Tree, event: etree._Element) -> None:
    if not tree.into(event) and parent(event).tag != _AD_HOC:
        tree.say(INTERMEDIATE_SOURCE, event)


def _throw(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    _has_source(tree, event)
    if not tree.out(event) and not has_trigger(tree, event, "link"):
        tree.say(INTERMEDIATE_FLOW, event)


def _boundary(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    if not tree.out(event) and not has_trigger(tree, event, "compensate"):
        tree.say(BOUNDARY_FLOW, event)


def _container(tree: Tree, element: etree._Element) -> None:
    if element.tag != BPMN + "process" and not is_true(element, "triggeredByEvent"):
        number = sum(1 for _ in children(element, "startEvent"))
        if number > 1:
            tree.say(SUBPROCESS_STARTS, element, f"this one has {number}")
    starts, ends = has(element, "startEvent"), has(element, "endEvent")
    if starts and not ends:
        tree.say(NO_END, element)
    elif ends and not starts:
        tree.say(NO_START, element)


TOPIC = Topic(
    declared(globals()),
    {
        "startEvent": _start,
        "endEvent": _end,
        "intermediateCatchEvent": _catch,
        "intermediateThrowEvent": _throw,
        "boundaryEvent": _boundary,
        "process": _container,
        "subProcess": _container,
        "transaction": _container,
    },
)
