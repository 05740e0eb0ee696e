"""Sequence flows (BPMN 2.0.2, 7.6.2 and 8.4.13)."""

from lxml import etree

from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    Checks,
    Tree,
    is_false,
    is_true,
    named,
    parent,
    what,
)
from m2pem.bpmn.xml import BPMN

error, warning = family("8.4.13")

FLOW_INTO_START = error(
    7601,
    "a sequence flow leads into a start event",
    "lead it to what follows the start event",
    clause="7.6.2",
)
FLOW_INTO_BOUNDARY = error(
    7602,
    "a sequence flow leads into a boundary event",
    "lead it to the activity, or to what follows the boundary event",
    clause="7.6.2",
)
FLOW_OUT_OF_END = error(
    7603,
    "a sequence flow leads out of an end event",
    "make it an intermediate throw event, or delete the flow",
    clause="7.6.2",
)
FLOW_CROSSES_BORDER = error(
    7604,
    "a sequence flow crosses the border of a subprocess or pool",
    "let it lead from or to the subprocess itself; between pools, draw a message flow",
    clause="7.6.2",
)
CONDITION_NOT_ALLOWED = error(
    8471,
    "a flow out of an event has a condition",
    "put an exclusive gateway behind the event",
)
CONDITION_IGNORED = warning(
    8472,
    "a flow out of a parallel gateway has a condition",
    "delete the condition, or make the gateway inclusive",
)
DEFAULT_WITH_CONDITION = warning(
    8473,
    "the default flow has a condition",
    "delete the condition, or make another flow the default",
)
DEFAULT_NOT_OWN = error(
    8474,
    "the default flow leaves another element",
    "name one of its own outgoing sequence flows",
)
EMPTY_CONDITION = warning(
    8475,
    "a conditionExpression is empty",
    "write the condition, or delete the conditionExpression",
)

LONE_CONDITION = warning(
    8476,
    "the only flow out of an activity has a condition",
    "add a flow for when it is false, or delete the condition",
)
IMMEDIATE_FALSE = warning(
    8477,
    "isImmediate must not be false in an executable process",
    "delete it",
)
LISTED_FLOW = warning(
    8478,
    "it lists an incoming or outgoing sequence flow that does not exist",
    "delete the incoming or outgoing element; the flows themselves count",
)

LISTED_FLOW_ELSEWHERE = warning(
    8479,
    "it lists an incoming or outgoing sequence flow that is another element's",
    "correct the incoming or outgoing element, or the flow; the flows count",
)

UNLISTED_FLOW = warning(
    8480,
    "it lists some of its incoming or outgoing sequence flows, and not this one",
    "add it to the incoming or outgoing elements; the flows count",
)

_INCOMING = BPMN + "incoming"
_OUTGOING = BPMN + "outgoing"


def _condition(tree: Tree, element: etree._Element) -> None:
    flow = parent(element)
    source = tree.find(flow, flow.get("sourceRef", ""))
    if source is not None and source.tag in ACTIVITIES and len(tree.out(source)) == 1:
        tree.report(LONE_CONDITION, flow)


def _immediate(tree: Tree) -> None:
    if not tree.mentions("isImmediate"):
        return
    for flow in tree.flows:
        if is_false(flow, "isImmediate"):
            process = next(flow.iterancestors(BPMN + "process"), None)
            if process is not None and is_true(process, "isExecutable"):
                tree.report(IMMEDIATE_FALSE, flow)


def _listed(tree: Tree) -> None:
    known: dict[str, etree._Element] = {}
    for tag, end in (_INCOMING, "targetRef"), (_OUTGOING, "sourceRef"):
        listed = list(tree.root.iter(tag))
        if not listed:
            continue
        known = known or {flow.get("id", ""): flow for flow in tree.flows}
        # The ends of flows that are still to be listed, as (id of the element, id of the flow).
        ends = {(named(flow.get(end, "")), name): flow for name, flow in known.items()}
        listing: dict[str, etree._Element] = {}
        for element in listed:
            name = (element.text or "").strip()
            holder = parent(element)
            owner = holder.get("id", "")
            if ends.pop((owner, name), None) is None:
                flow = known.get(name, known.get(named(name)))
                if flow is None:
                    if name:
                        tree.report(LISTED_FLOW, element, f"'{name}'")
                    continue
                there = flow.get(end, "")
                if owner and named(there) != owner:
                    tree.report(LISTED_FLOW_ELSEWHERE, element, f"{end} of '{name}' is '{there}'")
                    continue
                ends.pop((owner, flow.get("id", "")), None)
            listing[owner] = holder
        missing: dict[str, list[str]] = {}
        for (owner, _), flow in ends.items():
            if owner and owner in listing:
                missing.setdefault(owner, []).append(what(flow))
        for owner, flows in missing.items():
            tree.report(UNLISTED_FLOW, listing[owner], ", ".join(flows))


CHECKS = Checks({"conditionExpression": _condition}, (_immediate, _listed))
