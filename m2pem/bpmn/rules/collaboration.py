"""Pools and conversations (BPMN 2.0.2, 9.3 and 9.5)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Check, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, name_of, names, texts

MINIMUM = Rule(
    9301,
    "pool-minimum",
    "9.3.1",
    W,
    "the least number of participants must be a whole number from 0",
    "correct minimum; it has no effect on execution",
)
MAXIMUM = Rule(
    9302,
    "pool-maximum",
    "9.3.1",
    W,
    "the greatest number of participants must be a whole number from 1, and not below the least",
    "correct maximum; it has no effect on execution",
)
PARTICIPANT_ASSOCIATION = Rule(
    9306,
    "participant-association",
    "9.3.1",
    W,
    "a participant association must join two pools",
    "name a participant in innerParticipantRef and in outerParticipantRef",
)
FLOW_ASSOCIATION = Rule(
    9406,
    "message-flow-association",
    "9.4.2",
    W,
    "a message flow association must join two message flows",
    "name a messageFlow in innerMessageFlowRef and in outerMessageFlowRef",
)
PARTICIPANTS = Rule(
    9501,
    "conversation-participants",
    "9.5.1",
    W,
    "a conversation must have two or more participants",
    "add a participantRef for each",
)
PARTICIPANT = Rule(
    9502,
    "conversation-participant",
    "9.5.1",
    W,
    "the conversation's participantRef names no pool",
    "name a participant of the collaboration",
)
LINK_ENDS = Rule(
    9503,
    "conversation-link-ends",
    "9.5.6",
    W,
    "a conversation link must join a conversation and a pool, activity or event",
    "name both in sourceRef and targetRef",
)
CONVERSATION_ASSOCIATION = Rule(
    9504,
    "conversation-association",
    "9.5.7",
    W,
    "a conversation association must join two conversations",
    "name a conversation in innerConversationNodeRef and in outerConversationNodeRef",
)
_PARTICIPANT = names("participant")
_CONVERSATIONS = names("conversation subConversation callConversation")


def _multiplicity(tree: Tree, element: etree._Element) -> None:
    least = _number(element.get("minimum", "0"))
    greatest = _number(element.get("maximum", "1"))
    if least is None:
        tree.say(MINIMUM, element, f"'{element.get('minimum')}'")
    if greatest is None or greatest < 1 or (element.get("maximum") and greatest < (least or 0)):
        tree.say(MAXIMUM, element, f"'{element.get('maximum')}'")


def _number(text: str) -> int | None:
    text = text.strip()
    return int(text) if text.isascii() and text.isdigit() else None


def _conversation(tree: Tree, element: etree._Element) -> None:
    participants = texts(element, "participantRef")
    if len(participants) < 2:
        tree.say(PARTICIPANTS, element, f"this one has {len(participants)}")
    for name in participants:
        if tree.leads_nowhere(element, name, _PARTICIPANT):
            tree.say(PARTICIPANT, element, f"'{name}'")


def _link(tree: Tree, element: etree._Element) -> None:
    ends = [tree.find(element, element.get(name, "")) for name in ("sourceRef", "targetRef")]
    tags = [name_of(end) if end is not None else "" for end in ends]
    if "" in tags or not any(end is not None and end.tag in _CONVERSATIONS for end in ends):
        tree.say(LINK_ENDS, element)


def _joins(inner: str, tags: frozenset[str], rule: Rule) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        for name in (inner, inner.replace("inner", "outer")):
            text = (texts(element, name) or [element.get(name, "")])[0]
            if tree.leads_nowhere(element, text, tags):
                tree.say(rule, element, f"{name} is '{text}'")

    return check


TOPIC = Topic(
    declared(globals()),
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
            "innerMessageFlowRef", names("messageFlow"), FLOW_ASSOCIATION
        ),
        "conversationAssociation": _joins(
            "innerConversationNodeRef", _CONVERSATIONS, CONVERSATION_ASSOCIATION
        ),
    },
)
