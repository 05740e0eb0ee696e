"""Activities: what all share, call activities and global tasks (BPMN 2.0.2, clause 10.3).

A called global task runs as a process with just that task, which keeps the id: so records and
answers name what was drawn. What is passed in lies in the data of that process; data inputs and
outputs of the task itself would only hide it.
"""

from collections.abc import Callable, Iterator

from lxml import etree

from m2pem.bpmn.children import Children, read_children
from m2pem.bpmn.context import KEY, Association, PendingCall, ReadingContext, association, reference
from m2pem.bpmn.foreign_elements import ENGINES, PROPAGATES
from m2pem.bpmn.rules.activities import (
    COMPLETION_QUANTITY,
    MAPPING_SOURCE,
    PASSES_EVERYTHING,
    START_QUANTITY,
)
from m2pem.bpmn.rules.data import ASSOCIATION_IGNORED, BAD_KEY
from m2pem.bpmn.rules.extensions import FOREIGN_EFFECT
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.tasks import (
    read_business_rule_task,
    read_manual_task,
    read_plain_task,
    read_receive_task,
    read_script_task,
    read_send_task,
    read_service_task,
    read_user_task,
)
from m2pem.bpmn.xml import BPMN, M2PEM, ZEEBE, attribute_names, local
from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.behavior import Mapping, Mappings
from m2pem.mission.elements import Activity, CallActivity, FlowNode, Process, SubProcess
from m2pem.mission.expression import Expression, parse

MAX_QUANTITY = 1000
"""Of tokens that begin an activity, or leave it by one flow."""

_QUANTITIES = {
    "start_quantity": ("startQuantity", START_QUANTITY),
    "completion_quantity": ("completionQuantity", COMPLETION_QUANTITY),
}

_ATTRIBUTES = frozenset(
    {"default", "isForCompensation", *(attribute for attribute, _ in _QUANTITIES.values())}
)

_USED = frozenset({"in", "out"})
_PLAIN = (M2PEM, *ENGINES)
_ALL = 'list each value: <m2pem:in source="a.b" target="x"/>'


def read_activity_attributes(
    context: ReadingContext, element: etree._Element, node: Activity
) -> None:
    """Read the default flow, quantities of tokens and the mark "for compensation"."""
    if _ATTRIBUTES.isdisjoint(attribute_names(element)):
        return
    _note_default(context, element, node)
    if context.boolean(element, "isForCompensation", False, node.id):
        context.compensation_handlers.add(node)
    for attribute, (name, rule) in _QUANTITIES.items():
        text = element.get(name)
        if text is not None:
            quantity = _quantity(context, element, name, text.strip(), rule)
            object.__setattr__(node, attribute, quantity)
    if isinstance(node, SubProcess) and node.triggered_by_event and node.start_quantity > 1:
        context.findings.error(
            element,
            node.id,
            START_QUANTITY,
            "an event subprocess is begun by its start event, not by tokens that come to it",
            "delete startQuantity",
        )


def _quantity(
    context: ReadingContext, element: etree._Element, name: str, text: str, rule: Rule
) -> int:
    """Read the number of tokens that begin, or leave, an activity (table 10.3)."""
    if text.isascii() and text.isdecimal() and 1 <= int(text) <= MAX_QUANTITY:
        return int(text)
    context.findings.error(
        element,
        element.get("id", ""),
        rule,
        f"{name}='{text}' is no number of tokens from 1 to {MAX_QUANTITY}",
        f'write for example {name}="2", or delete it',
    )
    return 1


def _note_default(context: ReadingContext, element: etree._Element, node: FlowNode) -> None:
    default = element.get("default")
    if default:
        context.defaults.append((node, reference(default), context.findings.line(element)))


def read_call_activity(context: ReadingContext, found: Children) -> CallActivity:
    """Read a call activity; `resolve_calls` adds what data associations pass."""
    inputs: list[Mapping] = []
    outputs: list[Mapping] = []
    called = found.element.get("calledElement", "")
    for element, direction in _mapping_elements(found):
        mapping = _mapping(context, found, element)
        if mapping is not None:
            before = inputs if direction == "in" else outputs
            _warn_of_order(context, found, element, mapping, before)
            before.append(mapping)
    for each in found.extensions():
        if each.tag == ZEEBE + "calledElement":
            called = called or each.get("processId", "")
            _refuse_propagation(context, found, each)
    call = CallActivity(
        *context.head(found.element, found.id),
        reference(called) if "{" not in called and not called.startswith("=") else called,
        Mappings(tuple(inputs), tuple(outputs)),
    )
    context.calls.append(
        PendingCall(
            call,
            found.element,
            _own_parameters(found),
            [association(each) for each in found.of("dataInputAssociation")],
            context.note_outputs(found.of("dataOutputAssociation")),
        )
    )
    return call


def _mapping_elements(found: Children) -> Iterator[tuple[etree._Element, str]]:
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


def _mapping(context: ReadingContext, found: Children, element: etree._Element) -> Mapping | None:
    line = context.findings.line(element)
    if element.get("businessKey") is not None:
        return None  # Camunda's correlation of process instances, without a meaning here
    if element.get("variables") is not None:
        context.findings.error(
            element,
            found.id,
            PASSES_EVERYTHING,
            f"variables='{element.get('variables')}' would pass every value, which m2pem refuses: "
            "nothing passes that is not listed",
            _ALL,
        )
        return None
    source = _source(context, found, element)
    target = (element.get("target") or "").strip()
    if not KEY.fullmatch(target):
        context.findings.error(
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


def _warn_of_order(
    context: ReadingContext,
    found: Children,
    element: etree._Element,
    mapping: Mapping,
    before: list[Mapping],
) -> None:
    """Camunda 8's mappings read what those before them have set; those of a call here do not."""
    for each in before if element.tag.startswith(ZEEBE) else ():
        if each.target in mapping.source.names:
            context.findings.warning(
                element,
                found.id,
                FOREIGN_EFFECT,
                f"'{mapping.target}' does not read the '{each.target}' of the mapping before it",
                f"write {each.source.text.strip()} in place of {each.target}",
            )


def _source(context: ReadingContext, found: Children, element: etree._Element) -> Expression | None:
    text = element.get("source") or element.get("sourceExpression") or ""
    if not text.strip():
        context.findings.error(element, found.id, MAPPING_SOURCE, "the mapping has no source")
        return None
    if element.tag.startswith(ZEEBE):
        return context.template(element, found.id, text)
    return context.value(element, found.id, text)


def _refuse_propagation(context: ReadingContext, found: Children, element: etree._Element) -> None:
    for name in PROPAGATES:
        if element.get(name) == "true":
            context.findings.error(
                element,
                found.id,
                PASSES_EVERYTHING,
                f"{name} would pass every value, which m2pem refuses: nothing passes that is not "
                "listed",
                _ALL,
            )


def _own_parameters(found: Children) -> dict[str, str]:
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


def resolve_calls(context: ReadingContext) -> None:
    """Add what BPMN's data associations pass, now that all data objects are known."""
    for pending in context.calls:
        inputs = [_associated(context, pending, each, into=True) for each in pending.inputs]
        outputs = [_associated(context, pending, each, into=False) for each in pending.outputs]
        if inputs or outputs:
            own = pending.call.mappings
            mappings = Mappings(
                (*own.inputs, *(each for each in inputs if each is not None)),
                (*own.outputs, *(each for each in outputs if each is not None)),
            )
            object.__setattr__(pending.call, "mappings", mappings)


def _associated(
    context: ReadingContext, pending: PendingCall, found: Association, *, into: bool
) -> Mapping | None:
    """The mapping of one association.

    The outer end is a data object of the caller. The inner end is a data input or output of the
    activity, or an element of the called process; where an editor left it out, or put a
    placeholder, the value keeps its name.
    """
    source = found.source_refs[0] if found.source_refs else ""
    outer_ref, inner_ref = (source, found.target_ref) if into else (found.target_ref, source)
    outer = context.data_key(outer_ref)
    inner = pending.parameters.get(inner_ref, context.data_key(inner_ref)) or outer
    line = context.findings.line(found.element)
    if not found.simple:
        return _not_passed(context, pending, found, "it has an assignment or a transformation")
    if not outer:
        return _not_passed(context, pending, found, f"'{outer_ref}' is no data object here")
    from_key, to_key = (outer, inner) if into else (inner, outer)
    for key in (from_key, to_key):
        if not KEY.fullmatch(key):
            return _not_passed(context, pending, found, f"'{key}' is no dotted name")
    try:
        return Mapping(parse(from_key, "m2pem"), to_key, line)
    except ExpressionSyntaxError as error:
        return _not_passed(context, pending, found, str(error))


def _not_passed(
    context: ReadingContext, pending: PendingCall, found: Association, because: str
) -> Mapping | None:
    context.findings.warning(
        found.element,
        pending.call.id,
        ASSOCIATION_IGNORED,
        f"the data association passes nothing: {because}",
    )
    return None


_GLOBAL_TASKS: dict[str, Callable[[ReadingContext, Children], Activity]] = {
    BPMN + "globalTask": read_plain_task,
    BPMN + "globalBusinessRuleTask": read_business_rule_task,
    BPMN + "globalManualTask": read_manual_task,
    BPMN + "globalScriptTask": read_script_task,
    BPMN + "globalUserTask": read_user_task,
}
GLOBAL_TASKS = frozenset(_GLOBAL_TASKS)


def read_global_task(context: ReadingContext, element: etree._Element) -> Process:
    """Read a global task as the process that calling it begins."""
    identifier = element.get("id", "")  # claimed with the root elements
    process = Process(*context.head(element, identifier), global_task=True)
    task = _GLOBAL_TASKS[element.tag](context, read_children(context, element, identifier))
    context.processes.append(process)
    context.nodes.append(task)
    context.containers.append(process)
    return process


TASKS: dict[str, Callable[[ReadingContext, Children], Activity]] = {
    BPMN + "task": read_plain_task,
    BPMN + "manualTask": read_manual_task,
    BPMN + "userTask": read_user_task,
    BPMN + "scriptTask": read_script_task,
    BPMN + "serviceTask": read_service_task,
    BPMN + "sendTask": read_send_task,
    BPMN + "receiveTask": read_receive_task,
    BPMN + "callActivity": read_call_activity,
    BPMN + "businessRuleTask": read_business_rule_task,
}
"""The reader of each activity that is no subprocess."""
