"""Event-based gateways and what they may lead to (BPMN 2.0.2, 10.6.6)."""

from collections.abc import Sequence

from lxml import etree

from m2pem.bpmn.names import a, kind
from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    Tree,
    has,
    has_trigger,
    is_true,
    name_of,
    trigger_name,
    triggers,
    what,
)

BRANCHES = Rule(
    10611,
    "event-gateway-branches",
    "10.6.6",
    E,
    "an event-based gateway must have two or more outgoing flows",
    "lead a flow from it to each event that it waits for",
)
TARGET = Rule(
    10612,
    "event-gateway-target",
    "10.6.6",
    E,
    "an event-based gateway can lead only to catching intermediate events and receive tasks",
    "put an event between the two, or use another gateway",
)
TRIGGER = Rule(
    10613,
    "event-gateway-trigger",
    "10.6.6",
    E,
    "an event behind an event-based gateway can wait only for a message, signal, timer or "
    "condition",
    "give the event one of these triggers",
)
MIXED = Rule(
    10614,
    "event-gateway-mixed",
    "10.6.6",
    W,
    "the event-based gateway leads to both message events and receive tasks",
    "use one of the two for all its messages",
)
BOUNDARY = Rule(
    10615,
    "event-gateway-boundary",
    "10.6.6",
    E,
    "a receive task behind an event-based gateway must not have boundary events",
    "make what it waits for another branch of the gateway",
)
SHARED = Rule(
    10616,
    "event-gateway-shared-target",
    "10.6.6",
    W,
    "what an event-based gateway leads to must not have another incoming flow",
    "draw an event of its own for the other flow",
)
CONDITION = Rule(
    10617,
    "event-gateway-condition",
    "10.6.6",
    W,
    "a flow out of an event-based gateway must not have a condition; events decide",
    "delete the condition",
    same_as=("condition-ignored", "condition-not-allowed"),
)
BEGINS = Rule(
    10619,
    "event-gateway-begins",
    "10.6.6",
    E,
    "an event-based gateway that begins a process must not have an incoming flow",
    'delete the flow, or instantiate="true"',
)
TYPE = Rule(
    10620,
    "event-gateway-type",
    "10.6.6",
    E,
    "the event-based gateway's type is none that BPMN has",
    "write Exclusive or Parallel",
    same_as=("bad-value",),
)
_TRIGGERS = frozenset({"message", "signal", "timer", "conditional"})


def _gateway(tree: Tree, element: etree._Element) -> None:
    flows = tree.out(element)
    if len(flows) < 2:
        tree.say(BRANCHES, element, f"this one has {len(flows)}")
    targets = [tree.find(flow, flow.get("targetRef", "")) for flow in flows]
    found = [target for target in targets if target is not None]
    _check_targets(tree, element, found)
    for flow in flows:
        if has(flow, "conditionExpression"):
            tree.say(CONDITION, flow)
    begins = is_true(element, "instantiate")
    kind_of = element.get("eventGatewayType", "Exclusive").strip()
    if kind_of not in ("Exclusive", "Parallel"):
        tree.say(TYPE, element, f"'{kind_of}'")
    if begins and tree.into(element):
        tree.say(BEGINS, element)


def _check_targets(tree: Tree, gateway: etree._Element, targets: Sequence[etree._Element]) -> None:
    for target in targets:
        name = name_of(target)
        if name == "receiveTask":
            if tree.boundary.get(target.get("id", "")):
                tree.say(BOUNDARY, target)
        elif name != "intermediateCatchEvent":
            tree.say(TARGET, gateway, f"{what(target)} is {a(kind(target.tag))}")
            continue
        for each in triggers(tree, target):
            if trigger_name(each) not in _TRIGGERS:
                tree.say(TRIGGER, target, f"this one for {a(kind(each.tag))}")
        if len(tree.into(target)) > 1:
            tree.say(SHARED, target)
    if any(name_of(target) == "receiveTask" for target in targets) and any(
        has_trigger(tree, target, "message") for target in targets
    ):
        tree.say(MIXED, gateway)


TOPIC = Topic(declared(globals()), {"eventBasedGateway": _gateway})
