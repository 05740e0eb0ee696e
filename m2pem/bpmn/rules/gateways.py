"""Gateways as their direction says they are (BPMN 2.0.2, 8.4.9 and 10.6)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, name_of, parent

DIRECTION = Rule(
    8491,
    "gateway-direction",
    "8.4.9",
    W,
    "the gateway's direction is none that BPMN has",
    "write Unspecified, Converging, Diverging or Mixed",
)
IDLE = Rule(
    10601,
    "idle-gateway",
    "10.6.1",
    W,
    "the gateway neither merges nor splits",
    "draw several flows to it or from it, or delete it",
)
CONVERGING = Rule(
    10602,
    "not-converging",
    "10.6.1",
    W,
    "a converging gateway must have several incoming flows and at most one outgoing flow",
    "correct its gatewayDirection; the flows count",
)
DIVERGING = Rule(
    10603,
    "not-diverging",
    "10.6.1",
    W,
    "a diverging gateway must have at most one incoming flow and several outgoing flows",
    "correct its gatewayDirection; the flows count",
)
MIXED = Rule(
    10604,
    "not-mixed",
    "10.6.1",
    W,
    "a mixed gateway must have several incoming and several outgoing flows",
    "correct its gatewayDirection; the flows count",
)


def _gateway(tree: Tree, element: etree._Element) -> None:
    incoming, outgoing = len(tree.into(element)), len(tree.out(element))
    direction = element.get("gatewayDirection", "Unspecified").strip()
    if direction not in ("Unspecified", "Converging", "Diverging", "Mixed"):
        tree.say(DIRECTION, element, f"'{direction}'")
    detail = f"this one has {incoming} incoming and {outgoing} outgoing"
    if incoming < 2 and outgoing < 2:
        alone = incoming + outgoing == 0 and name_of(parent(element)) == "adHocSubProcess"
        if name_of(element) != "eventBasedGateway" and not alone:
            tree.say(IDLE, element)
    elif direction == "Converging" and (incoming < 2 or outgoing > 1):
        tree.say(CONVERGING, element, detail)
    elif direction == "Diverging" and (incoming > 1 or outgoing < 2):
        tree.say(DIVERGING, element, detail)
    elif direction == "Mixed" and (incoming < 2 or outgoing < 2):
        tree.say(MIXED, element, detail)


TOPIC = Topic(
    declared(globals()),
    {
        "exclusiveGateway": _gateway,
        "inclusiveGateway": _gateway,
        "parallelGateway": _gateway,
        "eventBasedGateway": _gateway,
        "complexGateway": _gateway,
    },
)
