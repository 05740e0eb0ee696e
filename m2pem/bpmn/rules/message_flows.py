"""Message flows: what they may join (BPMN 2.0.2, 7.6.3, 9.4 and 10.5)."""

from lxml import etree

from m2pem.bpmn.names import BPMN, a, kind
from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import (
    ACTIVITIES,
    CATCHING,
    EVENTS,
    NODES,
    THROWING,
    Tree,
    has_trigger,
    name_of,
    names,
    triggers,
    what,
)

END = Rule(
    9401,
    "message-flow-end",
    "9.4",
    W,
    "a message flow can join only pools, activities and events",
    "lead it to the activity or event that sends or receives",
)
INSIDE = Rule(
    9402,
    "message-flow-inside",
    "9.4",
    W,
    "a message flow must not join two elements of one pool",
    "draw a sequence flow, or send the message from another pool",
)
FROM_CATCH = Rule(
    7611,
    "message-flow-from-catch",
    "7.6.3",
    W,
    "a message flow must not lead out of an event that catches",
    "turn the flow round, or make the event one that throws",
)
INTO_THROW = Rule(
    7612,
    "message-flow-into-throw",
    "7.6.3",
    W,
    "a message flow must not lead into an event that throws",
    "turn the flow round, or make the event one that catches",
)
INTO_OTHER = Rule(
    10560,
    "message-flow-into-other",
    "10.5.2",
    W,
    "a message flow leads into an event that does not wait for a message",
    "give the event a messageEventDefinition, or delete the flow",
)
FROM_OTHER = Rule(
    10561,
    "message-flow-from-other",
    "10.5.3",
    W,
    "a message flow leads out of an event that does not send a message",
    "give the event a messageEventDefinition, or delete the flow",
)
OTHER_MESSAGE = Rule(
    9403,
    "message-flow-message",
    "9.4",
    W,
    "the message flow carries another message than its end sends or receives",
    "name the same message in both",
)
_ENDS = ACTIVITIES | EVENTS | names("participant conversation subConversation callConversation")


def _flow(tree: Tree, element: etree._Element) -> None:
    source = tree.find(element, element.get("sourceRef", ""))
    target = tree.find(element, element.get("targetRef", ""))
    for end in (source, target):
        if end is not None and end.tag not in _ENDS:
            tree.say(END, element, f"{what(end)} is {a(kind(end.tag))}")
        if end is not None:
            _carries(tree, element, end)
    if source is None or target is None:
        return  # which a reader has said
    if source.tag in CATCHING:
        tree.say(FROM_CATCH, element, f"{what(source)} is one")
    elif source.tag in THROWING and not has_trigger(tree, source, "message"):
        tree.say(FROM_OTHER, element, what(source))
    if target.tag in THROWING:
        tree.say(INTO_THROW, element, f"{what(target)} is one")
    elif target.tag in CATCHING and not has_trigger(tree, target, "message"):
        tree.say(INTO_OTHER, element, what(target))
    homes = {_pool(tree, source), _pool(tree, target)}
    if len(homes) == 1 and None not in homes:
        tree.say(INSIDE, element, f"both ends are in '{homes.pop()}'")


def _carries(tree: Tree, flow: etree._Element, end: etree._Element) -> None:
    """Report a flow whose message is none of those that one of its ends names."""
    message = tree.find(flow, flow.get("messageRef", ""))
    own = [end] if end.tag in ACTIVITIES else triggers(tree, end) if end.tag in EVENTS else []
    named = [tree.find(each, each.get("messageRef", "")) for each in own]
    known = [each for each in named if each is not None]
    if message is not None and known and message not in known:
        tree.say(OTHER_MESSAGE, flow, f"{what(message)} is not {what(known[0])} of {what(end)}")


def _pool(tree: Tree, element: etree._Element) -> str | None:
    """The id of the process in which an element stands, or which a pool shows."""
    if name_of(element) == "participant":
        name = element.get("processRef", "").rpartition(":")[2]
        return name or None
    if element.tag not in NODES:
        return None
    process = next(element.iterancestors(BPMN + "process"), None)
    return None if process is None else process.get("id")


TOPIC = Topic(declared(globals()), {"messageFlow": _flow})
