"""Loops and multi-instance activities (BPMN 2.0.2, 10.3.8)."""

from lxml import etree

from m2pem.bpmn.rules.rule import E, Rule, W
from m2pem.bpmn.rules.tree import Checks, Tree, has, texts

ENDLESS_LOOP = Rule(
    313,
    "endless-loop",
    "missions.md",
    E,
    "a loop has no wait and no end",
    "wait in each round, or draw a way out",
)
BUSY_LOOP = Rule(
    314,
    "busy-loop",
    "missions.md",
    W,
    "a loop has no wait; only data can end it",
    "wait in each round, or count the rounds",
)
LOOP_NOT_ALLOWED = Rule(
    10336,
    "loop-not-allowed",
    "10.3.5",
    E,
    "an event subprocess has a loop marker",
    "delete it, or put it on an activity inside",
)
TWO_LOOPS = Rule(
    10371,
    "two-loops",
    "10.3.8",
    E,
    "an activity has two loop markers",
    "keep one; put the activity into a subprocess that has the other",
)
LOOP_MAXIMUM = Rule(
    10372,
    "loop-maximum",
    "10.3.8",
    E,
    "loopMaximum is no whole number",
    "write the number of rounds at most, or delete it",
)
INSTANCE_COUNT = Rule(
    10374,
    "instance-count",
    "10.3.8",
    E,
    "a multi-instance activity does not say how many instances there are",
    "add a loopCardinality or a collection",
)
INSTANCES_COUNTED_TWICE = Rule(
    10375,
    "instances-counted-twice",
    "10.3.8",
    E,
    "a multi-instance activity has both a loopCardinality and a collection",
    "keep one of the two",
)
INSTANCES_BEHAVIOR = Rule(
    10376,
    "instances-behavior",
    "10.3.8",
    E,
    "the multi-instance behavior is none that BPMN has",
    "write None, One, All or Complex",
)
COMPLEX_BEHAVIOR = Rule(
    10381,
    "complex-behavior",
    "10.3.8",
    E,
    "a complexBehaviorDefinition lacks its condition or its event",
    "say when something is thrown, and what",
)
NO_LOOP = Rule(
    10386,
    "no-loop",
    "10.3.8",
    E,
    "a loop marker does not say which kind of loop",
    "write standardLoopCharacteristics or multiInstanceLoopCharacteristics",
)

LOOP_WITHOUT_CONDITION = Rule(
    10373,
    "loop-without-condition",
    "10.3.8",
    W,
    "the loop does not say how long it goes on",
    "add a loopCondition or a loopMaximum",
)
INSTANCES_EVENT_UNUSED = Rule(
    10378,
    "instances-event-unused",
    "10.3.8",
    W,
    "the multi-instance activity names an event that its behavior never throws",
    'write behavior="None" or behavior="One" as the event is meant, or delete its reference',
)
INSTANCES_COMPLEX = Rule(
    10379,
    "instances-complex",
    "10.3.8",
    E,
    "the multi-instance behavior is Complex, but nothing says what is thrown, and when",
    "add a complexBehaviorDefinition",
)
INSTANCES_COMPLEX_UNUSED = Rule(
    10380,
    "instances-complex-unused",
    "10.3.8",
    W,
    "complexBehaviorDefinition has no effect without the behavior Complex",
    'write behavior="Complex", or delete it',
)
INPUT_ITEM_WITHOUT_INPUT = Rule(
    10382,
    "input-item-without-input",
    "10.3.8",
    W,
    "inputDataItem has no effect without loopDataInputRef",
    "add the collection, or delete the item",
)
OUTPUT_WITHOUT_ITEM = Rule(
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
        tree.report(LOOP_WITHOUT_CONDITION, element)


def _instances(tree: Tree, element: etree._Element) -> None:
    if has(element, "inputDataItem") and not any(texts(element, "loopDataInputRef")):
        tree.report(INPUT_ITEM_WITHOUT_INPUT, element)
    if has(element, "loopDataOutputRef") != has(element, "outputDataItem"):
        tree.report(OUTPUT_WITHOUT_ITEM, element)
    behavior = element.get("behavior", "All").strip()
    for attribute, value in _THROWN.items():
        if element.get(attribute) and behavior != value:
            tree.report(
                INSTANCES_EVENT_UNUSED, element, f"{attribute} with the behavior {behavior}"
            )
    complexes = has(element, "complexBehaviorDefinition")
    if behavior == "Complex" and not complexes:
        tree.report(INSTANCES_COMPLEX, element)
    elif behavior != "Complex" and complexes:
        tree.report(INSTANCES_COMPLEX_UNUSED, element)


CHECKS = Checks(
    {"standardLoopCharacteristics": _loop, "multiInstanceLoopCharacteristics": _instances},
)
