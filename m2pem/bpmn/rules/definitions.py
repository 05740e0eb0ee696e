"""Definitions, imports, relationships, ids and artifacts (BPMN 2.0.2, 8.2 to 8.4.1)."""

from lxml import etree

from m2pem.bpmn.rules.rule import family
from m2pem.bpmn.rules.tree import Checks, Tree, is_true, texts, what
from m2pem.bpmn.xml import BPMN, kind

error, warning = family("8.3.1")

MISSING_ID = warning(
    8301,
    "an element that others could refer to has no id; m2pem makes one up",
    "give it an id that nothing else in the file has, so that others can name it",
)
DUPLICATE_ID = error(
    8302,
    "two elements have the same id",
    "give one of the two another id, and its references too",
)

NO_TARGET_NAMESPACE = warning(
    8201,
    "definitions has no targetNamespace",
    'add one, for example targetNamespace="urn:my-missions"',
    clause="8.2.1",
)
IMPORT_TYPE = warning(
    8202,
    "the import does not say of which type the imported file is",
    "add importType with the namespace of the file's format",
    clause="8.2.2",
)
IMPORT_NAMESPACE = warning(
    8203,
    "the import does not say which namespace it imports",
    "add the targetNamespace of the imported file as namespace",
    clause="8.2.2",
)
DUPLICATE_INNER_ID = warning(
    8303,
    "the id is also that of another element",
    "give one of the two another id",
)
EXTENSION_NOT_UNDERSTOOD = warning(
    8304,
    "the file says that an extension must be understood, and m2pem does not know it",
    'write mustUnderstand="false" if the mission means the same without it',
    clause="8.3.3",
)
RELATIONSHIP_TYPE = warning(
    8305,
    "the relationship has no type",
    "add the type, or delete the relationship",
    clause="8.3.4",
)
RELATIONSHIP_ENDS = warning(
    8306,
    "the relationship lacks a source or a target",
    "add source and target, or delete the relationship",
    clause="8.3.4",
)
RELATIONSHIP_DIRECTION = warning(
    8307,
    "the relationship's direction is none that BPMN has",
    "write None, Forward, Backward or Both",
    clause="8.3.4",
)
ASSOCIATION_END = warning(
    8401,
    "the association lacks a sourceRef or a targetRef",
    "add what it joins, or delete it",
    clause="8.4.1",
)
ASSOCIATION_NOWHERE = warning(
    8402,
    "an end of the association names nothing",
    "name an element of the file, or delete the association",
    clause="8.4.1",
)
ASSOCIATION_DIRECTION = warning(
    8403,
    "the association's direction is none that BPMN has",
    "write None, One or Both",
    clause="8.4.1",
)

_INNER = (
    "ioSpecification dataInput dataOutput inputSet outputSet dataInputAssociation "
    "dataOutputAssociation standardLoopCharacteristics multiInstanceLoopCharacteristics "
    "resourceRole performer humanPerformer potentialOwner itemDefinition interface operation "
    "endPoint resource association group textAnnotation category categoryValue "
    "cancelEventDefinition compensateEventDefinition conditionalEventDefinition "
    "errorEventDefinition escalationEventDefinition linkEventDefinition messageEventDefinition "
    "signalEventDefinition terminateEventDefinition timerEventDefinition correlationProperty "
    "correlationKey conversation subConversation callConversation conversationLink partnerRole "
    "partnerEntity"
)


def _definitions(tree: Tree, element: etree._Element) -> None:
    if not element.get("targetNamespace"):
        tree.report(NO_TARGET_NAMESPACE, element)


def _import(tree: Tree, element: etree._Element) -> None:
    if not element.get("importType"):
        tree.report(IMPORT_TYPE, element)
    if not element.get("namespace"):
        tree.report(IMPORT_NAMESPACE, element)


def _extension(tree: Tree, element: etree._Element) -> None:
    if is_true(element, "mustUnderstand"):
        tree.report(EXTENSION_NOT_UNDERSTOOD, element, f"'{element.get('definition', '')}'")


def _relationship(tree: Tree, element: etree._Element) -> None:
    if not element.get("type"):
        tree.report(RELATIONSHIP_TYPE, element)
    if not texts(element, "source") or not texts(element, "target"):
        tree.report(RELATIONSHIP_ENDS, element)
    direction = element.get("direction", "None")
    if direction not in ("None", "Forward", "Backward", "Both"):
        tree.report(RELATIONSHIP_DIRECTION, element, f"'{direction}'")


def _association(tree: Tree, element: etree._Element) -> None:
    ends = [element.get("sourceRef", ""), element.get("targetRef", "")]
    if not all(ends):
        tree.report(ASSOCIATION_END, element)
    for end in ends:
        if end and tree.leads_nowhere(element, end, _anything(tree, element, end)):
            tree.report(ASSOCIATION_NOWHERE, element, f"'{end}'")
    direction = element.get("associationDirection", "None")
    if direction not in ("None", "One", "Both"):
        tree.report(ASSOCIATION_DIRECTION, element, f"'{direction}'")


def _anything(tree: Tree, owner: etree._Element, name: str) -> frozenset[str]:
    found = tree.find(owner, name)
    return frozenset() if found is None else frozenset({found.tag})


def _inner_ids(tree: Tree) -> None:
    """Ids that no reader claims; flow nodes, flows and root elements are claimed there."""
    seen: dict[str, etree._Element] = {}
    for element in _inner(tree):
        identifier = element.get("id")
        if not identifier:
            continue
        first = seen.setdefault(identifier, element)
        if first is not element:
            detail = f"{what(element)}, of a {kind(first.tag)}"
            tree.report(DUPLICATE_INNER_ID, element, detail, unless=(DUPLICATE_ID,))


def _inner(tree: Tree) -> list[etree._Element]:
    """All elements whose ids only this module looks at."""
    return list(tree.root.iter(*(BPMN + name for name in _INNER.split())))


CHECKS = Checks(
    {
        "definitions": _definitions,
        "import": _import,
        "extension": _extension,
        "relationship": _relationship,
        "association": _association,
    },
    (_inner_ids,),
)
