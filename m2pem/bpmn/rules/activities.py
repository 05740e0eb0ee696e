"""Tasks: their data, and receive tasks that begin a process (BPMN 2.0.2, 10.3.3)."""

from lxml import etree

from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, children, is_true

SERVICE_DATA = Rule(
    10312,
    "service-data",
    "10.3.3",
    W,
    "a service task must not have several input sets or output sets",
    "keep one inputSet and one outputSet",
)
SEND_DATA = Rule(
    10313,
    "send-data",
    "10.3.3",
    W,
    "a send task must not have several data inputs or input sets",
    "keep the dataInput that the message is made of",
)
RECEIVE_DATA = Rule(
    10314,
    "receive-data",
    "10.3.3",
    W,
    "a receive task must not have several data outputs or output sets",
    "keep the dataOutput that takes the message",
)
RECEIVE_BEGINS = Rule(
    10315,
    "receive-begins",
    "10.3.3",
    E,
    "a receive task that begins a process must not have an incoming flow",
    'delete the flow, or instantiate="true"',
)


def _service(tree: Tree, element: etree._Element) -> None:
    for specification in children(element, "ioSpecification"):
        inputs = list(children(specification, "inputSet"))
        if len(inputs) > 1 or len(list(children(specification, "outputSet"))) > 1:
            tree.say(SERVICE_DATA, element)


def _send(tree: Tree, element: etree._Element) -> None:
    for specification in children(element, "ioSpecification"):
        inputs = list(children(specification, "dataInput"))
        if len(inputs) > 1 or len(list(children(specification, "inputSet"))) > 1:
            tree.say(SEND_DATA, element)


def _receive(tree: Tree, element: etree._Element) -> None:
    for specification in children(element, "ioSpecification"):
        outputs = list(children(specification, "dataOutput"))
        if len(outputs) > 1 or len(list(children(specification, "outputSet"))) > 1:
            tree.say(RECEIVE_DATA, element)
    if is_true(element, "instantiate") and tree.into(element):
        tree.say(RECEIVE_BEGINS, element)


TOPIC = Topic(
    declared(globals()),
    {"serviceTask": _service, "sendTask": _send, "receiveTask": _receive},
)
