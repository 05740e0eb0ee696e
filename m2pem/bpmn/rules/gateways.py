"""Gateways: their direction, and event-based ones (BPMN 2.0.2, 8.4.9 and 10.6)."""

from collections.abc import Sequence

from lxml import etree

from m2pem.bpmn.rules.attributes import BAD_VALUE
from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.sequence_flows import CONDITION_IGNORED, CONDITION_NOT_ALLOWED
from m2pem.bpmn.rules.tree import (
    GATEWAYS,
    Checks,
    Tree,
    has,
    has_trigger,
    is_true,
    name_of,
    parent,
    trigger_name,
    triggers,
    what,
)
from m2pem.bpmn.xml import a, kind, local

error, warning = family("10.6.6")

NO_CONDITIONS = warning(
    309,
    "no flow out of a gateway has a condition",
    "give the flows conditions",
)
INCOMPLETE_CONDITIONS = warning(
    315,
    "a gateway without a default may find none of its flows' conditions true",
    "draw a default flow, or cover the case",
)
NO_ACTIVATION_CONDITION = warning(
    10605,
    "a complex gateway does not say when it is activated",
    "add one, for example <activationCondition>activationCount >= 2</activationCondition>",
    clause="10.6.5",
)
PARALLEL_EVENT_GATEWAY = error(
    10618,
    "an event-based gateway that does not begin a process cannot be parallel",
    'add instantiate="true" where it has no incoming flow; else fork with a parallel '
    "gateway, and wait for one event on each branch",
)

GATEWAY_DIRECTION = warning(
    8491,
    "the gateway's direction is none that BPMN has",
    "write Unspecified, Converging, Diverging or Mixed",
    clause="8.4.9",
)
IDLE_GATEWAY = warning(
    10601,
    "the gateway neither merges nor splits",
    "draw several flows to it or from it, or delete it",
    clause="10.6.1",
)
NOT_CONVERGING = warning(
    10602,
    "a converging gateway must have several incoming flows and at most one outgoing flow",
    "correct its gatewayDirection; the flows count",
    clause="10.6.1",
)
NOT_DIVERGING = warning(
    10603,
    "a diverging gateway must have at most one incoming flow and several outgoing flows",
    "correct its gatewayDirection; the flows count",
    clause="10.6.1",
)
NOT_MIXED = warning(
    10604,
    "a mixed gateway must have several incoming and several outgoing flows",
    "correct its gatewayDirection; the flows count",
    clause="10.6.1",
)


def _gateway(tree: Tree, element: etree._Element) -> None:
    incoming, outgoing = len(tree.into(element)), len(tree.out(element))
    direction = element.get("gatewayDirection", "Unspecified").strip()
    if direction not in ("Unspecified", "Converging", "Diverging", "Mixed"):
        tree.report(GATEWAY_DIRECTION, element, f"'{direction}'")
    detail = f"this one has {incoming} incoming and {outgoing} outgoing"
    if incoming < 2 and outgoing < 2:
        alone = incoming + outgoing == 0 and name_of(parent(element)) == "adHocSubProcess"
        if name_of(element) != "eventBasedGateway" and not alone:
            tree.report(IDLE_GATEWAY, element)
    elif direction == "Converging" and (incoming < 2 or outgoing > 1):
        tree.report(NOT_CONVERGING, element, detail)
    elif direction == "Diverging" and (incoming > 1 or outgoing < 2):
        tree.report(NOT_DIVERGING, element, detail)
    elif direction == "Mixed" and (incoming < 2 or outgoing < 2):
        tree.report(NOT_MIXED, element, detail)


CHECKS = Checks(dict.fromkeys(map(local, GATEWAYS), _gateway))


EVENT_GATEWAY_BRANCHES = error(
    10611,
    "an event-based gateway must have two or more outgoing flows",
    "lead a flow from it to each event that it waits for",
)
EVENT_GATEWAY_TARGET = error(
    10612,
    "an event-based gateway can lead only to catching intermediate events and receive tasks",
    "put an event between the two, or use another gateway",
)
EVENT_GATEWAY_TRIGGER = error(
    10613,
    "an event behind an event-based gateway can wait only for a message, signal, timer or "
    "condition",
    "give the event one of these triggers",
)
EVENT_GATEWAY_MIXED = warning(
    10614,
    "the event-based gateway leads to both message events and receive tasks",
    "use one of the two for all its messages",
)
EVENT_GATEWAY_BOUNDARY = error(
    10615,
    "a receive task behind an event-based gateway must not have boundary events",
    "make what it waits for another branch of the gateway",
)
EVENT_GATEWAY_SHARED_TARGET = warning(
    10616,
    "what an event-based gateway leads to must not have another incoming flow",
    "draw an event of its own for the other flow",
)
EVENT_GATEWAY_CONDITION = warning(
    10617,
    "a flow out of an event-based gateway must not have a condition; events decide",
    "delete the condition",
)
EVENT_GATEWAY_BEGINS = error(
    10619,
    "an event-based gateway that begins a process must not have an incoming flow",
    'delete the flow, or instantiate="true"',
)
EVENT_GATEWAY_TYPE = error(
    10620,
    "the event-based gateway's type is none that BPMN has",
    "write Exclusive or Parallel",
)
_TRIGGERS = frozenset({"message", "signal", "timer", "conditional"})


def _gateway_event_gateway(tree: Tree, element: etree._Element) -> None:
    flows = tree.out(element)
    if len(flows) < 2:
        tree.report(EVENT_GATEWAY_BRANCHES, element, f"this one has {len(flows)}")
    targets = [tree.find(flow, flow.get("targetRef", "")) for flow in flows]
    found = [target for target in targets if target is not None]
    _check_targets(tree, element, found)
    for flow in flows:
        if has(flow, "conditionExpression"):
            unless = (CONDITION_IGNORED, CONDITION_NOT_ALLOWED)
            tree.report(EVENT_GATEWAY_CONDITION, flow, unless=unless)
    begins = is_true(element, "instantiate")
    kind_of = element.get("eventGatewayType", "Exclusive").strip()
    if kind_of not in ("Exclusive", "Parallel"):
        tree.report(EVENT_GATEWAY_TYPE, element, f"'{kind_of}'", unless=(BAD_VALUE,))
    if begins and tree.into(element):
        tree.report(EVENT_GATEWAY_BEGINS, element)


def _check_targets(tree: Tree, gateway: etree._Element, targets: Sequence[etree._Element]) -> None:
    for target in targets:
        name = name_of(target)
        if name == "receiveTask":
            if tree.boundary.get(target.get("id", "")):
                tree.report(EVENT_GATEWAY_BOUNDARY, target)
        elif name != "intermediateCatchEvent":
            tree.report(EVENT_GATEWAY_TARGET, gateway, f"{what(target)} is {a(kind(target.tag))}")
            continue
        for each in triggers(tree, target):
            if trigger_name(each) not in _TRIGGERS:
                tree.report(EVENT_GATEWAY_TRIGGER, target, f"this one for {a(kind(each.tag))}")
        if len(tree.into(target)) > 1:
            tree.report(EVENT_GATEWAY_SHARED_TARGET, target)
    if any(name_of(target) == "receiveTask" for target in targets) and any(
        has_trigger(tree, target, "message") for target in targets
    ):
        tree.report(EVENT_GATEWAY_MIXED, gateway)


EVENT_BASED = Checks({"eventBasedGateway": _gateway_event_gateway})
