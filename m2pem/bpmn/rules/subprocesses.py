"""Event subprocesses, transactions and ad-hoc subprocesses (BPMN 2.0.2, 10.3.5 and 10.5.6)."""

from lxml import etree

from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    SUBPROCESSES,
    Tree,
    children,
    is_false,
    is_true,
    parent,
    trigger_name,
    triggers,
    what,
)

FLOW_IN = Rule(
    10332,
    "event-subprocess-incoming",
    "10.3.5",
    E,
    "an event subprocess must not have an incoming flow; its start event begins it",
    "delete the flow, or triggeredByEvent",
)
FLOW_OUT = Rule(
    10333,
    "event-subprocess-outgoing",
    "10.3.5",
    E,
    "an event subprocess must not have an outgoing flow",
    "delete the flow, or triggeredByEvent",
)
STARTS = Rule(
    10334,
    "event-subprocess-starts",
    "10.3.5",
    E,
    "an event subprocess must not have several start events",
    "keep one, or draw an event subprocess for each",
)
METHOD = Rule(
    10341,
    "transaction-method",
    "10.3.5",
    W,
    "the transaction's method is none that BPMN has",
    "write ##Compensate, ##Store, ##Image or the URI of a protocol",
)
AD_HOC_ACTIVITIES = Rule(
    10351,
    "ad-hoc-activities",
    "10.3.5",
    W,
    "the ad-hoc subprocess has no activity",
    "draw the activities that may be done in it",
    same_as=("empty-subprocess",),
)
AD_HOC_START = Rule(
    10352,
    "ad-hoc-start",
    "10.3.5",
    E,
    "an ad-hoc subprocess must not have a start event",
    "delete it; activities without an incoming flow can be begun at any time",
)
AD_HOC_END = Rule(
    10353,
    "ad-hoc-end",
    "10.3.5",
    W,
    "an ad-hoc subprocess must not have an end event",
    "delete it; write a completionCondition",
)
AD_HOC_CANCEL = Rule(
    10354,
    "ad-hoc-cancel",
    "10.3.5",
    W,
    "cancelRemainingInstances has no meaning in an ad-hoc subprocess of ordering Sequential",
    "delete it; only one activity runs at a time",
)
SAME_EVENT = Rule(
    10555,
    "event-subprocess-twice",
    "10.5.6",
    W,
    "two interrupting event subprocesses wait for the same event",
    "keep one, or let one not interrupt",
)
_REFERENCES = {
    "message": "messageRef",
    "error": "errorRef",
    "escalation": "escalationRef",
    "signal": "signalRef",
}


def _subprocess(tree: Tree, element: etree._Element) -> None:
    if not is_true(element, "triggeredByEvent"):
        return
    if tree.into(element):
        tree.say(FLOW_IN, element)
    if tree.out(element):
        tree.say(FLOW_OUT, element)
    starts = list(children(element, "startEvent"))
    if len(starts) > 1:
        tree.say(STARTS, element, f"this one has {len(starts)}")


def _same_events(tree: Tree) -> None:
    """Interrupting event subprocesses of one scope for one event; whose is said first stands."""
    seen: dict[tuple[etree._Element, str, str], etree._Element] = {}
    for element in tree.root.iter(*SUBPROCESSES):
        if not is_true(element, "triggeredByEvent"):
            continue
        for start in children(element, "startEvent"):
            if is_false(start, "isInterrupting"):
                continue
            for each in triggers(tree, start):
                name = trigger_name(each)
                if name in _REFERENCES:
                    event = each.get(_REFERENCES[name], "").rpartition(":")[2]
                elif name == "compensate":
                    event = ""
                else:
                    continue
                first = seen.setdefault((parent(element), name, event), element)
                if first is not element:
                    tree.say(SAME_EVENT, element, f"{what(first)} does, too")


def _transaction(tree: Tree, element: etree._Element) -> None:
    method = element.get("method", "##Compensate").strip()
    if method not in ("##Compensate", "##Store", "##Image") and ":" not in method:
        tree.say(METHOD, element, f"'{method}'")
    _subprocess(tree, element)


def _ad_hoc(tree: Tree, element: etree._Element) -> None:
    if next(element.iterchildren(*ACTIVITIES), None) is None:
        tree.say(AD_HOC_ACTIVITIES, element)
    for start in children(element, "startEvent"):
        tree.say(AD_HOC_START, start)
    for end in children(element, "endEvent"):
        tree.say(AD_HOC_END, end)
    sequential = element.get("ordering", "").strip() == "Sequential"
    if sequential and element.get("cancelRemainingInstances") is not None:
        tree.say(AD_HOC_CANCEL, element)
    _subprocess(tree, element)


TOPIC = Topic(
    declared(globals()),
    {"subProcess": _subprocess, "transaction": _transaction, "adHocSubProcess": _ad_hoc},
    (_same_events,),
)
