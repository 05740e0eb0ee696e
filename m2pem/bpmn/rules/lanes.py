"""Lanes: which flow nodes are in them (BPMN 2.0.2, 10.8)."""

from lxml import etree

from m2pem.bpmn.names import BPMN, a, kind
from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import NODES, Tree, children, what

NODE_TWICE = Rule(
    10801,
    "lane-node-twice",
    "10.8",
    W,
    "an element is in two lanes of one lane set",
    "keep it in one",
)
OTHER_PROCESS = Rule(
    10802,
    "lane-other-process",
    "10.8",
    W,
    "the lane lists an element of another process",
    "list elements of its own process only",
)
NO_NODE = Rule(
    10803,
    "lane-no-node",
    "10.8",
    W,
    "the lane lists what is no activity, gateway or event",
    "delete the flowNodeRef",
)


def _lane_set(tree: Tree, element: etree._Element) -> None:
    first: dict[str, etree._Element] = {}
    process = next(element.iterancestors(BPMN + "process"), None)
    for lane in children(element, "lane"):
        for reference in children(lane, "flowNodeRef"):
            name = (reference.text or "").strip()
            before = first.setdefault(name, lane)
            if before is not lane:
                tree.say(NODE_TWICE, reference, f"'{name}' is in {what(before)}, too")
            node = tree.find(reference, name)
            if node is None:
                continue
            if node.tag not in NODES:
                tree.say(NO_NODE, reference, f"'{name}' is {a(kind(node.tag))}")
            elif next(node.iterancestors(BPMN + "process"), None) is not process:
                tree.say(OTHER_PROCESS, reference, f"'{name}'")


TOPIC = Topic(declared(globals()), {"laneSet": _lane_set, "childLaneSet": _lane_set})
