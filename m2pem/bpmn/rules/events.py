"""Events: their triggers, flows and definitions (BPMN 2.0.2, 8.4.3, 8.4.4 and 10.5.2 to 10.5.5)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import (
    SUBPROCESSES,
    THROWING,
    Check,
    Checks,
    Tree,
    children,
    has,
    has_trigger,
    is_false,
    is_true,
    name_of,
    parent,
    trigger_name,
    triggers,
)
from m2pem.bpmn.xml import BPMN, a, kind

error, warning = family("10.5.4")

OUTSIDE_ONLY = warning(
    308,
    "what is awaited only the outside can send",
    'mark it m2pem:from="operator"',
)
TYPED_START_IN_SUBPROCESS = error(
    10331,
    "a start event in an embedded subprocess waits for something",
    "use a plain start event, and a catching intermediate event after it",
    clause="10.3.5",
)
EVENT_NOT_ALLOWED = error(
    10387,
    "a multi-instance activity throws by itself what it cannot",
    "let it throw a message, signal, escalation, error or compensation",
    clause="10.3.8",
)
NO_TRIGGER = error(
    10507,
    "a catching intermediate event, a boundary event or the start event of an event subprocess "
    "has no trigger",
    "give it an event definition",
)
ERROR_NOT_INTERRUPTING = error(
    10508,
    "a boundary or start event that catches an error does not interrupt",
    "make it interrupting, or throw and catch an escalation",
)
BAD_ATTACHMENT = error(
    10519,
    "a boundary event is attached to no activity beside it",
    "attach it to an activity of the same process or subprocess",
)
TIMER_TIME = error(
    10531,
    "a timer has no time, several, or one that is no ISO 8601",
    "give it one timeDuration, timeDate or timeCycle",
    clause="10.5.5",
)
MISSING_REFERENCE = warning(
    10532,
    "an event or task names no message, signal, error or escalation",
    "add messageRef, signalRef, errorRef or escalationRef",
    clause="10.5.5",
)
NO_CONDITION = error(
    10533,
    "a conditional event has no condition",
    "add one, for example <condition>battery.level &lt; 20</condition>",
    clause="10.5.5",
)
LINK_NAME = error(
    10541,
    "a link event has no name",
    'name it: <linkEventDefinition name="A"/>, and the other end alike',
    clause="10.5.5",
)
DANGLING_LINK = error(
    10542,
    "no catching link event has the name of a throwing one",
    "add a catching intermediate event with a link of this name",
)
DUPLICATE_LINK = error(
    10543,
    "two catching link events have the same name",
    "give it another name, or lead the sources to one of the two",
)
LINK_THROW_OUTGOING = error(
    10545,
    "a sequence flow leads out of a throwing link event",
    "let it begin at what follows the link target",
)
LINK_CATCH_INCOMING = error(
    10546,
    "a sequence flow leads into a catching link event",
    "lead it to what follows the link target",
)
LINK_CROSSES_BORDER = error(
    10547,
    "a link leads out of its process or subprocess",
    "put both of its ends into the same process or subprocess",
    clause="10.5.5",
)

START_TRIGGER = error(
    10501,
    "a process can begin only plainly, or by a message, timer, condition or signal",
    "give the start event one of these triggers, or none",
    clause="10.5.2",
)
EVENT_SUBPROCESS_START_TRIGGER = error(
    10502,
    "an event subprocess can begin only by a message, timer, escalation, error, compensation, "
    "condition or signal",
    "give its start event one of these triggers",
    clause="10.5.2",
)
END_RESULT = error(
    10503,
    "an end event can result only in a message, error, escalation, cancellation, compensation, "
    "signal or termination, or in nothing",
    "give it one of these results, or none",
    clause="10.5.3",
)
CATCH_TRIGGER = error(
    10504,
    "an intermediate event in the flow can wait only for a message, timer, condition, link or "
    "signal",
    "give it one of these triggers, or attach it to an activity",
)
THROW_RESULT = error(
    10505,
    "an intermediate event can throw only a message, escalation, link, compensation or signal",
    "give it one of these results, or none; or make it an end event",
)
BOUNDARY_TRIGGER = error(
    10506,
    "a boundary event can wait only for a message, timer, escalation, error, cancellation, "
    "compensation, condition or signal",
    "give it one of these triggers",
)
NOT_INTERRUPTING_ELSEWHERE = warning(
    10511,
    "isInterrupting has no meaning on this start event, which is in no event subprocess",
    "delete it",
    clause="10.5.2",
)
PARALLEL_MULTIPLE = warning(
    10512,
    "an event with parallelMultiple must have several triggers",
    "add event definitions, or delete parallelMultiple",
    clause="10.5.1",
)
START_WITHOUT_END = warning(
    10513,
    "it has a start event and no end event",
    "add an end event to each path",
    clause="10.5.3",
)
END_WITHOUT_START = warning(
    10514,
    "it has an end event and no start event",
    "add a start event",
    clause="10.5.2",
)
START_WITHOUT_FLOW = warning(
    10515,
    "no sequence flow leads out of the start event",
    "draw one to what comes first",
    clause="10.5.2",
)
INTERMEDIATE_WITHOUT_FLOW = warning(
    10516,
    "no sequence flow leads out of the intermediate event",
    "draw one to what follows, or make it an end event",
)
BOUNDARY_WITHOUT_FLOW = warning(
    10517,
    "no sequence flow leads out of the boundary event",
    "draw one to what follows when it is triggered",
)

INTERMEDIATE_WITHOUT_INCOMING = warning(
    10520,
    "no sequence flow leads into the intermediate event; it happens when its process begins",
    "draw one from what comes before",
)
COMPENSATION_NOT_INTERRUPTING = warning(
    10521,
    "the start event of a compensation event subprocess cannot be non-interrupting",
    'delete isInterrupting="false"; what it compensates has ended',
    clause="10.5.2",
)

SUBPROCESS_STARTS = warning(
    13301,
    "an embedded subprocess must not have several start events; each gets a token",
    "keep one, with a parallel gateway after it if both paths are meant",
    clause="13.3.4",
)


def _kinds(text: str) -> frozenset[str]:
    return frozenset(text.split())


_ALLOWED: dict[Rule, frozenset[str]] = {
    START_TRIGGER: _kinds("message timer conditional signal"),
    EVENT_SUBPROCESS_START_TRIGGER: _kinds(
        "message timer escalation error compensate conditional signal"
    ),
    END_RESULT: _kinds("message error escalation cancel compensate signal terminate"),
    CATCH_TRIGGER: _kinds("message timer conditional link signal"),
    THROW_RESULT: _kinds("message escalation link compensate signal"),
    BOUNDARY_TRIGGER: _kinds("message timer escalation error cancel compensate conditional signal"),
}


_AD_HOC = BPMN + "adHocSubProcess"
_RULES = {
    BPMN + "startEvent": START_TRIGGER,
    BPMN + "endEvent": END_RESULT,
    BPMN + "intermediateCatchEvent": CATCH_TRIGGER,
    BPMN + "intermediateThrowEvent": THROW_RESULT,
    BPMN + "boundaryEvent": BOUNDARY_TRIGGER,
}


def allowed_triggers(event: etree._Element) -> frozenset[str]:
    """The possible triggers or results of an event in its place (tables 10.84 to 10.93)."""
    return _ALLOWED[_rule(event)]


def _rule(event: etree._Element) -> Rule:
    rule = _RULES[event.tag]
    if rule is START_TRIGGER and is_true(parent(event), "triggeredByEvent"):
        return EVENT_SUBPROCESS_START_TRIGGER
    return rule


def _allow(tree: Tree, event: etree._Element) -> None:
    found = triggers(tree, event)
    allowed = allowed_triggers(event)
    for each in found:
        if trigger_name(each) not in allowed:
            tree.report(_rule(event), event, f"this one has {a(kind(each.tag))}")
    if len(found) < 2 and is_true(event, "parallelMultiple"):
        tree.report(PARALLEL_MULTIPLE, event, f"this one has {len(found)}")


def _start(tree: Tree, event: etree._Element) -> None:
    outer = parent(event)
    if is_true(outer, "triggeredByEvent"):
        _allow(tree, event)
        if is_false(event, "isInterrupting") and has_trigger(tree, event, "compensate"):
            tree.report(COMPENSATION_NOT_INTERRUPTING, event)
    else:
        if outer.tag not in SUBPROCESSES:
            _allow(tree, event)
        if is_false(event, "isInterrupting"):
            tree.report(NOT_INTERRUPTING_ELSEWHERE, event)
    if not tree.out(event):
        tree.report(START_WITHOUT_FLOW, event)


def _catch(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    if not has_trigger(tree, event, "link"):
        _has_source(tree, event)
    if not tree.out(event):
        tree.report(INTERMEDIATE_WITHOUT_FLOW, event)


def _has_source(tree: Tree, event: etree._Element) -> None:
    outer = parent(event)
    if tree.into(event) or outer.tag == _AD_HOC:
        return
    if not has(outer, "startEvent"):  # else it never happens, which another rule says
        tree.report(INTERMEDIATE_WITHOUT_INCOMING, event)


def _throw(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    _has_source(tree, event)
    if not tree.out(event) and not has_trigger(tree, event, "link"):
        tree.report(INTERMEDIATE_WITHOUT_FLOW, event)


def _boundary(tree: Tree, event: etree._Element) -> None:
    _allow(tree, event)
    if not tree.out(event) and not has_trigger(tree, event, "compensate"):
        tree.report(BOUNDARY_WITHOUT_FLOW, event)


def _container(tree: Tree, element: etree._Element) -> None:
    if element.tag != BPMN + "process" and not is_true(element, "triggeredByEvent"):
        number = sum(1 for _ in children(element, "startEvent"))
        if number > 1:
            tree.report(SUBPROCESS_STARTS, element, f"this one has {number}")
    starts, ends = has(element, "startEvent"), has(element, "endEvent")
    if starts and not ends:
        tree.report(START_WITHOUT_END, element)
    elif ends and not starts:
        tree.report(END_WITHOUT_START, element)


CHECKS = Checks(
    {
        "startEvent": _start,
        "endEvent": _allow,
        "intermediateCatchEvent": _catch,
        "intermediateThrowEvent": _throw,
        "boundaryEvent": _boundary,
        "process": _container,
        "subProcess": _container,
        "transaction": _container,
    },
)


THROWN_ERROR_CODE = warning(
    8422,
    "the error that is thrown has no errorCode",
    "add errorCode to the error; until then its id is its code",
    clause="8.4.3",
)
THROWN_ESCALATION_CODE = warning(
    8432,
    "the escalation that is thrown has no escalationCode",
    "add escalationCode to the escalation; until then its id is its code",
    clause="8.4.4",
)
CANCEL_END_PLACE = error(
    10549,
    "a cancel end event may be only in a transaction",
    "make what is around it a transaction, or use an error or terminate end event",
    clause="10.5.5",
)
CANCEL_BOUNDARY_PLACE = error(
    10550,
    "a cancel boundary event can be attached only to a transaction",
    "make the activity a transaction, or catch an error",
    clause="10.5.5",
)
CANCEL_NOT_INTERRUPTING = error(
    10551,
    "a cancel boundary event must interrupt the transaction",
    'delete cancelActivity="false"',
    clause="10.5.5",
)
CANCEL_UNCAUGHT = warning(
    10552,
    "no boundary event of the transaction catches the cancellation; its token ends there",
    "attach a cancel boundary event to the transaction",
    clause="10.5.6",
)


def _has_code(thrown: str, rule: Rule) -> Check:
    """What an event throws, an error or an escalation, has a code."""

    def check(tree: Tree, definition: etree._Element) -> None:
        name = definition.get(f"{thrown}Ref")
        if not name or parent(definition).tag not in THROWING:
            return
        root = tree.find(definition, name)
        if root is not None and name_of(root) == thrown and not root.get(f"{thrown}Code"):
            tree.report(rule, definition, f"'{name}'")

    return check


def _cancel(tree: Tree, definition: etree._Element) -> None:
    event = parent(definition)
    transaction = BPMN + "transaction"
    around = parent(event)
    if name_of(event) == "endEvent" and around.tag != transaction:
        tree.report(CANCEL_END_PLACE, event)
    elif name_of(event) == "endEvent":
        attached = tree.boundary.get(around.get("id", ""), [])
        if not any(has_trigger(tree, each, "cancel") for each in attached):
            tree.report(CANCEL_UNCAUGHT, event)
    elif name_of(event) == "boundaryEvent":
        host = tree.find(event, event.get("attachedToRef", ""))
        if host is not None and host.tag != transaction:
            tree.report(CANCEL_BOUNDARY_PLACE, event)
        if is_false(event, "cancelActivity"):
            tree.report(CANCEL_NOT_INTERRUPTING, event)


DEFINITIONS = Checks(
    {
        "errorEventDefinition": _has_code("error", THROWN_ERROR_CODE),
        "escalationEventDefinition": _has_code("escalation", THROWN_ESCALATION_CODE),
        "cancelEventDefinition": _cancel,
    },
)
