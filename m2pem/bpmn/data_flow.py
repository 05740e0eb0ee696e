"""What passes between the data around an activity or event and its own (BPMN 2.0.2, 10.4.2)."""

from collections.abc import Iterator

from lxml import etree

from m2pem.bpmn.names import BPMN, local
from m2pem.bpmn.reading import (
    KEY,
    Association,
    PendingDataFlow,
    Reading,
    association,
    text_of,
)
from m2pem.bpmn.rules.data import BAD_ASSIGNMENT, EMPTY_ASSIGNMENT
from m2pem.bpmn.scan import Scan
from m2pem.mission.behavior import Mapping, Mappings
from m2pem.mission.elements import Activity, Event
from m2pem.mission.expression import parse

_PARAMETERS = frozenset({"dataInput", "dataOutput", "property"})
_TAGS = frozenset(
    BPMN + name
    for name in (*_PARAMETERS, "ioSpecification", "dataInputAssociation", "dataOutputAssociation")
)
_PLACEHOLDER = "__targetRef_placeholder"
"""The property that Camunda's editor draws data associations to; it is none of the author's."""


def read_data_flow(reading: Reading, found: Scan, node: Activity | Event) -> None:
    """Keep its data associations until all data objects are known."""
    if _TAGS.isdisjoint(found.children):
        return
    outputs = reading.note_outputs(found.of("dataOutputAssociation"))
    parameters = _parameters(found)
    if not parameters:
        return
    if isinstance(node, Activity):
        object.__setattr__(node, "own_data", frozenset(parameters.values()))
    inputs = [association(each) for each in found.of("dataInputAssociation")]
    reading.data_flows.append(PendingDataFlow(node, parameters, inputs, outputs))


def _parameters(found: Scan) -> dict[str, str]:
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


def resolve_data_flows(reading: Reading) -> None:
    """Work out what each data association passes."""
    for pending in reading.data_flows:
        inputs = [mapping for each in pending.inputs for mapping in _into(reading, pending, each)]
        outputs = [
            mapping for each in pending.outputs for mapping in _out_of(reading, pending, each)
        ]
        if inputs or outputs:
            mappings = Mappings(tuple(inputs), tuple(outputs))
            object.__setattr__(pending.node, "data_flow", mappings)


def _into(reading: Reading, pending: PendingDataFlow, found: Association) -> Iterator[Mapping]:
    own = pending.parameters.get(found.target_ref, "")
    outer = [reading.data_key(ref) for ref in found.source_refs]
    yield from _mappings(reading, pending, found, outer, own)


def _out_of(reading: Reading, pending: PendingDataFlow, found: Association) -> Iterator[Mapping]:
    own = [pending.parameters.get(ref, "") for ref in found.source_refs]
    outer = reading.data_key(found.target_ref)
    yield from _mappings(reading, pending, found, own, outer)


def _mappings(
    reading: Reading, pending: PendingDataFlow, found: Association, sources: list[str], target: str
) -> Iterator[Mapping]:
    """An association copies its source, or what its transformation or assignments say.

    An end that an editor left out, or drew to a placeholder, passes nothing: the activity sees the
    data around it anyway. Nor does one whose name no expression can read ("Route prompt").
    """
    line = reading.report.line(found.element)
    identifier = pending.node.id
    assigned = False
    for child in found.element:
        name = local(child.tag)
        if name == "transformation" and target:
            assigned = True
            text, language = text_of(child), child.get("language")
            expression = reading.expression(child, identifier, text, language)
            if expression is not None:
                yield Mapping(expression, target, line)
        elif name == "assignment":
            assigned = True
            yield from _assignment(reading, pending, child, target)
    if assigned or not target or not sources or not sources[0]:
        return
    if KEY.fullmatch(sources[0]) and KEY.fullmatch(target):
        yield Mapping(parse(sources[0], "m2pem"), target, line)


def _assignment(
    reading: Reading, pending: PendingDataFlow, element: etree._Element, target: str
) -> Iterator[Mapping]:
    ends = {local(child.tag): child for child in element}
    written = text_of(ends["to"]).strip("#${} ") if "to" in ends else ""
    head, dot, rest = written.partition(".")
    key = pending.parameters.get(head) or reading.data_key(head) or head
    key = f"{key}{dot}{rest}" or target
    if "from" in ends and not text_of(ends["from"]):
        reading.report.warning(
            ends["from"],
            pending.node.id,
            EMPTY_ASSIGNMENT,
            f"the assignment of '{written}' has an empty 'from'; it assigns nothing",
            "write what it assigns, or delete it",
        )
        return
    if "from" not in ends or not KEY.fullmatch(key):
        reading.report.error(
            element,
            pending.node.id,
            BAD_ASSIGNMENT,
            f"the assignment's 'to', '{written}', is no name of the data"
            if "from" in ends and written
            else "the assignment does not say what to write, or where",
            "write <assignment><from>expression</from><to>name</to></assignment>",
        )
        return
    source = ends["from"]
    expression = reading.value(source, pending.node.id, text_of(source), source.get("language"))
    if expression is not None:
        yield Mapping(expression, key, reading.report.line(element))
