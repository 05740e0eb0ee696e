"""Loops and multi-instance activities (BPMN 2.0.2, 10.3.8)."""

from lxml import etree

from m2pem.model.bpmn.names import BPMN
from m2pem.model.bpmn.rules.references import ITEMS
from m2pem.model.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.model.bpmn.rules.tree import Tree, has, names, texts

TWO_LOOPS = Rule(
    10371,
    "two-loops",
    "10.3.8",
    E,
    "the activity has two loop markers",
    "keep one; put the activity into a subprocess that has the other",
)
MAXIMUM = Rule(
    10372,
    "loop-maximum",
    "10.3.8",
    W,
    "loopMaximum must be a whole number from 1",
    "write the number of rounds at most, or delete it",
    same_as=("bad-value",),
)
ENDLESS = Rule(
    10373,
    "loop-without-condition",
    "10.3.8",
    W,
    "the loop does not say how long it goes on",
    "add a loopCondition or a loopMaximum",
)
COUNT = Rule(
    10374,
    "instances-without-number",
    "10.3.8",
    W,
    "the multi-instance activity does not say how many instances there are",
    "add a loopCardinality or a loopDataInputRef",
)
TWO_COUNTS = Rule(
    10375,
    "instances-counted-twice",
    "10.3.8",
    W,
    "the multi-instance activity has both a loopCardinality and a loopDataInputRef",
    "keep one of the two",
)
BEHAVIOR = Rule(
    10376,
    "instances-behavior",
    "10.3.8",
    E,
    "the multi-instance behavior is none that BPMN has",
    "write None, One, All or Complex",
    same_as=("bad-value",),
)
EVENT = Rule(
    10377,
    "instances-event",
    "10.3.8",
    E,
    "what the multi-instance activity throws is no event definition",
    "name an event definition that stands in definitions",
    same_as=("dangling-reference",),
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
COMPLEX_CONDITION = Rule(
    10381,
    "instances-complex-condition",
    "10.3.8",
    E,
    "the complexBehaviorDefinition does not say when its event is thrown",
    "add a condition",
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
INPUT = Rule(
    10384,
    "loop-input",
    "10.3.8",
    W,
    "loopDataInputRef names no data",
    "name a data input of the task, or a data object",
    same_as=("dangling-reference",),
)
OUTPUT = Rule(
    10385,
    "loop-output",
    "10.3.8",
    W,
    "loopDataOutputRef names no data",
    "name a data output of the task, or a data object",
    same_as=("dangling-reference",),
)
_DEFINITIONS = names(
    "cancelEventDefinition compensateEventDefinition conditionalEventDefinition "
    "errorEventDefinition escalationEventDefinition linkEventDefinition messageEventDefinition "
    "signalEventDefinition terminateEventDefinition timerEventDefinition"
)
_THROWN = {"noneBehaviorEventRef": "None", "oneBehaviorEventRef": "One"}


def _either(tree: Tree, element: etree._Element) -> None:
    before = element.itersiblings(
        BPMN + "standardLoopCharacteristics",
        BPMN + "multiInstanceLoopCharacteristics",
        preceding=True,
    )
    if next(before, None) is not None:
        tree.say(TWO_LOOPS, element)


def _loop(tree: Tree, element: etree._Element) -> None:
    _either(tree, element)
    maximum = element.get("loopMaximum")
    if maximum is None:
        if not any(texts(element, "loopCondition")):
            tree.say(ENDLESS, element)
        return
    text = maximum.strip()
    expression = "{" in text or text.startswith("=")
    if not expression and not (text.isascii() and text.isdigit() and int(text) > 0):
        tree.say(MAXIMUM, element, f"'{text}' is none")


def _instances(tree: Tree, element: etree._Element) -> None:
    _either(tree, element)
    cardinality = any(texts(element, "loopCardinality"))
    inputs = any(texts(element, "loopDataInputRef"))
    if cardinality and inputs:
        tree.say(TWO_COUNTS, element)
    elif not cardinality and not inputs and not _counted_by_extension(element):
        tree.say(COUNT, element)
    if has(element, "inputDataItem") and not inputs:
        tree.say(INPUT_ITEM, element)
    if has(element, "loopDataOutputRef") != has(element, "outputDataItem"):
        tree.say(OUTPUT_ITEM, element)
    for name, rule in (("loopDataInputRef", INPUT), ("loopDataOutputRef", OUTPUT)):
        for text in texts(element, name):
            if text and tree.leads_nowhere(element, text, ITEMS):
                tree.say(rule, element, f"'{text}'")
    _behavior(tree, element)


def _behavior(tree: Tree, element: etree._Element) -> None:
    behavior = element.get("behavior", "All").strip()
    if behavior not in ("None", "One", "All", "Complex"):
        tree.say(BEHAVIOR, element, f"'{behavior}'")
        return
    for attribute, value in _THROWN.items():
        name = element.get(attribute)
        if not name:
            continue
        if behavior != value:
            tree.say(UNUSED_EVENT, element, f"{attribute} with the behavior {behavior}")
        elif tree.leads_nowhere(element, name, _DEFINITIONS):
            tree.say(EVENT, element, f"'{name}'")
    complexes = has(element, "complexBehaviorDefinition")
    if behavior == "Complex" and not complexes:
        tree.say(COMPLEX, element)
    elif behavior != "Complex" and complexes:
        tree.say(UNUSED_COMPLEX, element)


def _counted_by_extension(element: etree._Element) -> bool:
    """Whether engines' own attributes or extension elements name a collection or a number."""
    if any(key.startswith("{") for key in map(str, element.keys())):
        return True
    return any(
        "{" in child.tag and not child.tag.startswith(BPMN)
        for extensions in element.iterchildren(BPMN + "extensionElements")
        for child in extensions
    )


def _complex(tree: Tree, element: etree._Element) -> None:
    if not any(texts(element, "condition")):
        tree.say(COMPLEX_CONDITION, element)


TOPIC = Topic(
    declared(globals()),
    {
        "standardLoopCharacteristics": _loop,
        "multiInstanceLoopCharacteristics": _instances,
        "complexBehaviorDefinition": _complex,
    },
)
