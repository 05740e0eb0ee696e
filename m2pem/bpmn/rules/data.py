"""Data objects and stores, references to them, and inputs and outputs (BPMN 2.0.2, 10.4.1)."""

from collections.abc import Sequence

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    SUBPROCESSES,
    Tree,
    children,
    has,
    is_true,
    name_of,
    parent,
    texts,
)

REFERENCE_OBJECT = Rule(
    10401,
    "data-reference-object",
    "10.4.1",
    W,
    "the data object reference names no data object",
    "add dataObjectRef",
)
REFERENCE_ITEM = Rule(
    10402,
    "data-reference-item",
    "10.4.1",
    W,
    "a data object reference must not have an item definition of its own",
    "move itemSubjectRef to the data object",
)
OBJECT_STATE = Rule(
    10403,
    "data-object-state",
    "10.4.1",
    W,
    "a data object must not have a state; references to it can",
    "move dataState to a data object reference",
)
COLLECTION = Rule(
    10405,
    "collection-mismatch",
    "10.4.1",
    W,
    "isCollection is not what the item definition says",
    "write the same in both",
)
CAPACITY = Rule(
    10406,
    "store-capacity",
    "10.4.1",
    W,
    "the data store's capacity is no whole number",
    "write a number, or delete it",
)
INPUT_SETS = Rule(
    10407,
    "no-input-set",
    "10.4.1",
    W,
    "the ioSpecification has no input set",
    "add an inputSet with the data inputs that are needed; it may be empty",
)
OUTPUT_SETS = Rule(
    10408,
    "no-output-set",
    "10.4.1",
    W,
    "the ioSpecification has no output set",
    "add an outputSet with the data outputs that are made; it may be empty",
)
INPUT_UNUSED = Rule(
    10409,
    "input-in-no-set",
    "10.4.1",
    W,
    "the data input is in no input set",
    "add dataInputRefs with its id to an inputSet",
)
OUTPUT_UNUSED = Rule(
    10410,
    "output-in-no-set",
    "10.4.1",
    W,
    "the data output is in no output set",
    "add dataOutputRefs with its id to an outputSet",
)
INPUT_SET = Rule(
    10411,
    "input-set-reference",
    "10.4.1",
    W,
    "the input set names no data input",
    "name a dataInput of the same ioSpecification or event",
)
OUTPUT_SET = Rule(
    10412,
    "output-set-reference",
    "10.4.1",
    W,
    "the output set names no data output",
    "name a dataOutput of the same ioSpecification or event",
)
OPTIONAL_INPUT = Rule(
    10413,
    "optional-input",
    "10.4.1",
    W,
    "an optional data input is not among the set's dataInputRefs",
    "add it to dataInputRefs, too",
)
OPTIONAL_OUTPUT = Rule(
    10414,
    "optional-output",
    "10.4.1",
    W,
    "an optional data output is not among the set's dataOutputRefs",
    "add it to dataOutputRefs, too",
)
SET_PAIR = Rule(
    10415,
    "paired-set",
    "10.4.1",
    W,
    "the set is paired with a set that does not exist",
    "name an outputSet in outputSetRefs, an inputSet in inputSetRefs",
)
SUBPROCESS_DATA = Rule(
    10416,
    "subprocess-data",
    "10.4.1",
    W,
    "a subprocess must not have data inputs and outputs of its own",
    "use data objects of the process around it",
)


def _reference(tree: Tree, element: etree._Element) -> None:
    if not element.get("dataObjectRef"):
        tree.say(REFERENCE_OBJECT, element)
    if element.get("itemSubjectRef"):
        tree.say(REFERENCE_ITEM, element)


def _object(tree: Tree, element: etree._Element) -> None:
    if has(element, "dataState"):
        tree.say(OBJECT_STATE, element)
    _collection(tree, element)


def _collection(tree: Tree, element: etree._Element) -> None:
    item = tree.find(element, element.get("itemSubjectRef", ""))
    if item is None or name_of(item) != "itemDefinition":
        return
    if is_true(element, "isCollection") != is_true(item, "isCollection"):
        tree.say(COLLECTION, element, f"see '{item.get('id')}'")


def _store(tree: Tree, element: etree._Element) -> None:
    capacity = element.get("capacity")
    if capacity is not None and not capacity.strip().lstrip("+-").isdigit():
        tree.say(CAPACITY, element, f"'{capacity}'")


def _specification(tree: Tree, element: etree._Element) -> None:
    if parent(element).tag in SUBPROCESSES:
        tree.say(SUBPROCESS_DATA, element)
    inputs, outputs = list(children(element, "inputSet")), list(children(element, "outputSet"))
    if not inputs:
        tree.say(INPUT_SETS, element)
    if not outputs:
        tree.say(OUTPUT_SETS, element)
    if inputs:
        _in_a_set(tree, element, "dataInput", inputs, INPUT_UNUSED)
    if outputs:
        _in_a_set(tree, element, "dataOutput", outputs, OUTPUT_UNUSED)


def _in_a_set(
    tree: Tree, element: etree._Element, name: str, sets: Sequence[etree._Element], rule: Rule
) -> None:
    used = {text for each in sets for text in texts(each, f"{name}Refs")}
    for data in children(element, name):
        if data.get("id") not in used:
            tree.say(rule, data, f"'{data.get('name') or data.get('id', '')}'")


def _input_set(tree: Tree, element: etree._Element) -> None:
    _references(tree, element, "dataInput", INPUT_SET)
    _optional(tree, element, "Input", OPTIONAL_INPUT)
    _pair(tree, element, "outputSet")


def _output_set(tree: Tree, element: etree._Element) -> None:
    _references(tree, element, "dataOutput", OUTPUT_SET)
    _optional(tree, element, "Output", OPTIONAL_OUTPUT)
    _pair(tree, element, "inputSet")


def _references(tree: Tree, element: etree._Element, name: str, rule: Rule) -> None:
    known = {data.get("id") for data in children(parent(element), name)}
    for text in texts(element, f"{name}Refs"):
        if text.rpartition(":")[2] not in known:
            tree.say(rule, element, f"'{text}'")


def _optional(tree: Tree, element: etree._Element, direction: str, rule: Rule) -> None:
    listed = set(texts(element, f"data{direction}Refs"))
    for name in (f"optional{direction}Refs", f"whileExecuting{direction}Refs"):
        for text in texts(element, name):
            if text not in listed:
                tree.say(rule, element, f"'{text}'")


def _pair(tree: Tree, element: etree._Element, other: str) -> None:
    known = {each.get("id") for each in children(parent(element), other)}
    for text in texts(element, f"{other}Refs"):
        if text.rpartition(":")[2] not in known:
            tree.say(SET_PAIR, element, f"'{text}'")


TOPIC = Topic(
    declared(globals()),
    {
        "dataObject": _object,
        "dataObjectReference": _reference,
        "dataStore": _store,
        "dataInput": _collection,
        "dataOutput": _collection,
        "ioSpecification": _specification,
        "inputSet": _input_set,
        "outputSet": _output_set,
    },
)
