"""Data objects, stores, properties and associations (BPMN 2.0.2, clauses 10.4.1 and 10.4.2)."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from lxml import etree

from m2pem.bpmn.children import Children, read_children
from m2pem.bpmn.context import (
    KEY,
    Association,
    DataEnd,
    PendingDataFlow,
    ReadingContext,
    association,
    reference,
    text_of,
)
from m2pem.bpmn.foreign_data import read_foreign_mappings
from m2pem.bpmn.rules.data import BAD_ASSIGNMENT, EMPTY_ASSIGNMENT
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.xml import BPMN, local
from m2pem.mission.behavior import Mapping, Mappings
from m2pem.mission.elements import Activity, Container, DataObject, Event
from m2pem.mission.expression import parse
from m2pem.suggestions import suggest_or


def read_data(context: ReadingContext, element: etree._Element, container: Container) -> None:
    """A dataObject, dataObjectReference, dataStoreReference or property of a container."""
    identifier = context.optional_id(element)
    read_children(context, element, identifier)
    what = local(element.tag)
    if what in ("dataObject", "property"):
        declared = DataObject(*context.head(element, identifier), _kind(element))
        if declared.key:
            context.declared.append((container, declared))
        if identifier:
            context.data.setdefault(identifier, DataEnd(declared.key, [element], declared))
    elif identifier:
        if what == "dataStoreReference":
            context.data_stores.add(identifier)
        target = element.get("dataObjectRef") or element.get("dataStoreRef") or ""
        key = element.get("name") or identifier
        context.data.setdefault(identifier, DataEnd(key, [element], refers_to=reference(target)))


_KINDS = {
    **dict.fromkeys(("string", "anyuri", "date", "time", "datetime", "duration"), "text"),
    **dict.fromkeys(("integer", "int", "long", "short", "byte", "float"), "number"),
    **dict.fromkeys(("double", "decimal", "nonnegativeinteger", "positiveinteger"), "number"),
    "boolean": "boolean",
}
"""Of types of XML Schema, which is BPMN's own type language (8.1.3), and of Java's."""


def _kind(element: etree._Element) -> str:
    """The kind of what a data object holds, by the structure of its item definition."""
    if element.get("isCollection") == "true":
        return "list"
    item = reference(element.get("itemSubjectRef", ""))
    root = element.getroottree().getroot()
    found = (each for each in root.iterchildren(f"{BPMN}itemDefinition") if each.get("id") == item)
    definition = next(found, None) if item else None
    if definition is None or definition.get("isCollection") == "true":
        return "" if definition is None else "list"
    structure = definition.get("structureRef", "").replace(".", ":").rpartition(":")[2]
    return _KINDS.get(structure.lower(), "")


def resolve_data(context: ReadingContext) -> None:
    """Name data objects after their references, and note which ones associations write.

    Editors draw and name the *reference*; the data object itself has only an id.
    """
    for identifier, end in context.data.items():
        target = context.data.get(end.refers_to)
        if target is None and end.refers_to:
            context.findings.warning(
                end.carriers[0],
                identifier,
                DANGLING_REFERENCE,
                f"it refers to '{end.refers_to}', which is no data object or data store",
                suggest_or(end.refers_to, context.data, "correct it, or delete it"),
            )
        if target is None or target.declared is None:
            continue
        declared = target.declared
        if not declared.name and end.carriers[0].get("name"):
            object.__setattr__(declared, "name", end.key)
    for written in context.written:
        key = context.data_key(written.target_ref)
        if key:
            context.written_keys.add(key)


_PARAMETERS = frozenset({"dataInput", "dataOutput", "property"})
_TAGS = frozenset(
    BPMN + name
    for name in (*_PARAMETERS, "ioSpecification", "dataInputAssociation", "dataOutputAssociation")
)
_PLACEHOLDER = "__targetRef_placeholder"
"""The property that Camunda's editor draws data associations to; it is none of the author's."""


def read_data_flow(context: ReadingContext, found: Children, node: Activity | Event) -> None:
    """Keep its data associations until all data objects are known."""
    foreign = read_foreign_mappings(context, found, node)
    if foreign is None and _TAGS.isdisjoint(found.children):
        return
    outputs = context.note_outputs(found.of("dataOutputAssociation"))
    parameters = _parameters(found)
    if foreign is None and not parameters:
        return
    if isinstance(node, Activity):
        object.__setattr__(node, "own_data", node.own_data | frozenset(parameters.values()))
    inputs = [association(each) for each in found.of("dataInputAssociation")]
    context.data_flows.append(PendingDataFlow(node, parameters, inputs, outputs, foreign))


def _parameters(found: Children) -> dict[str, str]:
    """Keys of its data inputs, data outputs and properties, by id."""
    elements: list[etree._Element] = []
    for specification in found.of("ioSpecification"):
        elements += specification
    for name in _PARAMETERS:
        elements += found.of(name)
    result: dict[str, str] = {}
    for element in elements:
        identifier = element.get("id")
        name = element.get("name") or identifier or ""
        if identifier and local(element.tag) in _PARAMETERS and name != _PLACEHOLDER:
            result[identifier] = name
    return result


def resolve_data_flows(context: ReadingContext) -> None:
    """Work out what each data association passes."""
    for pending in context.data_flows:
        outer, inner = context.data_key, pending.own_key
        inputs = [
            m for each in pending.inputs for m in _mappings(context, pending, each, outer, inner)
        ]
        outputs = [
            m for each in pending.outputs for m in _mappings(context, pending, each, inner, outer)
        ]
        own = pending.foreign or Mappings()
        if inputs or outputs or pending.foreign:
            mappings = replace(own, inputs=(*own.inputs, *inputs), outputs=(*own.outputs, *outputs))
            object.__setattr__(pending.node, "data_flow", mappings)


def _mappings(
    context: ReadingContext,
    pending: PendingDataFlow,
    found: Association,
    source_key: Callable[[str], str],
    target_key: Callable[[str], str],
) -> Iterator[Mapping]:
    """An association copies its source, or what its transformation or assignments say.

    An end that an editor left out, or drew to a placeholder, passes nothing: the activity sees the
    data around it anyway. Nor does one whose name no expression can read ("Route prompt").
    """
    line = context.findings.line(found.element)
    source = source_key(found.source_refs[0]) if found.source_refs else ""
    target = target_key(found.target_ref)
    assigned = False
    for child in found.element:
        name = local(child.tag)
        if name == "transformation" and target:
            assigned = True
            expression = context.expression_in(child, pending.node.id)
            if expression is not None:
                yield Mapping(expression, target, line)
        elif name == "assignment":
            assigned = True
            yield from _assignment(context, pending, child, target)
    if not assigned and KEY.fullmatch(source) and KEY.fullmatch(target):
        yield Mapping(parse(source, "m2pem"), target, line)


def _assignment(
    context: ReadingContext, pending: PendingDataFlow, element: etree._Element, target: str
) -> Iterator[Mapping]:
    ends = {local(child.tag): child for child in element}
    written = text_of(ends["to"]).strip("#${} ") if "to" in ends else ""
    head, dot, rest = written.partition(".")
    key = pending.parameters.get(head) or context.data_key(head) or head
    key = f"{key}{dot}{rest}" or target
    if "from" in ends and not text_of(ends["from"]):
        context.findings.warning(
            ends["from"],
            pending.node.id,
            EMPTY_ASSIGNMENT,
            f"the assignment of '{written}' has an empty 'from'; it assigns nothing",
        )
        return
    if "from" not in ends or not KEY.fullmatch(key):
        context.findings.error(
            element,
            pending.node.id,
            BAD_ASSIGNMENT,
            f"the assignment's 'to', '{written}', is no name of the data"
            if "from" in ends and written
            else "the assignment does not say what to write, or where",
        )
        return
    source = ends["from"]
    expression = context.value(source, pending.node.id, text_of(source), source.get("language"))
    if expression is not None:
        yield Mapping(expression, key, context.findings.line(element))
