"""Loops and multi-instance activities (BPMN 2.0.2, 10.3.8)."""

from lxml import etree

from m2pem.bpmn.rules.rule import error, warning
from m2pem.bpmn.rules.tree import Checks, Tree, has, texts

ENDLESS_LOOP = error(
    313,
    "endless-loop",
    "a loop has no wait and no end",
    "wait in each round, or draw a way out",
)
BUSY_LOOP = warning(
    314,
    "busy-loop",
    "a loop has no wait; only data can end it",
    "wait in each round, or count the rounds",
)
LOOP_NOT_ALLOWED = error(
    10336,
    "loop-not-allowed",
    "an event subprocess has a loop marker",
    "delete the marker, or put it on an activity inside",
    "10.3.5",
)
TWO_LOOPS = error(
    10371,
    "two-loops",
    "an activity has two loop markers",
    "keep one; put the activity into a subprocess that has the other",
    "10.3.8",
)
LOOP_MAXIMUM = error(
    10372,
    "loop-maximum",
    "loopMaximum is no whole number",
    'write for example loopMaximum="5"',
    "10.3.8",
)
INSTANCE_COUNT = error(
    10374,
    "instance-count",
    "a multi-instance activity does not say how many instances there are",
    "add a loopCardinality (a number or an expression), or name a collection: "
    'm2pem:collection="fields" m2pem:elementVariable="field"',
    "10.3.8",
)
INSTANCES_COUNTED_TWICE = error(
    10375,
    "instances-counted-twice",
    "a multi-instance activity has both a loopCardinality and a collection",
    "keep one",
    "10.3.8",
)
INSTANCES_BEHAVIOR = error(
    10376,
    "instances-behavior",
    "the multi-instance behavior is none that BPMN has",
    "write None, One, All or Complex",
    "10.3.8",
)
COMPLEX_BEHAVIOR = error(
    10381,
    "complex-behavior",
    "a complexBehaviorDefinition lacks its condition or its event",
    "give it a condition, and an event with an event definition",
    "10.3.8",
)
NO_LOOP = error(
    10386,
    "no-loop",
    "a loop marker does not say which kind of loop",
    "write standardLoopCharacteristics or multiInstanceLoopCharacteristics",
    "10.3.8",
)

LOOP_WITHOUT_CONDITION = warning(
    10373,
    "loop-without-condition",
    "the loop does not say how long it goes on",
    "add a loopCondition or a loopMaximum",
    "10.3.8",
)
INSTANCES_EVENT_UNUSED = warning(
    10378,
    "instances-event-unused",
    "the multi-instance activity names an event that its behavior never throws",
    'write behavior="None" or behavior="One" as the event is meant, or delete its reference',
    "10.3.8",
)
INSTANCES_COMPLEX = error(
    10379,
    "instances-complex",
    "the multi-instance behavior is Complex, but nothing says what is thrown, and when",
    "add a complexBehaviorDefinition",
    "10.3.8",
)
INSTANCES_COMPLEX_UNUSED = warning(
    10380,
    "instances-complex-unused",
    "complexBehaviorDefinition has no effect without the behavior Complex",
    'write behavior="Complex", or delete it',
    "10.3.8",
)
INPUT_ITEM_WITHOUT_INPUT = warning(
    10382,
    "input-item-without-input",
    "inputDataItem has no effect without loopDataInputRef",
    "add the collection, or delete the item",
    "10.3.8",
)
OUTPUT_WITHOUT_ITEM = warning(
    10383,
    "output-without-item",
    "one of loopDataOutputRef and outputDataItem is missing",
    "add it, or delete the other",
    "10.3.8",
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
