"""References that name nothing of the right kind: each attribute or child with what it may name.

References that execution needs (flows, attachments, signals, ...) are looked up by the readers.
"""

from lxml import etree

from m2pem.bpmn.rules.rule import E, Rule, W
from m2pem.bpmn.rules.tree import ACTIVITIES, EVENTS, Check, Checks, Tree, name_of, names, texts

DANGLING_REFERENCE = Rule(
    15301,
    "dangling-reference",
    "15.3.2",
    E,
    "a reference names nothing, or nothing of the right kind (a warning where it has no effect on "
    "execution: pools, lanes, message flows, data)",
    "name an element that is there",
)

ITEMS = names(
    "dataObject dataObjectReference dataStore dataStoreReference property dataInput dataOutput "
    "inputDataItem outputDataItem"
)
"""Tags of BPMN's item-aware elements (clause 10.4.1)."""

CATEGORY_VALUE = Rule(
    8404,
    "category-value",
    "8.4.1",
    W,
    "categoryValueRef names no category value",
    "name a categoryValue of a category, or delete it",
)
ERROR_STRUCTURE = Rule(
    8421,
    "error-structure",
    "8.4.3",
    W,
    "the error's structureRef names no item definition",
    "name an itemDefinition, or delete it",
)
ESCALATION_STRUCTURE = Rule(
    8431,
    "escalation-structure",
    "8.4.4",
    W,
    "the escalation's structureRef names no item definition",
    "name an itemDefinition, or delete it",
)
MESSAGE_ITEM = Rule(
    8451,
    "message-item",
    "8.4.11",
    W,
    "the message's itemRef names no item definition",
    "name an itemDefinition, or delete it",
)
OPERATION_OUT_MESSAGE = Rule(
    8505,
    "operation-out-message",
    "8.5.3",
    W,
    "the operation's outMessageRef names no message",
    "name a message in definitions, or delete it",
)
OPERATION_ERROR = Rule(
    8506,
    "operation-error",
    "8.5.3",
    W,
    "the operation's errorRef names no error",
    "name an error in definitions, or delete it",
)
PARTICIPANT_INTERFACE = Rule(
    9303,
    "participant-interface",
    "9.3.1",
    W,
    "the pool's interfaceRef names no interface",
    "name an interface in definitions, or delete it",
)
PARTICIPANT_END_POINT = Rule(
    9304,
    "participant-end-point",
    "9.3.1",
    W,
    "the pool's endPointRef names no end point",
    "name an endPoint in definitions, or delete it",
)
PARTNER_PARTICIPANT = Rule(
    9305,
    "partner-participant",
    "9.3.1",
    W,
    "the partner's participantRef names no pool",
    "name a participant of a collaboration, or delete it",
)
CALLED_COLLABORATION = Rule(
    9505,
    "called-collaboration",
    "9.5.4",
    W,
    "the call conversation's calledCollaborationRef names no collaboration",
    "name a collaboration or globalConversation, or delete it",
)
CONVERSATION_MESSAGE_FLOW = Rule(
    9506,
    "conversation-message-flow",
    "9.5.1",
    W,
    "the conversation's messageFlowRef names no message flow",
    "name a messageFlow of the collaboration, or delete it",
)
COLLABORATION_CHOREOGRAPHY = Rule(
    9701,
    "collaboration-choreography",
    "9.7",
    W,
    "the collaboration's choreographyRef names no choreography",
    "name a choreography in definitions, or delete it",
)
DEFINITIONAL_COLLABORATION = Rule(
    10103,
    "definitional-collaboration",
    "10.1",
    W,
    "definitionalCollaborationRef names no collaboration",
    "name a collaboration of the file, or delete it",
)
SUPPORTED_PROCESS = Rule(
    10104,
    "supported-process",
    "10.1",
    W,
    "supports names no process",
    "name a process of the file, or delete it",
)
SUPPORTED_INTERFACE = Rule(
    10322,
    "supported-interface",
    "10.3.6",
    W,
    "supportedInterfaceRef names no interface",
    "name an interface in definitions, or delete it",
)
ROLE_RESOURCE = Rule(
    10303,
    "role-resource",
    "10.3.1",
    W,
    "the role's resourceRef names no resource",
    "name a resource in definitions, or delete it",
)
TASK_OPERATION = Rule(
    10311,
    "task-operation",
    "10.3.3",
    W,
    "the task's operationRef names no operation",
    "name an operation of an interface, or delete it",
)
DATA_ITEM = Rule(
    10404,
    "data-item",
    "10.4.1",
    W,
    "itemSubjectRef names no item definition",
    "name an itemDefinition, or delete it",
)
EVENT_OPERATION = Rule(
    10534,
    "event-operation",
    "10.5.5",
    W,
    "the event's operationRef names no operation",
    "name an operation of an interface, or delete it",
)
SIGNAL_STRUCTURE = Rule(
    10539,
    "signal-structure",
    "10.5.5",
    W,
    "the signal's structureRef names no item definition",
    "name an itemDefinition, or delete it",
)
LANE_PARTITION = Rule(
    10804,
    "lane-partition",
    "10.8",
    W,
    "the lane's partitionElementRef names nothing",
    "name an element of the file, or delete it",
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


def _attribute(attribute: str, tags: frozenset[str], rule: Rule) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        name = element.get(attribute)
        if name and tree.leads_nowhere(element, name, tags):
            tree.report(rule, element, f"'{name}'")

    return check


def _child(tags: frozenset[str], rule: Rule) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        name = (element.text or "").strip()
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
        **{owner: _attribute(name, tags, rule) for owner, name, tags, rule in _ATTRIBUTES},
        **{name: _child(tags, rule) for name, tags, rule in _CHILDREN},
        "partnerEntity": _partner,
        "partnerRole": _partner,
    },
)
