"""Data objects, stores, inputs, outputs and associations between them (BPMN 2.0.2, 10.4.1)."""

from collections.abc import Sequence

from lxml import etree

from m2pem.bpmn.rules.references import ITEMS
from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import (
    SUBPROCESSES,
    Check,
    Checks,
    Tree,
    children,
    has,
    is_true,
    name_of,
    named,
    names,
    parent,
    texts,
)

error, warning = family("10.4.1")

BAD_KEY = error(
    214,
    "a name is none of the data store",
    "write a dotted name",
)
ASSOCIATION_IGNORED = warning(
    306,
    "a data association of a call activity passes nothing",
    'use <m2pem:in source="a.b" target="x"/> or <m2pem:out .../>',
)
UNWRITTEN_NAME = warning(
    307,
    "a name is read that nothing writes",
    "write it before, or pass it in",
)
MIXED_KINDS = warning(
    319,
    "an expression compares or computes kinds that do not go together",
    "write number(x) or text(x)",
)
OTHER_VALUE = warning(
    320,
    "an expression has another value than in earlier versions, as its language says",
    "write number(x) or text(x)",
)
EMPTY_ASSIGNMENT = warning(
    311,
    "an assignment's 'from' is empty",
    "write what it assigns, or delete it",
)
BAD_ASSIGNMENT = error(
    10424,
    "an assignment of a data association lacks from or to",
    "write <assignment><from>expression</from><to>name</to></assignment>",
)

DATA_REFERENCE_OBJECT = warning(
    10401,
    "the data object reference names no data object",
    "add dataObjectRef",
)
DATA_REFERENCE_ITEM = warning(
    10402,
    "a data object reference must not have an item definition of its own",
    "move itemSubjectRef to the data object",
)
DATA_OBJECT_STATE = warning(
    10403,
    "a data object must not have a state; references to it can",
    "move dataState to a data object reference",
)
COLLECTION_MISMATCH = warning(
    10405,
    "isCollection is not what the item definition says",
    "write the same in both",
)
STORE_CAPACITY = warning(
    10406,
    "the data store's capacity is no whole number",
    "write a number, or delete it",
)
NO_INPUT_SET = warning(
    10407,
    "the ioSpecification has no input set",
    "add an inputSet with the data inputs that are needed; it may be empty",
)
NO_OUTPUT_SET = warning(
    10408,
    "the ioSpecification has no output set",
    "add an outputSet with the data outputs that are made; it may be empty",
)
INPUT_IN_NO_SET = warning(
    10409,
    "the data input is in no input set",
    "add dataInputRefs with its id to an inputSet",
)
OUTPUT_IN_NO_SET = warning(
    10410,
    "the data output is in no output set",
    "add dataOutputRefs with its id to an outputSet",
)
INPUT_SET_REFERENCE = warning(
    10411,
    "the input set names no data input",
    "name a dataInput of the same ioSpecification or event",
)
OUTPUT_SET_REFERENCE = warning(
    10412,
    "the output set names no data output",
    "name a dataOutput of the same ioSpecification or event",
)
OPTIONAL_INPUT = warning(
    10413,
    "an optional data input is not among the set's dataInputRefs",
    "add it to dataInputRefs, too",
)
OPTIONAL_OUTPUT = warning(
    10414,
    "an optional data output is not among the set's dataOutputRefs",
    "add it to dataOutputRefs, too",
)
PAIRED_SET = warning(
    10415,
    "the set is paired with a set that does not exist",
    "name an outputSet in outputSetRefs, an inputSet in inputSetRefs",
)
SUBPROCESS_DATA = warning(
    10416,
    "a subprocess must not have data inputs and outputs of its own",
    "use data objects of the process around it",
)


def _reference(tree: Tree, element: etree._Element) -> None:
    if not element.get("dataObjectRef"):
        tree.report(DATA_REFERENCE_OBJECT, element)
    if element.get("itemSubjectRef"):
        tree.report(DATA_REFERENCE_ITEM, element)


def _object(tree: Tree, element: etree._Element) -> None:
    if has(element, "dataState"):
        tree.report(DATA_OBJECT_STATE, element)
    _collection(tree, element)


def _collection(tree: Tree, element: etree._Element) -> None:
    item = tree.find(element, element.get("itemSubjectRef", ""))
    if item is None or name_of(item) != "itemDefinition":
        return
    if is_true(element, "isCollection") != is_true(item, "isCollection"):
        tree.report(COLLECTION_MISMATCH, element, f"see '{item.get('id')}'")


def _store(tree: Tree, element: etree._Element) -> None:
    capacity = element.get("capacity")
    if capacity is not None and not capacity.strip().lstrip("+-").isdigit():
        tree.report(STORE_CAPACITY, element, f"'{capacity}'")


def _specification(tree: Tree, element: etree._Element) -> None:
    if parent(element).tag in SUBPROCESSES:
        tree.report(SUBPROCESS_DATA, element)
    inputs, outputs = list(children(element, "inputSet")), list(children(element, "outputSet"))
    if not inputs:
        tree.report(NO_INPUT_SET, element)
    if not outputs:
        tree.report(NO_OUTPUT_SET, element)
    if inputs:
        _in_a_set(tree, element, "dataInput", inputs, INPUT_IN_NO_SET)
    if outputs:
        _in_a_set(tree, element, "dataOutput", outputs, OUTPUT_IN_NO_SET)


def _in_a_set(
    tree: Tree, element: etree._Element, name: str, sets: Sequence[etree._Element], rule: Rule
) -> None:
    used = {named(text) for each in sets for text in texts(each, f"{name}Refs")}
    for data in children(element, name):
        if data.get("id") not in used:
            tree.report(rule, data, f"'{data.get('name') or data.get('id', '')}'")


def _set(direction: str, other: str, unknown: Rule, optional: Rule) -> Check:
    data = f"data{direction}"

    def check(tree: Tree, element: etree._Element) -> None:
        _only(tree, element, f"{data}Refs", _ids(element, data), unknown)
        listed = {named(text) for text in texts(element, f"{data}Refs")}
        for name in (f"optional{direction}Refs", f"whileExecuting{direction}Refs"):
            _only(tree, element, name, listed, optional)
        _only(tree, element, f"{other}Refs", _ids(element, other), PAIRED_SET)

    return check


def _ids(element: etree._Element, name: str) -> set[str]:
    return {each.get("id", "") for each in children(parent(element), name)}


def _only(tree: Tree, element: etree._Element, name: str, known: set[str], rule: Rule) -> None:
    for text in texts(element, name):
        if named(text) not in known:
            tree.report(rule, element, f"'{text}'")


CHECKS = Checks(
    {
        "dataObject": _object,
        "dataObjectReference": _reference,
        "dataStore": _store,
        "dataInput": _collection,
        "dataOutput": _collection,
        "ioSpecification": _specification,
        "inputSet": _set("Input", "outputSet", INPUT_SET_REFERENCE, OPTIONAL_INPUT),
        "outputSet": _set("Output", "inputSet", OUTPUT_SET_REFERENCE, OPTIONAL_OUTPUT),
    },
)


DATA_ASSOCIATION_TARGET = warning(
    10421,
    "the data association has no targetRef",
    "name the data that it writes",
)
DATA_ASSOCIATION_END = warning(
    10422,
    "an end of the data association names no data",
    "name a data object, store, property, data input or data output",
)
DATA_ASSOCIATION_SOURCES = warning(
    10423,
    "a data association with several sources must have a transformation",
    "keep one sourceRef, or add a transformation",
)
PROCESS_INPUT_WRITTEN = warning(
    10425,
    "a data association must not write a data input of its process; the caller does",
    "write a data object instead",
)
PROCESS_OUTPUT_READ = warning(
    10426,
    "a data association must not read a data output of its process; the caller does",
    "read a data object instead",
)
DATA_ASSOCIATION_ITEMS = warning(
    10427,
    "a data association without a transformation must join data of one structure",
    "give both ends an item definition of the same structureRef, or add a transformation",
)
IO_BINDING = warning(
    10323,
    "the ioBinding lacks an operation, an input or an output",
    "name an operation of an interface, an inputSet and an outputSet of the process",
    clause="10.3.6",
)


def _association(tree: Tree, element: etree._Element) -> None:
    sources, targets = texts(element, "sourceRef"), texts(element, "targetRef")
    unless = (ASSOCIATION_IGNORED,)
    if not any(targets):
        tree.report(DATA_ASSOCIATION_TARGET, element, unless=unless)
    for name in [*sources, *targets]:
        if name and tree.leads_nowhere(element, name, ITEMS):
            tree.report(DATA_ASSOCIATION_END, element, f"'{name}'", unless=unless)
    if len(sources) > 1 and not has(element, "transformation"):
        tree.report(DATA_ASSOCIATION_SOURCES, element, f"this one has {len(sources)}")
    if not has(element, "transformation assignment"):
        ends = [(name, _structure(tree, element, name)) for name in (*sources[:1], *targets[:1])]
        if len(ends) == 2 and all(structure for _, structure in ends) and ends[0][1] != ends[1][1]:
            said = " and ".join(f"'{name}' is '{structure}'" for name, structure in ends)
            tree.report(DATA_ASSOCIATION_ITEMS, element, said)
    for names_, data, rule in (
        (targets, "dataInput", PROCESS_INPUT_WRITTEN),
        (sources, "dataOutput", PROCESS_OUTPUT_READ),
    ):
        for name in names_:
            found = tree.find(element, name)
            if found is not None and name_of(found) == data and _of_process(found):
                tree.report(rule, element, f"'{name}'")


def _structure(tree: Tree, owner: etree._Element, name: str) -> str:
    """Return the structure of data, also of what a reference refers to; "" if it has none.

    Many editors write an item definition for each element, so their ids are not compared.
    """
    data = tree.find(owner, name)
    for reference in ("dataObjectRef", "dataStoreRef"):
        if data is not None and data.get(reference):
            data = tree.find(data, data.get(reference, ""))
    item = None if data is None else tree.find(data, data.get("itemSubjectRef", ""))
    return "" if item is None else named(item.get("structureRef", ""))


def _of_process(data: etree._Element) -> bool:
    specification = parent(data)
    return (
        name_of(specification) == "ioSpecification" and name_of(parent(specification)) == "process"
    )


def _binding(tree: Tree, element: etree._Element) -> None:
    for attribute, tag in (
        ("operationRef", "operation"),
        ("inputDataRef", "inputSet"),
        ("outputDataRef", "outputSet"),
    ):
        name = element.get(attribute, "")
        if tree.leads_nowhere(element, name, names(tag)):
            tree.report(IO_BINDING, element, f"{attribute} is '{name}'")


ASSOCIATIONS = Checks(
    {
        "dataInputAssociation": _association,
        "dataOutputAssociation": _association,
        "ioBinding": _binding,
    },
)
