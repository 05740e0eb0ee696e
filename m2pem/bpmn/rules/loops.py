"""Loops and multi-instance activities (BPMN 2.0.2, 10.3.8)."""

from lxml import etree

from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, has, texts

ENDLESS = Rule(
    10373,
    "loop-without-condition",
    "10.3.8",
    W,
    "the loop does not say how long it goes on",
    "add a loopCondition or a loopMaximum",
)
UNUSED_EVENT = Rule(
    10378,
    "instances-event-unused",
    "10.3.8",
    W,
    "the multi-instance activity names an event that its behavior never throws",
    'write behavior="None" or behavior="One" as the event is meant, or delete its reference',
)
COMPLEX = Rule(
    10379,
    "instances-complex",
    "10.3.8",
    E,
    "the multi-instance behavior is Complex, but nothing says what is thrown, and when",
    "add a complexBehaviorDefinition",
)
UNUSED_COMPLEX = Rule(
    10380,
    "instances-complex-unused",
    "10.3.8",
    W,
    "complexBehaviorDefinition has no effect without the behavior Complex",
    'write behavior="Complex", or delete it',
)
INPUT_ITEM = Rule(
    10382,
    "input-item-without-input",
    "10.3.8",
    W,
    "inputDataItem has no effect without loopDataInputRef",
    "add the collection, or delete the item",
)
OUTPUT_ITEM = Rule(
    10383,
    "output-without-item",
    "10.3.8",
    W,
    "one of loopDataOutputRef and outputDataItem is missing",
    "add it, or delete the other",
)
_THROWN = {"noneBehaviorEventRef": "None", "oneBehaviorEventRef": "One"}


def _loop(tree: Tree, element: etree._Element) -> None:
    if element.get("loopMaximum") is None and not any(texts(element, "loopCondition")):
        tree.say(ENDLESS, element)


def _instances(tree: Tree, element: etree._Element) -> None:
    if has(element, "inputDataItem") and not any(texts(element, "loopDataInputRef")):
        tree.say(INPUT_ITEM, element)
    if has(element, "loopDataOutputRef") != has(element, "outputDataItem"):
        tree.say(OUTPUT_ITEM, element)
    behavior = element.get("behavior", "All").strip()
    for attribute, value in _THROWN.items():
        if element.get(attribute) and behavior != value:
            tree.say(UNUSED_EVENT, element, f"{attribute} with the behavior {behavior}")
    complexes = has(element, "complexBehaviorDefinition")
    if behavior == "Complex" and not complexes:
        tree.say(COMPLEX, element)
    elif behavior != "Complex" and complexes:
        tree.say(UNUSED_COMPLEX, element)


TOPIC = Topic(
    declared(globals()),
    {"standardLoopCharacteristics": _loop, "multiInstanceLoopCharacteristics": _instances},
)
