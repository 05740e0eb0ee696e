"""References that name nothing of the right kind: each attribute or child with what it may name.

References that execution needs (flows, attachments, signals, ...) are looked up by the readers.
"""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import ACTIVITIES, EVENTS, Check, Checks, Tree, name_of, names, texts
from m2pem.bpmn.xml import a, kind

error, warning = family("9.3.1")

DANGLING_REFERENCE = error(
    15301,
    "a reference names nothing, or nothing of the right kind (a warning where it has no effect on "
    "execution: pools, lanes, message flows, data)",
    "name an element that is there",
    clause="15.3.2",
)

ITEMS = names(
    "dataObject dataObjectReference dataStore dataStoreReference property dataInput dataOutput "
    "inputDataItem outputDataItem"
)
"""Tags of BPMN's item-aware elements (clause 10.4.1)."""


def _names_no(number: int, reference: str, wanted: str, clause: str = "9.3.1") -> Rule:
    """A reference to no element of a kind. `wanted`: the element's name, and where it may be."""
    named = kind(wanted.partition(" ")[0])
    remedy = f"name {a(wanted)}, or delete it"
    return warning(number, f"{reference} names no {named}", remedy, clause=clause)


CATEGORY_VALUE = _names_no(8404, "categoryValueRef", "categoryValue of a category", "8.4.1")
ERROR_STRUCTURE = _names_no(8421, "the error's structureRef", "itemDefinition", "8.4.3")
ESCALATION_STRUCTURE = _names_no(8431, "the escalation's structureRef", "itemDefinition", "8.4.4")
MESSAGE_ITEM = _names_no(8451, "the message's itemRef", "itemDefinition", "8.4.11")
OPERATION_OUT_MESSAGE = _names_no(
    8505, "the operation's outMessageRef", "message in definitions", "8.5.3"
)
OPERATION_ERROR = _names_no(8506, "the operation's errorRef", "error in definitions", "8.5.3")
PARTICIPANT_INTERFACE = _names_no(9303, "the pool's interfaceRef", "interface in definitions")
PARTICIPANT_END_POINT = _names_no(9304, "the pool's endPointRef", "endPoint in definitions")
PARTNER_PARTICIPANT = warning(
    9305,
    "the partner's participantRef names no pool",
    "name a participant of a collaboration, or delete it",
)
CALLED_COLLABORATION = _names_no(
    9505,
    "the call conversation's calledCollaborationRef",
    "collaboration or globalConversation",
    "9.5.4",
)
CONVERSATION_MESSAGE_FLOW = _names_no(
    9506, "the conversation's messageFlowRef", "messageFlow of the collaboration", "9.5.1"
)
COLLABORATION_CHOREOGRAPHY = _names_no(
    9701, "the collaboration's choreographyRef", "choreography in definitions", "9.7"
)
DEFINITIONAL_COLLABORATION = _names_no(
    10103, "definitionalCollaborationRef", "collaboration of the file", "10.1"
)
SUPPORTED_PROCESS = _names_no(10104, "supports", "process of the file", "10.1")
SUPPORTED_INTERFACE = _names_no(
    10322, "supportedInterfaceRef", "interface in definitions", "10.3.6"
)
ROLE_RESOURCE = _names_no(10303, "the role's resourceRef", "resource in definitions", "10.3.1")
TASK_OPERATION = _names_no(10311, "the task's operationRef", "operation of an interface", "10.3.3")
DATA_ITEM = _names_no(10404, "itemSubjectRef", "itemDefinition", "10.4.1")
EVENT_OPERATION = _names_no(
    10534, "the event's operationRef", "operation of an interface", "10.5.5"
)
SIGNAL_STRUCTURE = _names_no(10539, "the signal's structureRef", "itemDefinition", "10.5.5")
LANE_PARTITION = warning(
    10804,
    "the lane's partitionElementRef names nothing",
    "name an element of the file, or delete it",
    clause="10.8",
)

_ITEM_DEFINITION = names("itemDefinition")
_OPERATION = names("operation")
_INTERFACE = names("interface")
_COLLABORATION = names("collaboration globalConversation choreography globalChoreographyTask")
_PARTITION = (
    EVENTS | ACTIVITIES | ITEMS | names("resource participant partnerRole partnerEntity lane group")
)
_DATA = "dataObject dataObjectReference dataStore dataStoreReference property dataInput dataOutput"

_ATTRIBUTES: list[tuple[str, str, frozenset[str], Rule]] = [
    ("group", "categoryValueRef", names("categoryValue"), CATEGORY_VALUE),
    ("error", "structureRef", _ITEM_DEFINITION, ERROR_STRUCTURE),
    ("escalation", "structureRef", _ITEM_DEFINITION, ESCALATION_STRUCTURE),
    ("signal", "structureRef", _ITEM_DEFINITION, SIGNAL_STRUCTURE),
    ("message", "itemRef", _ITEM_DEFINITION, MESSAGE_ITEM),
    ("callConversation", "calledCollaborationRef", _COLLABORATION, CALLED_COLLABORATION),
    ("process", "definitionalCollaborationRef", _COLLABORATION, DEFINITIONAL_COLLABORATION),
    ("serviceTask", "operationRef", _OPERATION, TASK_OPERATION),
    ("sendTask", "operationRef", _OPERATION, TASK_OPERATION),
    ("receiveTask", "operationRef", _OPERATION, TASK_OPERATION),
    ("lane", "partitionElementRef", _PARTITION, LANE_PARTITION),
    *((each, "itemSubjectRef", _ITEM_DEFINITION, DATA_ITEM) for each in _DATA.split()),
]
_CHILDREN: list[tuple[str, frozenset[str], Rule]] = [
    ("categoryValueRef", names("categoryValue"), CATEGORY_VALUE),
    ("outMessageRef", names("message"), OPERATION_OUT_MESSAGE),
    ("errorRef", names("error"), OPERATION_ERROR),
    ("interfaceRef", _INTERFACE, PARTICIPANT_INTERFACE),
    ("endPointRef", names("endPoint"), PARTICIPANT_END_POINT),
    ("messageFlowRef", names("messageFlow"), CONVERSATION_MESSAGE_FLOW),
    ("choreographyRef", names("choreography globalChoreographyTask"), COLLABORATION_CHOREOGRAPHY),
    ("supports", names("process"), SUPPORTED_PROCESS),
    ("supportedInterfaceRef", _INTERFACE, SUPPORTED_INTERFACE),
    ("resourceRef", names("resource"), ROLE_RESOURCE),
    ("operationRef", _OPERATION, EVENT_OPERATION),
]


def _names(tags: frozenset[str], rule: Rule, attribute: str = "") -> Check:
    """An attribute of an element, or else its text, names something with one of the tags."""

    def check(tree: Tree, element: etree._Element) -> None:
        name = element.get(attribute) if attribute else (element.text or "").strip()
        if name and tree.leads_nowhere(element, name, tags):
            tree.report(rule, element, f"'{name}'")

    return check


def _partner(tree: Tree, element: etree._Element) -> None:
    """partnerEntity and partnerRole; participantRef is also a child of conversations."""
    for name in texts(element, "participantRef"):
        if tree.leads_nowhere(element, name, names("participant")):
            tree.report(PARTNER_PARTICIPANT, element, f"{name_of(element)} names '{name}'")


CHECKS = Checks(
    {
        **{owner: _names(tags, rule, name) for owner, name, tags, rule in _ATTRIBUTES},
        **{name: _names(tags, rule) for name, tags, rule in _CHILDREN},
        "partnerEntity": _partner,
        "partnerRole": _partner,
    },
)
