"""Values of attributes, and elements that stand once (BPMN 2.0.2, tables of 8 and 10; 15.3)."""

from lxml import etree

from m2pem.bpmn.names import a, kind
from m2pem.bpmn.rules.rule import Check, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, is_true, name_of, parent

ITEM_KIND = Rule(
    8441,
    "item-kind",
    "8.4.10",
    W,
    "the item definition's itemKind is none that BPMN has",
    "write Information or Physical",
)
PROCESS_TYPE = Rule(
    10101,
    "process-type",
    "10.1",
    W,
    "the process's type is none that BPMN has",
    "write None, Public or Private",
)
PUBLIC_EXECUTABLE = Rule(
    10102,
    "public-executable",
    "10.1",
    W,
    "a public process must not be executable",
    'write processType="Private", or isExecutable="false"',
)
TRUTH = Rule(
    15305,
    "bad-truth",
    "15.3",
    W,
    "an attribute without an effect on execution is neither true nor false",
    "write true or false",
)
REPEATED = Rule(
    15307,
    "repeated-element",
    "15.3",
    W,
    "the element stands here a second time",
    "keep one",
)
_TRUTHS = {
    "process": "isClosed isExecutable",
    "collaboration": "isClosed",
    "dataObject": "isCollection",
    "dataInput": "isCollection",
    "dataOutput": "isCollection",
    "itemDefinition": "isCollection",
    "dataStore": "isUnlimited",
    "resourceParameter": "isRequired",
    "extension": "mustUnderstand",
}
_ONCE = (
    "extensionElements ioSpecification conditionExpression script activationCondition "
    "completionCondition loopCondition loopCardinality loopDataInputRef loopDataOutputRef "
    "inputDataItem outputDataItem condition participantMultiplicity correlationKeyRef text "
    "childLaneSet messagePath dataPath dataState transformation auditing monitoring"
)


def _truth(attributes: str) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        for name in attributes.split():
            text = element.get(name, "true").strip()
            if text not in ("true", "false", "1", "0"):
                tree.say(TRUTH, element, f"{name} is '{text}'")

    return check


def _item(tree: Tree, element: etree._Element) -> None:
    value = element.get("itemKind", "Information").strip()
    if value not in ("Information", "Physical"):
        tree.say(ITEM_KIND, element, f"'{value}'")


def _process(tree: Tree, element: etree._Element) -> None:
    value = element.get("processType", "None").strip()
    if value not in ("None", "Public", "Private"):
        tree.say(PROCESS_TYPE, element, f"'{value}'")
    if value == "Public" and is_true(element, "isExecutable"):
        tree.say(PUBLIC_EXECUTABLE, element)


def _once(tree: Tree, element: etree._Element) -> None:
    if tree.has_one_before(element):
        owner = kind(parent(element).tag)
        tree.say(REPEATED, element, f"'{name_of(element)}' in {a(owner)}")


TOPIC = Topic(
    declared(globals()),
    {"itemDefinition": _item, "process": _process, **dict.fromkeys(_ONCE.split(), _once)},
)
TRUTHS = Topic((), {name: _truth(each) for name, each in _TRUTHS.items()})
