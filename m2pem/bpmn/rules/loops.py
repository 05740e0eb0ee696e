"""Loops and multi-instance activities (BPMN 2.0.2, 10.3.8)."""

from lxml import etree

from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.tree import Checks, Tree, has, texts

error, warning = family("10.3.8")

ENDLESS_LOOP = error(
    313,
    "a loop has no wait and no end",
    "wait in each round, or draw a way out",
)
BUSY_LOOP = warning(
    314,
    "a loop has no wait; only data can end it",
    "wait in each round, or count the rounds",
)
LOOP_NOT_ALLOWED = error(
    10336,
    "an event subprocess has a loop marker",
    "delete the marker, or put it on an activity inside",
    clause="10.3.5",
)
TWO_LOOPS = error(
    10371,
    "an activity has two loop markers",
    "keep one; put the activity into a subprocess that has the other",
)
LOOP_MAXIMUM = error(
    10372,
    "loopMaximum is no whole number",
    'write for example loopMaximum="5"',
)
INSTANCE_COUNT = error(
    10374,
    "a multi-instance activity does not say how many instances there are",
    "add a loopCardinality (a number or an expression), or name a collection: "
    'm2pem:collection="fields" m2pem:elementVariable="field"',
)
INSTANCES_COUNTED_TWICE = error(
    10375,
    "a multi-instance activity has both a loopCardinality and a collection",
    "keep one",
)
INSTANCES_BEHAVIOR = error(
    10376,
    "the multi-instance behavior is none that BPMN has",
    "write None, One, All or Complex",
)
COMPLEX_BEHAVIOR = error(
    10381,
    "a complexBehaviorDefinition lacks its condition or its event",
    "give it a condition, and an event with an event definition",
)
NO_LOOP = error(
    10386,
    "a loop marker does not say which kind of loop",
    "write standardLoopCharacteristics or multiInstanceLoopCharacteristics",
)

LOOP_WITHOUT_CONDITION = warning(
    10373,
    "the loop does not say how long it goes on",
    "add a loopCondition or a loopMaximum",
)
INSTANCES_EVENT_UNUSED = warning(
    10378,
    "the multi-instance activity names an event that its behavior never throws",
    'write behavior="None" or behavior="One" as the event is meant, or delete its reference',
)
INSTANCES_COMPLEX = error(
    10379,
    "the multi-instance behavior is Complex, but nothing says what is thrown, and when",
    "add a complexBehaviorDefinition",
)
INSTANCES_COMPLEX_UNUSED = warning(
    10380,
    "complexBehaviorDefinition has no effect without the behavior Complex",
    'write behavior="Complex", or delete it',
)
INPUT_ITEM_WITHOUT_INPUT = warning(
    10382,
    "inputDataItem has no effect without loopDataInputRef",
    "add the collection, or delete the item",
)
OUTPUT_WITHOUT_ITEM = warning(
    10383,
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
