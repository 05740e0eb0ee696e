"""Pools, conversations, message flows, correlation and lanes.

BPMN 2.0.2, 7.6.3, 8.4.2, 9.3 to 9.5, 10.5 and 10.8.
"""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    CATCHING,
    EVENTS,
    NODES,
    THROWING,
    Check,
    Checks,
    Tree,
    children,
    has,
    has_trigger,
    name_of,
    names,
    texts,
    triggers,
    what,
)
from m2pem.bpmn.xml import BPMN, a, kind

error, warning = family("8.4.2")

RETRIEVAL_MESSAGE = error(
    8412,
    "the retrieval expression's messageRef names no message",
    "name the message from which the value is read",
)
RETRIEVAL_PATH = error(
    8413,
    "the retrieval expression has no messagePath",
    "write the expression that gives the value",
)
BINDING_PROPERTY = error(
    8417,
    "the correlation binding's correlationPropertyRef names no correlation property",
    "name a correlationProperty in definitions",
)
BINDING_PATH = error(
    8418,
    "the correlation binding has no dataPath",
    "write the expression that gives the value in the process",
)

CORRELATION_RETRIEVAL = warning(
    8411,
    "the correlation property does not say where messages have its value",
    "add a correlationPropertyRetrievalExpression for each message",
)
CORRELATION_KEY_PROPERTIES = warning(
    8414,
    "the correlation key has no properties",
    "add a correlationPropertyRef for each part of the key",
)
CORRELATION_KEY_PROPERTY = warning(
    8415,
    "the correlation key's correlationPropertyRef names no correlation property",
    "name a correlationProperty in definitions",
)
SUBSCRIPTION_KEY = warning(
    8416,
    "the correlation subscription's correlationKeyRef names no correlation key",
    "name a correlationKey of a collaboration or conversation",
)
_PROPERTY = names("correlationProperty")


def _property(tree: Tree, element: etree._Element) -> None:
    if not has(element, "correlationPropertyRetrievalExpression"):
        tree.report(CORRELATION_RETRIEVAL, element)


def _key(tree: Tree, element: etree._Element) -> None:
    properties = texts(element, "correlationPropertyRef")
    if not properties:
        tree.report(CORRELATION_KEY_PROPERTIES, element)
    for name in properties:
        if tree.leads_nowhere(element, name, _PROPERTY):
            tree.report(CORRELATION_KEY_PROPERTY, element, f"'{name}'")


def _subscription(tree: Tree, element: etree._Element) -> None:
    key = element.get("correlationKeyRef", "")
    if tree.leads_nowhere(element, key, names("correlationKey")):
        tree.report(SUBSCRIPTION_KEY, element, f"'{key}'")


CORRELATION = Checks(
    {
        "correlationProperty": _property,
        "correlationKey": _key,
        "correlationSubscription": _subscription,
    },
)


POOL_MINIMUM = warning(
    9301,
    "the least number of participants must be a whole number from 0",
    "correct minimum; it has no effect on execution",
    clause="9.3.1",
)
POOL_MAXIMUM = warning(
    9302,
    "the greatest number of participants must be a whole number from 1, and not below the least",
    "correct maximum; it has no effect on execution",
    clause="9.3.1",
)
PARTICIPANT_ASSOCIATION = warning(
    9306,
    "a participant association must join two pools",
    "name a participant in innerParticipantRef and in outerParticipantRef",
    clause="9.3.1",
)
MESSAGE_FLOW_ASSOCIATION = warning(
    9406,
    "a message flow association must join two message flows",
    "name a messageFlow in innerMessageFlowRef and in outerMessageFlowRef",
    clause="9.4.2",
)
CONVERSATION_PARTICIPANTS = warning(
    9501,
    "a conversation must have two or more participants",
    "add a participantRef for each",
    clause="9.5.1",
)
CONVERSATION_PARTICIPANT = warning(
    9502,
    "the conversation's participantRef names no pool",
    "name a participant of the collaboration",
    clause="9.5.1",
)
CONVERSATION_LINK_ENDS = warning(
    9503,
    "a conversation link must join a conversation and a pool, activity or event",
    "name both in sourceRef and targetRef",
    clause="9.5.6",
)
CONVERSATION_ASSOCIATION = warning(
    9504,
    "a conversation association must join two conversations",
    "name a conversation in innerConversationNodeRef and in outerConversationNodeRef",
    clause="9.5.7",
)
_PARTICIPANT = names("participant")
_CONVERSATIONS = names("conversation subConversation callConversation")


def _multiplicity(tree: Tree, element: etree._Element) -> None:
    least = _number(element.get("minimum", "0"))
    greatest = _number(element.get("maximum", "1"))
    if least is None:
        tree.report(POOL_MINIMUM, element, f"'{element.get('minimum')}'")
    if greatest is None or greatest < 1 or (element.get("maximum") and greatest < (least or 0)):
        tree.report(POOL_MAXIMUM, element, f"'{element.get('maximum')}'")


def _number(text: str) -> int | None:
    text = text.strip()
    return int(text) if text.isascii() and text.isdigit() else None


def _conversation(tree: Tree, element: etree._Element) -> None:
    participants = texts(element, "participantRef")
    if len(participants) < 2:
        tree.report(CONVERSATION_PARTICIPANTS, element, f"this one has {len(participants)}")
    for name in participants:
        if tree.leads_nowhere(element, name, _PARTICIPANT):
            tree.report(CONVERSATION_PARTICIPANT, element, f"'{name}'")


def _link(tree: Tree, element: etree._Element) -> None:
    ends = [tree.find(element, element.get(name, "")) for name in ("sourceRef", "targetRef")]
    tags = [name_of(end) if end is not None else "" for end in ends]
    if "" in tags or not any(end is not None and end.tag in _CONVERSATIONS for end in ends):
        tree.report(CONVERSATION_LINK_ENDS, element)


def _joins(inner: str, tags: frozenset[str], rule: Rule) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        for name in (inner, inner.replace("inner", "outer")):
            text = (texts(element, name) or [element.get(name, "")])[0]
            if tree.leads_nowhere(element, text, tags):
                tree.report(rule, element, f"{name} is '{text}'")

    return check


CHECKS = Checks(
    {
        "participantMultiplicity": _multiplicity,
        "conversation": _conversation,
        "subConversation": _conversation,
        "callConversation": _conversation,
        "conversationLink": _link,
        "participantAssociation": _joins(
            "innerParticipantRef", _PARTICIPANT, PARTICIPANT_ASSOCIATION
        ),
        "messageFlowAssociation": _joins(
            "innerMessageFlowRef", names("messageFlow"), MESSAGE_FLOW_ASSOCIATION
        ),
        "conversationAssociation": _joins(
            "innerConversationNodeRef", _CONVERSATIONS, CONVERSATION_ASSOCIATION
        ),
    },
)


MESSAGE_FLOW_END = warning(
    9401,
    "a message flow can join only pools, activities and events",
    "lead it to the activity or event that sends or receives",
    clause="9.4",
)
MESSAGE_FLOW_INSIDE = warning(
    9402,
    "a message flow must not join two elements of one pool",
    "draw a sequence flow, or send the message from another pool",
    clause="9.4",
)
MESSAGE_FLOW_FROM_CATCH = warning(
    7611,
    "a message flow must not lead out of an event that catches",
    "turn the flow round, or make the event one that throws",
    clause="7.6.3",
)
MESSAGE_FLOW_INTO_THROW = warning(
    7612,
    "a message flow must not lead into an event that throws",
    "turn the flow round, or make the event one that catches",
    clause="7.6.3",
)
MESSAGE_FLOW_INTO_OTHER = warning(
    10560,
    "a message flow leads into an event that does not wait for a message",
    "give the event a messageEventDefinition, or delete the flow",
    clause="10.5.2",
)
MESSAGE_FLOW_FROM_OTHER = warning(
    10561,
    "a message flow leads out of an event that does not send a message",
    "give the event a messageEventDefinition, or delete the flow",
    clause="10.5.3",
)
MESSAGE_FLOW_MESSAGE = warning(
    9403,
    "the message flow carries another message than its end sends or receives",
    "name the same message in both",
    clause="9.4",
)
_ENDS = ACTIVITIES | EVENTS | names("participant conversation subConversation callConversation")


def _flow(tree: Tree, element: etree._Element) -> None:
    source = tree.find(element, element.get("sourceRef", ""))
    target = tree.find(element, element.get("targetRef", ""))
    for end in (source, target):
        if end is not None and end.tag not in _ENDS:
            tree.report(MESSAGE_FLOW_END, element, f"{what(end)} is {a(kind(end.tag))}")
        if end is not None:
            _carries(tree, element, end)
    if source is None or target is None:
        return  # a reader has reported it
    if source.tag in CATCHING:
        tree.report(MESSAGE_FLOW_FROM_CATCH, element, f"{what(source)} is one")
    elif source.tag in THROWING and not has_trigger(tree, source, "message"):
        tree.report(MESSAGE_FLOW_FROM_OTHER, element, what(source))
    if target.tag in THROWING:
        tree.report(MESSAGE_FLOW_INTO_THROW, element, f"{what(target)} is one")
    elif target.tag in CATCHING and not has_trigger(tree, target, "message"):
        tree.report(MESSAGE_FLOW_INTO_OTHER, element, what(target))
    homes = {_pool(source), _pool(target)}
    if len(homes) == 1 and None not in homes:
        tree.report(MESSAGE_FLOW_INSIDE, element, f"both ends are in '{homes.pop()}'")


def _carries(tree: Tree, flow: etree._Element, end: etree._Element) -> None:
    """Report a flow whose message is none of those that one of its ends names."""
    message = tree.find(flow, flow.get("messageRef", ""))
    own = [end] if end.tag in ACTIVITIES else triggers(tree, end) if end.tag in EVENTS else []
    named = [tree.find(each, each.get("messageRef", "")) for each in own]
    known = [each for each in named if each is not None]
    if message is not None and known and message not in known:
        tree.report(
            MESSAGE_FLOW_MESSAGE, flow, f"{what(message)} is not {what(known[0])} of {what(end)}"
        )


def _pool(element: etree._Element) -> str | None:
    """The id of the process of an element or of a pool."""
    if name_of(element) == "participant":
        name = element.get("processRef", "").rpartition(":")[2]
        return name or None
    if element.tag not in NODES:
        return None
    process = next(element.iterancestors(BPMN + "process"), None)
    return None if process is None else process.get("id")


MESSAGE_FLOWS = Checks({"messageFlow": _flow})


LANE_NODE_TWICE = warning(
    10801,
    "an element is in two lanes of one lane set",
    "keep it in one",
    clause="10.8",
)
LANE_OTHER_PROCESS = warning(
    10802,
    "the lane lists an element of another process",
    "list elements of its own process only",
    clause="10.8",
)
LANE_NO_NODE = warning(
    10803,
    "the lane lists what is no activity, gateway or event",
    "delete the flowNodeRef",
    clause="10.8",
)


def _lane_set(tree: Tree, element: etree._Element) -> None:
    first: dict[str, etree._Element] = {}
    process = next(element.iterancestors(BPMN + "process"), None)
    for lane in children(element, "lane"):
        for reference in children(lane, "flowNodeRef"):
            name = (reference.text or "").strip()
            before = first.setdefault(name, lane)
            if before is not lane:
                tree.report(LANE_NODE_TWICE, reference, f"'{name}' is in {what(before)}, too")
            node = tree.find(reference, name)
            if node is None:
                continue
            if node.tag not in NODES:
                tree.report(LANE_NO_NODE, reference, f"'{name}' is {a(kind(node.tag))}")
            elif next(node.iterancestors(BPMN + "process"), None) is not process:
                tree.report(LANE_OTHER_PROCESS, reference, f"'{name}'")


LANES = Checks({"laneSet": _lane_set, "childLaneSet": _lane_set})
