"""Elements directly in `definitions`: what events refer to, and collaborations."""

from lxml import etree

from m2pem.bpmn.activities import GLOBAL_TASKS
from m2pem.bpmn.children import ChildOrder, read_children
from m2pem.bpmn.collaboration import read_collaboration, read_property
from m2pem.bpmn.context import DataEnd, ReadingContext
from m2pem.bpmn.rules.attributes import BAD_VALUE, UNKNOWN_ELEMENT
from m2pem.bpmn.schema import ROOT_NAMES, SHAPES
from m2pem.bpmn.subprocesses import not_executed
from m2pem.bpmn.xml import BPMN, M2PEM, ZEEBE, local
from m2pem.mission.events import Error, Escalation, Message, Signal
from m2pem.suggestions import suggest_or

PROCESS = BPMN + "process"
_DI = frozenset({"BPMNDiagram", "import", "extension", "relationship"})
_CHOREOGRAPHIES = frozenset(
    {"choreography", "globalChoreographyTask", "conversation", "globalConversation"}
)


def read_roots(context: ReadingContext, definitions: etree._Element) -> list[etree._Element]:
    """Read all root elements but the processes, which are returned in the order of the XML."""
    shape = SHAPES[definitions.tag]
    context.check_attributes(definitions, shape, definitions.get("id", ""))
    language = definitions.get("expressionLanguage", "")
    if "feel" in language.lower():
        # Editors write XPath, BPMN's default, over files whose conditions are none.
        context.expression_language = language
    order = ChildOrder()
    processes: list[etree._Element] = []
    for element in definitions:
        tag = element.tag
        if not tag.startswith(BPMN):
            continue
        name = local(tag)
        if tag == PROCESS:
            processes.append(element)
        elif name == "collaboration":
            read_collaboration(context, element)
        elif name.endswith("EventDefinition"):
            if element.get("id"):
                context.event_definitions[context.claim(element)] = element
        elif tag in GLOBAL_TASKS:
            if element.get("id"):
                context.global_tasks[context.claim(element)] = element
        elif name == "dataStore":
            _read_data_store(context, element)
        elif name in ("signal", "message", "error", "escalation"):
            _read_event_root(context, element, name)
        elif name == "correlationProperty":
            read_property(context, element)
        elif name in _CHOREOGRAPHIES:
            not_executed(context, element, "draw the mission as processes and collaborations")
        elif name not in ROOT_NAMES and name not in _DI:
            context.findings.warning(
                element,
                element.get("id", ""),
                UNKNOWN_ELEMENT,
                f"BPMN has no '{name}' in definitions; it is ignored",
                suggest_or(name, ROOT_NAMES, "delete it"),
            )
            continue
        order.check(context, definitions, element, shape, definitions.get("id", ""))
    return processes


def _read_event_root(context: ReadingContext, element: etree._Element, name: str) -> None:
    identifier = context.claim(element)
    read_children(context, element, identifier)
    context.declared_roots.add(identifier)
    head = context.head(element, identifier)
    if name == "signal":
        returned = element.get(M2PEM + "returned", "").strip()
        sent = _from_operator(context, element, identifier)
        context.signals.setdefault(identifier, Signal(*head, sent, returned))
    elif name == "message":
        sent = _from_operator(context, element, identifier)
        subscription = (ZEEBE + "subscription", "correlationKey")
        key = context.own_expression(element, identifier, "correlationKey", subscription)
        context.messages.setdefault(identifier, Message(*head, sent, key))
    elif name == "error":
        code = element.get("errorCode") or identifier
        context.errors.setdefault(identifier, Error(*head, code))
    else:
        code = element.get("escalationCode") or identifier
        context.escalations.setdefault(identifier, Escalation(*head, code))


def _from_operator(context: ReadingContext, element: etree._Element, identifier: str) -> bool:
    sender = element.get(M2PEM + "from")
    if sender not in (None, "operator"):
        context.findings.error(
            element,
            identifier,
            BAD_VALUE,
            f"m2pem:from='{sender}' names no sender that m2pem knows",
            'write m2pem:from="operator", or delete it',
        )
    return sender == "operator"


def _read_data_store(context: ReadingContext, element: etree._Element) -> None:
    identifier = context.claim(element)
    read_children(context, element, identifier)
    key = element.get("name") or identifier
    context.data.setdefault(identifier, DataEnd(key, [element]))
