"""Call activities: what they call, and what passes in and out."""

from collections.abc import Iterator

from lxml import etree

from m2pem.bpmn.names import CAMUNDA, M2PEM, ZEEBE, local
from m2pem.bpmn.reading import (
    KEY,
    Association,
    PendingCall,
    Reading,
    association,
    reference,
)
from m2pem.bpmn.rules.activities import MAPPING_SOURCE, PASSES_EVERYTHING
from m2pem.bpmn.rules.data import ASSOCIATION_IGNORED, BAD_KEY
from m2pem.bpmn.scan import Scan
from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.behavior import Mapping, Mappings
from m2pem.mission.elements import CallActivity
from m2pem.mission.expression import Expression, parse

_USED = frozenset({"in", "out"})
_PLAIN = (M2PEM, CAMUNDA)
_ALL = 'list each value: <m2pem:in source="a.b" target="x"/>'


def read_call_activity(reading: Reading, found: Scan) -> CallActivity:
    """A call activity; `resolve_calls` adds what data associations pass."""
    inputs: list[Mapping] = []
    outputs: list[Mapping] = []
    called = found.element.get("calledElement", "")
    for element, direction in _mapping_elements(found):
        mapping = _mapping(reading, found, element)
        if mapping is not None:
            (inputs if direction == "in" else outputs).append(mapping)
    for each in found.extensions():
        if each.tag == ZEEBE + "calledElement":
            called = called or each.get("processId", "")
            _refuse_propagation(reading, found, each)
    call = CallActivity(
        found.id,
        found.element.get("name", ""),
        reading.report.line(found.element),
        reference(called) if "{" not in called and not called.startswith("=") else called,
        Mappings(tuple(inputs), tuple(outputs)),
    )
    reading.calls.append(
        PendingCall(
            call,
            found.element,
            _own_parameters(found),
            [association(each) for each in found.of("dataInputAssociation")],
            reading.note_outputs(found.of("dataOutputAssociation")),
        )
    )
    return call


def _mapping_elements(found: Scan) -> Iterator[tuple[etree._Element, str]]:
    for each in found.extensions():
        name = local(each.tag)
        if each.tag.startswith(_PLAIN) and name in _USED:
            yield each, name
        elif each.tag == ZEEBE + "ioMapping":
            for child in each:
                if child.tag == ZEEBE + "input":
                    yield child, "in"
                elif child.tag == ZEEBE + "output":
                    yield child, "out"


def _mapping(reading: Reading, found: Scan, element: etree._Element) -> Mapping | None:
    line = reading.report.line(element)
    if element.get("businessKey") is not None:
        return None  # Camunda's correlation of process instances, without a meaning here
    if element.get("variables") is not None:
        reading.report.error(
            element,
            found.id,
            PASSES_EVERYTHING,
            f"variables='{element.get('variables')}' would pass every value, which m2pem refuses: "
            "nothing passes that is not listed",
            _ALL,
        )
        return None
    source = _source(reading, found, element)
    target = (element.get("target") or "").strip()
    if not KEY.fullmatch(target):
        reading.report.error(
            element,
            found.id,
            BAD_KEY,
            f"the target '{target}' is no name of the data store"
            if target
            else "the mapping has no target",
            'write a dotted name, for example target="mission.speed"',
        )
        return None
    return None if source is None else Mapping(source, target, line)


def _source(reading: Reading, found: Scan, element: etree._Element) -> Expression | None:
    text = element.get("source") or element.get("sourceExpression") or ""
    if not text.strip():
        reading.report.error(
            element,
            found.id,
            MAPPING_SOURCE,
            "the mapping has no source",
            'write a name or an expression, for example source="mission.speed"',
        )
        return None
    if element.tag.startswith(ZEEBE):
        return reading.template(element, found.id, text)
    return reading.value(element, found.id, text)


def _refuse_propagation(reading: Reading, found: Scan, element: etree._Element) -> None:
    for name in ("propagateAllChildVariables", "propagateAllParentVariables"):
        if element.get(name) == "true":
            reading.report.error(
                element,
                found.id,
                PASSES_EVERYTHING,
                f"{name} would pass every value, which m2pem refuses: nothing passes that is not "
                "listed",
                _ALL,
            )


def _own_parameters(found: Scan) -> dict[str, str]:
    """The keys that the activity's data inputs and outputs name in the called process, by id."""
    result: dict[str, str] = {}
    for specification in found.of("ioSpecification"):
        for child in specification:
            identifier = child.get("id")
            if identifier and local(child.tag) in ("dataInput", "dataOutput"):
                result[identifier] = child.get("name") or identifier
    for own in found.of("property"):
        identifier = own.get("id")
        if identifier:
            result[identifier] = ""  # editors' placeholder for "whatever it is called"
    return result


def resolve_calls(reading: Reading) -> None:
    """Add what BPMN's data associations pass, now that all data objects are known."""
    for pending in reading.calls:
        inputs = [_associated(reading, pending, each, into=True) for each in pending.inputs]
        outputs = [_associated(reading, pending, each, into=False) for each in pending.outputs]
        if inputs or outputs:
            own = pending.call.mappings
            mappings = Mappings(
                (*own.inputs, *(each for each in inputs if each is not None)),
                (*own.outputs, *(each for each in outputs if each is not None)),
            )
            object.__setattr__(pending.call, "mappings", mappings)


def _associated(
    reading: Reading, pending: PendingCall, found: Association, *, into: bool
) -> Mapping | None:
    """The mapping of one association.

    The outer end is a data object of the caller. The inner end is a data input or output of the
    activity, or an element of the called process; where an editor left it out, or put a
    placeholder, the value keeps its name.
    """
    source = found.source_refs[0] if found.source_refs else ""
    outer_ref, inner_ref = (source, found.target_ref) if into else (found.target_ref, source)
    outer = reading.data_key(outer_ref)
    inner = pending.parameters.get(inner_ref, reading.data_key(inner_ref)) or outer
    line = reading.report.line(found.element)
    if not found.simple:
        return _not_passed(reading, pending, found, "it has an assignment or a transformation")
    if not outer:
        return _not_passed(reading, pending, found, f"'{outer_ref}' is no data object here")
    from_key, to_key = (outer, inner) if into else (inner, outer)
    for key in (from_key, to_key):
        if not KEY.fullmatch(key):
            return _not_passed(reading, pending, found, f"'{key}' is no dotted name")
    try:
        return Mapping(parse(from_key, "m2pem"), to_key, line)
    except ExpressionSyntaxError as error:
        return _not_passed(reading, pending, found, str(error))


def _not_passed(
    reading: Reading, pending: PendingCall, found: Association, because: str
) -> Mapping | None:
    reading.report.warning(
        found.element,
        pending.call.id,
        ASSOCIATION_IGNORED,
        f"the data association passes nothing: {because}",
        'use <m2pem:in source="a.b" target="x"/> or <m2pem:out .../>',
    )
    return None
