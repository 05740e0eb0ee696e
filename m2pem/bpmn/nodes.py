"""One flow node: which reader its tag has, and what all activities and gateways share."""

from collections.abc import Callable

from lxml import etree

from m2pem.bpmn.ad_hoc import read_ad_hoc
from m2pem.bpmn.calls import read_call_activity
from m2pem.bpmn.data_flow import read_data_flow
from m2pem.bpmn.events import read_event
from m2pem.bpmn.gateways import GATEWAYS, read_gateway
from m2pem.bpmn.loops import read_loop
from m2pem.bpmn.names import BPMN, a, attribute_names, kind, local
from m2pem.bpmn.prompts import read_user_task
from m2pem.bpmn.reading import Reading, reference
from m2pem.bpmn.rules.activities import COMPLETION_QUANTITY, START_QUANTITY
from m2pem.bpmn.rules.attributes import BAD_VALUE
from m2pem.bpmn.rules.files import NOT_EXECUTED
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.scan import Scan, scan
from m2pem.bpmn.scripts import read_script_task
from m2pem.bpmn.tasks import (
    read_business_rule_task,
    read_manual_task,
    read_plain_task,
    read_receive_task,
    read_send_task,
    read_service_task,
)
from m2pem.mission.elements import (
    Activity,
    Container,
    FlowNode,
    SubProcess,
    Transaction,
)

SUBPROCESSES = frozenset(BPMN + name for name in ("subProcess", "transaction", "adHocSubProcess"))

MAX_QUANTITY = 1000
"""Of tokens that begin an activity, or leave it by one flow."""

_QUANTITIES = {
    "start_quantity": ("startQuantity", START_QUANTITY),
    "completion_quantity": ("completionQuantity", COMPLETION_QUANTITY),
}

_MARKS = frozenset(
    {"default", "isForCompensation", *(attribute for attribute, _ in _QUANTITIES.values())}
)

_TASKS: dict[str, Callable[[Reading, Scan], Activity]] = {
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
_EVENTS = frozenset(
    BPMN + name
    for name in (
        "startEvent",
        "endEvent",
        "intermediateCatchEvent",
        "intermediateThrowEvent",
        "boundaryEvent",
    )
)
_REFUSED = {
    "choreographyTask": "draw the mission as processes",
    "callChoreography": "draw the mission as processes",
    "subChoreography": "draw the mission as processes",
    "event": "use a start, end or intermediate event",
    "implicitThrowEvent": "use an intermediate throw event",
}


def read_node(reading: Reading, element: etree._Element, container: Container) -> FlowNode | None:
    """A flow node with all but its flows; None when the tag is that of none."""
    tag = element.tag
    if tag in _EVENTS:
        return read_event(reading, element, container)
    if tag in GATEWAYS:
        return read_gateway(reading, element)
    task = _TASKS.get(tag)
    if task is None and tag not in SUBPROCESSES:
        return _refuse(reading, element)
    identifier = reading.claim(element)
    node: Activity
    if task is None:
        # Its children are read with its content, by containers.py.
        node = _subprocess(reading, element, identifier)
    else:
        found = scan(reading, element, identifier)
        node = task(reading, found)
        if tag != BPMN + "callActivity":
            read_data_flow(reading, found, node)
        read_loop(reading, found, node)
    _check_activity(reading, element, node)
    return node


def _refuse(reading: Reading, element: etree._Element) -> FlowNode | None:
    instead = _REFUSED.get(local(element.tag))
    if instead is None:
        return None
    not_executed(reading, element, element.get("id", ""), kind(element.tag), instead)
    identifier = reading.claim(element)
    return FlowNode(identifier, element.get("name", ""), reading.report.line(element))


def _subprocess(reading: Reading, element: etree._Element, identifier: str) -> SubProcess:
    triggered = reading.boolean(element, "triggeredByEvent", False, identifier)
    if triggered and element.tag != BPMN + "subProcess":
        reading.report.error(
            element,
            identifier,
            BAD_VALUE,
            f"{a(kind(element.tag))} cannot be an event subprocess too",
            'put it into a plain <subProcess triggeredByEvent="true">, behind a start event',
        )
    if element.tag == BPMN + "adHocSubProcess":
        return read_ad_hoc(reading, element, identifier)
    name, line = element.get("name", ""), reading.report.line(element)
    if element.tag == BPMN + "transaction":
        return Transaction(identifier, name, line, triggered)
    return SubProcess(identifier, name, line, triggered)


def not_executed(
    reading: Reading, element: etree._Element, identifier: str, what: str, instead: str
) -> None:
    """Refuse what is BPMN but nothing that m2pem runs."""
    reading.report.error(
        element, identifier, NOT_EXECUTED, f"m2pem does not execute {a(what)} yet", instead
    )


def _check_activity(reading: Reading, element: etree._Element, node: Activity) -> None:
    if _MARKS.isdisjoint(attribute_names(element)):
        return
    _note_default(reading, element, node)
    if reading.boolean(element, "isForCompensation", False, node.id):
        reading.undoing.add(node)
    for field, (name, rule) in _QUANTITIES.items():
        text = element.get(name)
        if text is not None:
            quantity = _quantity(reading, element, name, text.strip(), rule)
            object.__setattr__(node, field, quantity)
    if isinstance(node, SubProcess) and node.triggered_by_event and node.start_quantity > 1:
        reading.report.error(
            element,
            node.id,
            START_QUANTITY,
            "an event subprocess is begun by its start event, not by tokens that come to it",
            "delete startQuantity",
        )


def _quantity(reading: Reading, element: etree._Element, name: str, text: str, rule: Rule) -> int:
    """How many tokens begin, or leave, an activity (table 10.3)."""
    if text.isascii() and text.isdecimal() and 1 <= int(text) <= MAX_QUANTITY:
        return int(text)
    reading.report.error(
        element,
        element.get("id", ""),
        rule,
        f"{name}='{text}' is no number of tokens from 1 to {MAX_QUANTITY}",
        f'write for example {name}="2", or delete it',
    )
    return 1


def _note_default(reading: Reading, element: etree._Element, node: FlowNode) -> None:
    default = element.get("default")
    if default:
        reading.defaults.append((node, reference(default), reading.report.line(element)))
