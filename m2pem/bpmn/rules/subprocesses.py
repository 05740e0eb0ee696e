"""Processes and subprocesses: event, transaction and ad-hoc ones (BPMN 2.0.2, 10.3.5, 10.5.6)."""

from lxml import etree

from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    SUBPROCESSES,
    Checks,
    Tree,
    children,
    is_false,
    is_true,
    parent,
    trigger_name,
    triggers,
    what,
)

error, warning = family("10.3.5")

NO_PROCESS = error(
    108,
    "the file has no process",
    "draw a process with a start event",
)
EMPTY_PROCESS = error(
    109,
    "a process has no elements (a warning for a closed pool)",
    "draw its content, or delete it",
)
EMPTY_SUBPROCESS = warning(
    301,
    "a subprocess has no elements",
    "draw its content, or make it a task",
)
AD_HOC_ORDERING = error(
    10355,
    "the ad-hoc subprocess's ordering is none that BPMN has",
    'write ordering="Parallel" or ordering="Sequential"',
)
NO_START = error(
    13201,
    "nothing in a process or subprocess can start, or an event subprocess has no start event",
    "add a start event",
    clause="13.2",
)
UNREACHABLE = error(
    13202,
    "no start event, and nothing else that begins, leads to an element",
    "draw a sequence flow to it, or delete it",
    clause="13.2",
)

EVENT_SUBPROCESS_INCOMING = error(
    10332,
    "an event subprocess must not have an incoming flow; its start event begins it",
    "delete the flow, or triggeredByEvent",
)
EVENT_SUBPROCESS_OUTGOING = error(
    10333,
    "an event subprocess must not have an outgoing flow",
    "delete the flow, or triggeredByEvent",
)
EVENT_SUBPROCESS_STARTS = error(
    10334,
    "an event subprocess must not have several start events",
    "keep one, or draw an event subprocess for each",
)
TRANSACTION_METHOD = warning(
    10341,
    "the transaction's method is none that BPMN has",
    "write ##Compensate, ##Store, ##Image or the URI of a protocol",
)
AD_HOC_ACTIVITIES = warning(
    10351,
    "the ad-hoc subprocess has no activity",
    "draw the activities that may be done in it",
)
AD_HOC_START = error(
    10352,
    "an ad-hoc subprocess must not have a start event",
    "delete it; activities without an incoming flow can be begun at any time",
)
AD_HOC_END = warning(
    10353,
    "an ad-hoc subprocess must not have an end event",
    "delete it; write a completionCondition",
)
AD_HOC_CANCEL = warning(
    10354,
    "cancelRemainingInstances has no meaning in an ad-hoc subprocess of ordering Sequential",
    "delete it; only one activity runs at a time",
)
EVENT_SUBPROCESS_TWICE = warning(
    10555,
    "two interrupting event subprocesses wait for the same event",
    "keep one, or let one not interrupt",
    clause="10.5.6",
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
        tree.report(EVENT_SUBPROCESS_INCOMING, element)
    if tree.out(element):
        tree.report(EVENT_SUBPROCESS_OUTGOING, element)
    starts = list(children(element, "startEvent"))
    if len(starts) > 1:
        tree.report(EVENT_SUBPROCESS_STARTS, element, f"this one has {len(starts)}")


def _same_events(tree: Tree) -> None:
    """Report interrupting event subprocesses of one scope for one event, but for the first."""
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
                    tree.report(EVENT_SUBPROCESS_TWICE, element, f"{what(first)} does, too")


def _transaction(tree: Tree, element: etree._Element) -> None:
    method = element.get("method", "##Compensate").strip()
    if method not in ("##Compensate", "##Store", "##Image") and ":" not in method:
        tree.report(TRANSACTION_METHOD, element, f"'{method}'")
    _subprocess(tree, element)


def _ad_hoc(tree: Tree, element: etree._Element) -> None:
    if next(element.iterchildren(*ACTIVITIES), None) is None:
        tree.report(AD_HOC_ACTIVITIES, element, unless=(EMPTY_SUBPROCESS,))
    for start in children(element, "startEvent"):
        tree.report(AD_HOC_START, start)
    for end in children(element, "endEvent"):
        tree.report(AD_HOC_END, end)
    sequential = element.get("ordering", "").strip() == "Sequential"
    if sequential and element.get("cancelRemainingInstances") is not None:
        tree.report(AD_HOC_CANCEL, element)
    _subprocess(tree, element)


CHECKS = Checks(
    {"subProcess": _subprocess, "transaction": _transaction, "adHocSubProcess": _ad_hoc},
    (_same_events,),
)
