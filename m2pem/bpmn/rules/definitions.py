"""Event definitions: codes and cancellation (BPMN 2.0.2, 8.4.3, 8.4.4 and 10.5.5)."""

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    THROWING,
    Tree,
    has_trigger,
    is_false,
    name_of,
    parent,
)

ERROR_CODE = Rule(
    8422,
    "thrown-error-code",
    "8.4.3",
    W,
    "the error that is thrown has no errorCode",
    "add errorCode to the error; until then its id is its code",
)
ESCALATION_CODE = Rule(
    8432,
    "thrown-escalation-code",
    "8.4.4",
    W,
    "the escalation that is thrown has no escalationCode",
    "add escalationCode to the escalation; until then its id is its code",
)
CANCEL_END = Rule(
    10549,
    "cancel-end-place",
    "10.5.5",
    E,
    "a cancel end event can stand only in a transaction",
    "make what is around it a transaction, or use an error or terminate end event",
)
CANCEL_BOUNDARY = Rule(
    10550,
    "cancel-boundary-place",
    "10.5.5",
    E,
    "a cancel boundary event can be attached only to a transaction",
    "make the activity a transaction, or catch an error",
)
CANCEL_GOES_ON = Rule(
    10551,
    "cancel-not-interrupting",
    "10.5.5",
    E,
    "a cancel boundary event must interrupt the transaction",
    'delete cancelActivity="false"',
)
CANCEL_UNCAUGHT = Rule(
    10552,
    "cancel-uncaught",
    "10.5.6",
    W,
    "no boundary event of the transaction catches the cancellation; its token ends there",
    "attach a cancel boundary event to the transaction",
)


def _error(tree: Tree, definition: etree._Element) -> None:
    _code(tree, definition, "errorRef", "errorCode", ERROR_CODE)


def _escalation(tree: Tree, definition: etree._Element) -> None:
    _code(tree, definition, "escalationRef", "escalationCode", ESCALATION_CODE)


def _code(
    tree: Tree, definition: etree._Element, reference: str, attribute: str, rule: Rule
) -> None:
    name = definition.get(reference)
    if not name or parent(definition).tag not in THROWING:
        return
    root = tree.find(definition, name)
    if root is not None and name_of(root) == reference[:-3] and not root.get(attribute):
        tree.say(rule, definition, f"'{name}'")


def _cancel(tree: Tree, definition: etree._Element) -> None:
    event = parent(definition)
    transaction = BPMN + "transaction"
    around = parent(event)
    if name_of(event) == "endEvent" and around.tag != transaction:
        tree.say(CANCEL_END, event)
    elif name_of(event) == "endEvent":
        attached = tree.boundary.get(around.get("id", ""), [])
        if not any(has_trigger(tree, each, "cancel") for each in attached):
            tree.say(CANCEL_UNCAUGHT, event)
    elif name_of(event) == "boundaryEvent":
        host = tree.find(event, event.get("attachedToRef", ""))
        if host is not None and host.tag != transaction:
            tree.say(CANCEL_BOUNDARY, event)
        if is_false(event, "cancelActivity"):
            tree.say(CANCEL_GOES_ON, event)


TOPIC = Topic(
    declared(globals()),
    {
        "errorEventDefinition": _error,
        "escalationEventDefinition": _escalation,
        "cancelEventDefinition": _cancel,
    },
)
