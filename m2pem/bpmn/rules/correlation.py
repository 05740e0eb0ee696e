"""Correlation of messages by data keys (BPMN 2.0.2, 8.4.2)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, has, names, texts

RETRIEVAL = Rule(
    8411,
    "correlation-retrieval",
    "8.4.2",
    W,
    "the correlation property does not say where messages have its value",
    "add a correlationPropertyRetrievalExpression for each message",
)
KEY_PROPERTIES = Rule(
    8414,
    "correlation-key-properties",
    "8.4.2",
    W,
    "the correlation key has no properties",
    "add a correlationPropertyRef for each part of the key",
)
KEY_PROPERTY = Rule(
    8415,
    "correlation-key-property",
    "8.4.2",
    W,
    "the correlation key's correlationPropertyRef names no correlation property",
    "name a correlationProperty that stands in definitions",
)
SUBSCRIPTION_KEY = Rule(
    8416,
    "subscription-key",
    "8.4.2",
    W,
    "the correlation subscription's correlationKeyRef names no correlation key",
    "name a correlationKey of a collaboration or conversation",
)
_PROPERTY = names("correlationProperty")


def _property(tree: Tree, element: etree._Element) -> None:
    if not has(element, "correlationPropertyRetrievalExpression"):
        tree.say(RETRIEVAL, element)


def _key(tree: Tree, element: etree._Element) -> None:
    properties = texts(element, "correlationPropertyRef")
    if not properties:
        tree.say(KEY_PROPERTIES, element)
    for name in properties:
        if tree.leads_nowhere(element, name, _PROPERTY):
            tree.say(KEY_PROPERTY, element, f"'{name}'")


def _subscription(tree: Tree, element: etree._Element) -> None:
    key = element.get("correlationKeyRef", "")
    if tree.leads_nowhere(element, key, names("correlationKey")):
        tree.say(SUBSCRIPTION_KEY, element, f"'{key}'")


TOPIC = Topic(
    declared(globals()),
    {
        "correlationProperty": _property,
        "correlationKey": _key,
        "correlationSubscription": _subscription,
    },
)
