"""Data associations and process bindings: where data comes from and goes (BPMN 2.0.2, 10.4.1)."""

from lxml import etree

from m2pem.bpmn.rules.references import ITEMS
from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, has, name_of, named, names, parent, texts

TARGET = Rule(
    10421,
    "data-association-target",
    "10.4.1",
    W,
    "the data association has no targetRef",
    "name the data that it writes",
    same_as=("association-ignored",),
)
NOWHERE = Rule(
    10422,
    "data-association-end",
    "10.4.1",
    W,
    "an end of the data association names no data",
    "name a data object, store, property, data input or data output",
    same_as=("association-ignored",),
)
SOURCES = Rule(
    10423,
    "data-association-sources",
    "10.4.1",
    W,
    "a data association with several sources must have a transformation",
    "keep one sourceRef, or add a transformation",
)
PROCESS_INPUT = Rule(
    10425,
    "process-input-written",
    "10.4.1",
    W,
    "a data association must not write a data input of its process; the caller does",
    "write a data object instead",
)
PROCESS_OUTPUT = Rule(
    10426,
    "process-output-read",
    "10.4.1",
    W,
    "a data association must not read a data output of its process; the caller does",
    "read a data object instead",
)
ITEM_MISMATCH = Rule(
    10427,
    "data-association-items",
    "10.4.1",
    W,
    "a data association without a transformation must join data of one structure",
    "give both ends an item definition of the same structureRef, or add a transformation",
)
BINDING = Rule(
    10323,
    "io-binding",
    "10.3.6",
    W,
    "the ioBinding lacks an operation, an input or an output",
    "name an operation of an interface, an inputSet and an outputSet of the process",
)


def _association(tree: Tree, element: etree._Element) -> None:
    sources, targets = texts(element, "sourceRef"), texts(element, "targetRef")
    if not any(targets):
        tree.say(TARGET, element)
    for name in [*sources, *targets]:
        if name and tree.leads_nowhere(element, name, ITEMS):
            tree.say(NOWHERE, element, f"'{name}'")
    if len(sources) > 1 and not has(element, "transformation"):
        tree.say(SOURCES, element, f"this one has {len(sources)}")
    if not has(element, "transformation assignment"):
        ends = [(name, _structure(tree, element, name)) for name in (*sources[:1], *targets[:1])]
        if len(ends) == 2 and all(structure for _, structure in ends) and ends[0][1] != ends[1][1]:
            said = " and ".join(f"'{name}' is '{structure}'" for name, structure in ends)
            tree.say(ITEM_MISMATCH, element, said)
    for names_, data, rule in (
        (targets, "dataInput", PROCESS_INPUT),
        (sources, "dataOutput", PROCESS_OUTPUT),
    ):
        for name in names_:
            found = tree.find(element, name)
            if found is not None and name_of(found) == data and _of_process(found):
                tree.say(rule, element, f"'{name}'")


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
            tree.say(BINDING, element, f"{attribute} is '{name}'")


TOPIC = Topic(
    declared(globals()),
    {
        "dataInputAssociation": _association,
        "dataOutputAssociation": _association,
        "ioBinding": _binding,
    },
)
