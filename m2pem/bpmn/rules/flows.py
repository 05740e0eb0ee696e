"""Sequence flows (BPMN 2.0.2, 7.6.2 and 8.4.13)."""

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import ACTIVITIES, Tree, is_false, is_true, named, parent, what

LONE_CONDITION = Rule(
    8476,
    "lone-condition",
    "8.4.13",
    W,
    "the only flow out of an activity has a condition",
    "add a flow for when it is false, or delete the condition",
)
IMMEDIATE = Rule(
    8477,
    "immediate-false",
    "8.4.13",
    W,
    "isImmediate must not be false in an executable process",
    "delete it",
)
LISTED = Rule(
    8478,
    "listed-flow",
    "8.4.13",
    W,
    "it lists an incoming or outgoing sequence flow that does not exist",
    "delete the incoming or outgoing element; the flows themselves count",
)

LISTED_ELSEWHERE = Rule(
    8479,
    "listed-flow-elsewhere",
    "8.4.13",
    W,
    "it lists an incoming or outgoing sequence flow that is another element's",
    "correct the incoming or outgoing element, or the flow; the flows count",
)

UNLISTED = Rule(
    8480,
    "unlisted-flow",
    "8.4.13",
    W,
    "it lists some of its incoming or outgoing sequence flows, and not this one",
    "add it to the incoming or outgoing elements; the flows count",
)

_INCOMING = BPMN + "incoming"
_OUTGOING = BPMN + "outgoing"


def _condition(tree: Tree, element: etree._Element) -> None:
    flow = parent(element)
    source = tree.find(flow, flow.get("sourceRef", ""))
    if source is not None and source.tag in ACTIVITIES and len(tree.out(source)) == 1:
        tree.say(LONE_CONDITION, flow)


def _immediate(tree: Tree) -> None:
    if not tree.mentions("isImmediate"):
        return
    for flow in tree.flows:
        if is_false(flow, "isImmediate"):
            process = next(flow.iterancestors(BPMN + "process"), None)
            if process is not None and is_true(process, "isExecutable"):
                tree.say(IMMEDIATE, flow)


def _listed(tree: Tree) -> None:
    known = {flow.get("id", ""): flow for flow in tree.flows}
    for tag, end in (_INCOMING, "targetRef"), (_OUTGOING, "sourceRef"):
        # The ends of flows that are still to be listed, as (id of the element, id of the flow).
        ends = {(named(flow.get(end, "")), name): flow for name, flow in known.items()}
        listing: dict[str, etree._Element] = {}
        for element in tree.root.iter(tag):
            name = (element.text or "").strip()
            holder = parent(element)
            owner = holder.get("id", "")
            if ends.pop((owner, name), None) is None:
                flow = known.get(name, known.get(named(name)))
                if flow is None:
                    if name:
                        tree.say(LISTED, element, f"'{name}'")
                    continue
                there = flow.get(end, "")
                if owner and named(there) != owner:
                    tree.say(LISTED_ELSEWHERE, element, f"{end} of '{name}' is '{there}'")
                    continue
                ends.pop((owner, flow.get("id", "")), None)
            listing[owner] = holder
        missing: dict[str, list[str]] = {}
        for (owner, _), flow in ends.items():
            if owner and owner in listing:
                missing.setdefault(owner, []).append(what(flow))
        for owner, flows in missing.items():
            tree.say(UNLISTED, listing[owner], ", ".join(flows))


TOPIC = Topic(declared(globals()), {"conditionExpression": _condition}, (_immediate, _listed))
