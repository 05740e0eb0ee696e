"""Interfaces, operations and resources, and who does a task (BPMN 2.0.2, 8.4.12, 8.5, 10.3.1)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, Topic, W, declared
from m2pem.bpmn.rules.tree import Tree, has, names, texts

RESOURCE_NAME = Rule(
    8461,
    "resource-name",
    "8.4.12",
    W,
    "the resource has no name",
    "give it the name by which it is known",
)
RESOURCE_PARAMETER = Rule(
    8462,
    "resource-parameter-name",
    "8.4.12",
    W,
    "the resource's parameter has no name",
    "give the resourceParameter a name",
)
INTERFACE_NAME = Rule(
    8501, "interface-name", "8.5.1", W, "the interface has no name", "give it a name"
)
INTERFACE_OPERATIONS = Rule(
    8502,
    "interface-operations",
    "8.5.1",
    W,
    "the interface has no operation",
    "add an operation, or delete the interface",
)
OPERATION_NAME = Rule(
    8503, "operation-name", "8.5.3", W, "the operation has no name", "give it a name"
)
IN_MESSAGE = Rule(
    8504,
    "operation-in-message",
    "8.5.3",
    W,
    "the operation's inMessageRef names no message",
    "name the message that the operation takes",
)
RESOURCE_AND_EXPRESSION = Rule(
    10304,
    "role-named-twice",
    "10.3.1",
    W,
    "the role has both a resourceRef and a resourceAssignmentExpression",
    "keep one of the two",
)
BINDINGS = Rule(
    10305,
    "role-bindings",
    "10.3.1",
    W,
    "the role binds parameters of a resource but names no resource",
    "add resourceRef, or delete the resourceParameterBinding",
)
BINDING_PARAMETER = Rule(
    10306,
    "role-parameter",
    "10.3.1",
    W,
    "the role's parameterRef names no parameter of a resource",
    "name a resourceParameter",
)
ASSIGNMENT = Rule(
    10307,
    "role-expression",
    "10.3.1",
    W,
    "the role's resourceAssignmentExpression has no expression",
    "write the expression that says who it is",
)


def _resource(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.say(RESOURCE_NAME, element)


def _parameter(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.say(RESOURCE_PARAMETER, element)


def _interface(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.say(INTERFACE_NAME, element)
    if not has(element, "operation"):
        tree.say(INTERFACE_OPERATIONS, element)


def _operation(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.say(OPERATION_NAME, element)
    messages = texts(element, "inMessageRef") or [""]
    if tree.leads_nowhere(element, messages[0], names("message")):
        tree.say(IN_MESSAGE, element, f"'{messages[0]}'")


def _role(tree: Tree, element: etree._Element) -> None:
    by_name = has(element, "resourceRef")
    if by_name and has(element, "resourceAssignmentExpression"):
        tree.say(RESOURCE_AND_EXPRESSION, element)
    if not by_name and has(element, "resourceParameterBinding"):
        tree.say(BINDINGS, element)


def _binding(tree: Tree, element: etree._Element) -> None:
    name = element.get("parameterRef", "")
    if tree.leads_nowhere(element, name, names("resourceParameter")):
        tree.say(BINDING_PARAMETER, element, f"'{name}'")


def _expression(tree: Tree, element: etree._Element) -> None:
    if not has(element, "expression formalExpression"):
        tree.say(ASSIGNMENT, element)


TOPIC = Topic(
    declared(globals()),
    {
        "resource": _resource,
        "resourceParameter": _parameter,
        "interface": _interface,
        "operation": _operation,
        "resourceRole": _role,
        "performer": _role,
        "humanPerformer": _role,
        "potentialOwner": _role,
        "resourceParameterBinding": _binding,
        "resourceAssignmentExpression": _expression,
    },
)
