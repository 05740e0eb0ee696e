"""Activities: tasks, calls, and who does them (BPMN 2.0.2, 8.4.12, 8.5, 10.3.1 and 10.3.3)."""

from lxml import etree

from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import Check, Checks, Tree, children, has, is_true, names, texts

error, warning = family("10.3.1")

BAD_SCRIPT = error(
    202,
    "a script is neither statements nor a behavior",
    "see missions.md",
)
SCRIPT_LANGUAGE = error(
    203,
    "a script is in a language that m2pem does not run",
    "write statements",
)
MAPPING_SOURCE = error(
    215,
    "a mapping of a call activity has no source",
    'write a name or an expression, for example source="mission.speed"',
)
PASSES_EVERYTHING = error(
    216,
    "a call activity passes all its data",
    "list each value",
)
FOREIGN_FORM = warning(
    316,
    "a form of Camunda's is not shown to operators",
    "write the question as m2pem:prompt and m2pem:decision",
)
DECISION_VALUE = error(
    217,
    "a decision has no value, or that of another",
    "give each its own value",
)
AMBIGUOUS_CALL = error(
    223,
    "several files have the process that a call activity names",
    "name the file's namespace in calledElement, or take one out of the search path",
)
EMPTY_SCRIPT = warning(
    302,
    "a script task has no script",
    "give it a behavior, or make it a plain task",
)
CALL_RECURSION = warning(
    310,
    "a process can call itself",
    "make sure that a decision before the call can end it",
)
START_QUANTITY = error(
    10301,
    "startQuantity is no whole number from 1",
    "write how many tokens begin the activity, or delete it",
    clause="10.3",
)
COMPLETION_QUANTITY = error(
    10302,
    "completionQuantity is no whole number from 1",
    "write how many tokens leave the activity, or delete it",
    clause="10.3",
)
NO_CALLED_ELEMENT = error(
    10321,
    "a call activity does not say what it calls",
    "name a process in calledElement",
    clause="10.3.6",
)

RESOURCE_NAME = warning(
    8461,
    "the resource has no name",
    "give it the name by which it is known",
    clause="8.4.12",
)
RESOURCE_PARAMETER_NAME = warning(
    8462,
    "the resource's parameter has no name",
    "give the resourceParameter a name",
    clause="8.4.12",
)
INTERFACE_NAME = warning(8501, "the interface has no name", "give it a name", clause="8.5.1")
INTERFACE_OPERATIONS = warning(
    8502,
    "the interface has no operation",
    "add an operation, or delete the interface",
    clause="8.5.1",
)
OPERATION_NAME = warning(8503, "the operation has no name", "give it a name", clause="8.5.3")
OPERATION_IN_MESSAGE = warning(
    8504,
    "the operation's inMessageRef names no message",
    "name the message that the operation takes",
    clause="8.5.3",
)
ROLE_NAMED_TWICE = warning(
    10304,
    "the role has both a resourceRef and a resourceAssignmentExpression",
    "keep one of the two",
)
ROLE_BINDINGS = warning(
    10305,
    "the role binds parameters of a resource but names no resource",
    "add resourceRef, or delete the resourceParameterBinding",
)
ROLE_PARAMETER = warning(
    10306,
    "the role's parameterRef names no parameter of a resource",
    "name a resourceParameter",
)
ROLE_EXPRESSION = warning(
    10307,
    "the role's resourceAssignmentExpression has no expression",
    "write the expression that says who it is",
)


def _has_name(rule: Rule) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        if not element.get("name"):
            tree.report(rule, element)

    return check


def _interface(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.report(INTERFACE_NAME, element)
    if not has(element, "operation"):
        tree.report(INTERFACE_OPERATIONS, element)


def _operation(tree: Tree, element: etree._Element) -> None:
    if not element.get("name"):
        tree.report(OPERATION_NAME, element)
    messages = texts(element, "inMessageRef") or [""]
    if tree.leads_nowhere(element, messages[0], names("message")):
        tree.report(OPERATION_IN_MESSAGE, element, f"'{messages[0]}'")


def _role(tree: Tree, element: etree._Element) -> None:
    by_name = has(element, "resourceRef")
    if by_name and has(element, "resourceAssignmentExpression"):
        tree.report(ROLE_NAMED_TWICE, element)
    if not by_name and has(element, "resourceParameterBinding"):
        tree.report(ROLE_BINDINGS, element)


def _binding(tree: Tree, element: etree._Element) -> None:
    name = element.get("parameterRef", "")
    if tree.leads_nowhere(element, name, names("resourceParameter")):
        tree.report(ROLE_PARAMETER, element, f"'{name}'")


def _expression(tree: Tree, element: etree._Element) -> None:
    if not has(element, "expression formalExpression"):
        tree.report(ROLE_EXPRESSION, element)


SERVICES = Checks(
    {
        "resource": _has_name(RESOURCE_NAME),
        "resourceParameter": _has_name(RESOURCE_PARAMETER_NAME),
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


SERVICE_DATA = warning(
    10312,
    "a service task must not have several input sets or output sets",
    "keep one inputSet and one outputSet",
    clause="10.3.3",
)
SEND_DATA = warning(
    10313,
    "a send task must not have several data inputs or input sets",
    "keep the dataInput that the message is made of",
    clause="10.3.3",
)
RECEIVE_DATA = warning(
    10314,
    "a receive task must not have several data outputs or output sets",
    "keep the dataOutput that takes the message",
    clause="10.3.3",
)
RECEIVE_BEGINS = error(
    10315,
    "a receive task that begins a process must not have an incoming flow",
    'delete the flow, or instantiate="true"',
    clause="10.3.3",
)


def _at_most_one(rule: Rule, *names: str) -> Check:
    """A task's ioSpecification has no more than one element of each of the names."""

    def check(tree: Tree, element: etree._Element) -> None:
        for specification in children(element, "ioSpecification"):
            if any(len(list(children(specification, name))) > 1 for name in names):
                tree.report(rule, element)

    return check


_receives = _at_most_one(RECEIVE_DATA, "dataOutput", "outputSet")


def _receive(tree: Tree, element: etree._Element) -> None:
    _receives(tree, element)
    if is_true(element, "instantiate") and tree.into(element):
        tree.report(RECEIVE_BEGINS, element)


CHECKS = Checks(
    {
        "serviceTask": _at_most_one(SERVICE_DATA, "inputSet", "outputSet"),
        "sendTask": _at_most_one(SEND_DATA, "dataInput", "inputSet"),
        "receiveTask": _receive,
    },
)
