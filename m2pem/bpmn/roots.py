"""Elements directly in `definitions`: what events refer to, and collaborations."""

from lxml import etree

from m2pem.bpmn.collaboration import read_collaboration
from m2pem.bpmn.correlation import correlation_key, read_property
from m2pem.bpmn.global_tasks import GLOBAL_TASKS
from m2pem.bpmn.names import BPMN, M2PEM, a, kind, local
from m2pem.bpmn.reading import DataEnd, Reading
from m2pem.bpmn.rules.attributes import BAD_VALUE, UNKNOWN_ELEMENT
from m2pem.bpmn.rules.files import NOT_EXECUTED
from m2pem.bpmn.scan import Order, scan
from m2pem.bpmn.schema import ROOT_NAMES, SHAPES
from m2pem.mission.events import Error, Escalation, Message, Signal
from m2pem.mission.near import did_you_mean

PROCESS = BPMN + "process"
_DI = frozenset({"BPMNDiagram", "import", "extension", "relationship"})
_CHOREOGRAPHIES = frozenset(
    {"choreography", "globalChoreographyTask", "conversation", "globalConversation"}
)


def read_roots(reading: Reading, definitions: etree._Element) -> list[etree._Element]:
    """Read all root elements but the processes, which are returned in the order of the XML."""
    shape = SHAPES[definitions.tag]
    reading.check_attributes(definitions, shape, definitions.get("id", ""))
    language = definitions.get("expressionLanguage", "")
    if "feel" in language.lower():
        # Editors write XPath, BPMN's default, over files whose conditions are none.
        reading.expression_language = language
    order = Order()
    processes: list[etree._Element] = []
    for element in definitions:
        tag = element.tag
        if not tag.startswith(BPMN):
            continue
        name = local(tag)
        if tag == PROCESS:
            processes.append(element)
        elif name == "collaboration":
            read_collaboration(reading, element)
        elif name.endswith("EventDefinition"):
            if element.get("id"):
                reading.event_definitions[reading.claim(element)] = element
        elif tag in GLOBAL_TASKS:
            if element.get("id"):
                reading.global_tasks[reading.claim(element)] = element
        elif name == "dataStore":
            _read_data_store(reading, element)
        elif name in ("signal", "message", "error", "escalation"):
            _read_event_root(reading, element, name)
        elif name == "correlationProperty":
            read_property(reading, element)
        elif name in _CHOREOGRAPHIES:
            _refuse_choreography(reading, element)
        elif name not in ROOT_NAMES and name not in _DI:
            reading.report.warning(
                element,
                element.get("id", ""),
                UNKNOWN_ELEMENT,
                f"BPMN has no '{name}' in definitions; it is ignored",
                did_you_mean(name, ROOT_NAMES, "delete it"),
            )
            continue
        order.check(reading, definitions, element, shape, definitions.get("id", ""))
    return processes


def _read_event_root(reading: Reading, element: etree._Element, name: str) -> None:
    identifier = reading.claim(element)
    scan(reading, element, identifier)
    reading.declared_roots.add(identifier)
    label = element.get("name", "")
    line = reading.report.line(element)
    if name == "signal":
        returned = element.get(M2PEM + "returned", "").strip()
        sent = _from_operator(reading, element, identifier)
        signal = Signal(identifier, label, line, sent, returned)
        reading.signals.setdefault(identifier, signal)
    elif name == "message":
        sent = _from_operator(reading, element, identifier)
        key = correlation_key(reading, element, identifier)
        message = Message(identifier, label, line, sent, key)
        reading.messages.setdefault(identifier, message)
    elif name == "error":
        error = Error(identifier, label, line, element.get("errorCode") or identifier)
        reading.errors.setdefault(identifier, error)
    else:
        code = element.get("escalationCode") or identifier
        reading.escalations.setdefault(identifier, Escalation(identifier, label, line, code))


def _from_operator(reading: Reading, element: etree._Element, identifier: str) -> bool:
    sender = element.get(M2PEM + "from")
    if sender not in (None, "operator"):
        reading.report.error(
            element,
            identifier,
            BAD_VALUE,
            f"m2pem:from='{sender}' names no sender that m2pem knows",
            'write m2pem:from="operator", or delete it',
        )
    return sender == "operator"


def _read_data_store(reading: Reading, element: etree._Element) -> None:
    identifier = reading.claim(element)
    scan(reading, element, identifier)
    key = element.get("name") or identifier
    reading.data.setdefault(identifier, DataEnd(key, [element]))


def _refuse_choreography(reading: Reading, element: etree._Element) -> None:
    word = kind(element.tag)
    reading.report.error(
        element,
        element.get("id", ""),
        NOT_EXECUTED,
        f"m2pem does not execute {a(word)} yet",
        "draw the mission as processes and collaborations",
    )
