"""Attributes, their values, and the children of elements (BPMN 2.0.2, tables of 8 and 10; 15.3)."""

from collections.abc import Collection

from lxml import etree

from m2pem.bpmn.extensions import ATTRIBUTES
from m2pem.bpmn.rules.rule import Rule, family
from m2pem.bpmn.rules.tree import Check, Checks, Tree, is_true, name_of, parent
from m2pem.bpmn.schema import Shape, shape
from m2pem.bpmn.xml import BPMN, a, attribute_names, kind, local
from m2pem.suggestions import nearest, suggest_or

error, warning = family("15.3")

BAD_EXPRESSION = error(
    201,
    "a text is no expression of the condition language",
    "see conditions.md",
)
ELEMENT_ORDER = warning(
    15302,
    "an element comes after one that BPMN's schema has behind it",
    "move it up; some editors refuse the file",
)
UNKNOWN_ATTRIBUTE = warning(
    15303,
    "BPMN has no such attribute there",
    "delete it, or give it its namespace",
)
UNKNOWN_ELEMENT = warning(
    15304,
    "BPMN has no such element there (an error in a process, where it might be part of the flow)",
    "delete it, or give it its namespace",
)
BAD_VALUE = error(
    15308,
    "the value of an attribute is none that it can have",
    "write one of its values",
)
MISSPELLED_ATTRIBUTE = warning(
    15309,
    "BPMN has no such attribute there, but one with a name like it",
    "correct the name; until then the attribute has no effect",
)

ITEM_KIND = warning(
    8441,
    "the item definition's itemKind is none that BPMN has",
    "write Information or Physical",
    clause="8.4.10",
)
PROCESS_TYPE = warning(
    10101,
    "the process's type is none that BPMN has",
    "write None, Public or Private",
    clause="10.1",
)
PUBLIC_EXECUTABLE = warning(
    10102,
    "a public process must not be executable",
    'write processType="Private", or isExecutable="false"',
    clause="10.1",
)
BAD_TRUTH = warning(
    15305,
    "an attribute without an effect on execution is neither true nor false",
    "write true or false",
)
REPEATED_ELEMENT = warning(
    15307,
    "the element appears here a second time",
    "keep one",
)
_TRUTHS = {
    "process": "isClosed isExecutable",
    "collaboration": "isClosed",
    "dataObject": "isCollection",
    "dataInput": "isCollection",
    "dataOutput": "isCollection",
    "itemDefinition": "isCollection",
    "dataStore": "isUnlimited",
    "resourceParameter": "isRequired",
    "extension": "mustUnderstand",
}
_ONCE = (
    "extensionElements ioSpecification conditionExpression script activationCondition "
    "completionCondition loopCondition loopCardinality loopDataInputRef loopDataOutputRef "
    "inputDataItem outputDataItem condition participantMultiplicity correlationKeyRef text "
    "childLaneSet messagePath dataPath dataState transformation auditing monitoring"
)


def unknown_attribute(
    element: etree._Element, name: str, known: Collection[str]
) -> tuple[Rule, str, str]:
    """The rule, message and remedy; `known` are the names that BPMN has there.

    A name that is like a known one is a rule of its own (`misspelled-attribute`): whoever wrote it
    expects an effect that it does not have.
    """
    message = f"BPMN has no attribute '{name}' for {a(kind(element.tag))}; it is ignored"
    own = ATTRIBUTES.get(local(element.tag), frozenset())
    match = f"m2pem:{name}" if name in own else nearest(name, known)
    if not match and (owned := nearest(name, own)):
        match = f"m2pem:{owned}"
    if match:
        return MISSPELLED_ATTRIBUTE, message, f"did you mean '{match}'?"
    return UNKNOWN_ATTRIBUTE, message, "delete it, or give it its namespace"


def _truth(attributes: str) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        for name in attributes.split():
            text = element.get(name, "true").strip()
            if text not in ("true", "false", "1", "0"):
                tree.report(BAD_TRUTH, element, f"{name} is '{text}'")

    return check


def _item(tree: Tree, element: etree._Element) -> None:
    value = element.get("itemKind", "Information").strip()
    if value not in ("Information", "Physical"):
        tree.report(ITEM_KIND, element, f"'{value}'")


def _process(tree: Tree, element: etree._Element) -> None:
    value = element.get("processType", "None").strip()
    if value not in ("None", "Public", "Private"):
        tree.report(PROCESS_TYPE, element, f"'{value}'")
    if value == "Public" and is_true(element, "isExecutable"):
        tree.report(PUBLIC_EXECUTABLE, element)


def _once(tree: Tree, element: etree._Element) -> None:
    if tree.has_one_before(element):
        owner = kind(parent(element).tag)
        tree.report(REPEATED_ELEMENT, element, f"'{name_of(element)}' in {a(owner)}")


VALUES = Checks(
    {"itemDefinition": _item, "process": _process, **dict.fromkeys(_ONCE.split(), _once)},
)
TRUTHS = Checks({name: _truth(each) for name, each in _TRUTHS.items()})


# The table of `schema.py` for the elements of BPMN that no reader looks into.
_BASE = "documentation extensionElements"
_ROLE = f"{_BASE} resourceRef resourceParameterBinding resourceAssignmentExpression"
_ASSOCIATION = f"{_BASE} sourceRef targetRef transformation assignment"
_CALLABLE = f"{_BASE} supportedInterfaceRef ioSpecification ioBinding"
_ROLES = "resourceRole|performer|humanPerformer|potentialOwner"
_NODES = "conversation|subConversation|callConversation"
_EXPRESSION = ("id language evaluatesToTypeRef", _BASE)
_CONVERSATION = f"{_BASE} participantRef messageFlowRef correlationKey"

_TABLE: dict[str, tuple[str, str]] = {
    "import": ("namespace location importType", ""),
    "extension": ("definition mustUnderstand", "documentation"),
    "relationship": ("id type direction", f"{_BASE} source target"),
    "documentation": ("id textFormat", ""),
    "category": ("id name", f"{_BASE} categoryValue"),
    "categoryValue": ("id value", _BASE),
    "group": ("id categoryValueRef", _BASE),
    "textAnnotation": ("id textFormat", f"{_BASE} text"),
    "itemDefinition": ("id structureRef isCollection itemKind", _BASE),
    "interface": ("id name implementationRef", f"{_BASE} operation"),
    "operation": (
        "id name implementationRef",
        f"{_BASE} inMessageRef outMessageRef errorRef",
    ),
    "endPoint": ("id", _BASE),
    "resource": ("id name", f"{_BASE} resourceParameter"),
    "resourceParameter": ("id name type isRequired", _BASE),
    "resourceRole": ("id name", _ROLE),
    "performer": ("id name", _ROLE),
    "humanPerformer": ("id name", _ROLE),
    "potentialOwner": ("id name", _ROLE),
    "resourceParameterBinding": ("id parameterRef", f"{_BASE} expression|formalExpression"),
    "resourceAssignmentExpression": ("id", f"{_BASE} expression|formalExpression"),
    "correlationProperty": (
        "id name type",
        f"{_BASE} correlationPropertyRetrievalExpression",
    ),
    "correlationPropertyRetrievalExpression": ("id messageRef", f"{_BASE} messagePath"),
    "correlationKey": ("id name", f"{_BASE} correlationPropertyRef"),
    "correlationSubscription": (
        "id correlationKeyRef",
        f"{_BASE} correlationPropertyBinding",
    ),
    "correlationPropertyBinding": ("id correlationPropertyRef", f"{_BASE} dataPath"),
    "collaboration": (
        "id name isClosed",
        f"{_BASE} participant messageFlow artifact|association|group|textAnnotation {_NODES}"
        " conversationAssociation participantAssociation messageFlowAssociation correlationKey"
        " choreographyRef conversationLink",
    ),
    "participantMultiplicity": ("id minimum maximum", _BASE),
    "participantAssociation": ("id", f"{_BASE} innerParticipantRef outerParticipantRef"),
    "messageFlowAssociation": (
        "id innerMessageFlowRef outerMessageFlowRef",
        _BASE,
    ),
    "conversationAssociation": (
        "id innerConversationNodeRef outerConversationNodeRef",
        _BASE,
    ),
    "conversation": ("id name", _CONVERSATION),
    "subConversation": ("id name", f"{_CONVERSATION} {_NODES}"),
    "callConversation": (
        "id name calledCollaborationRef",
        f"{_CONVERSATION} participantAssociation",
    ),
    "conversationLink": ("id name sourceRef targetRef", _BASE),
    "partnerEntity": ("id name", f"{_BASE} participantRef"),
    "partnerRole": ("id name", f"{_BASE} participantRef"),
    "ioSpecification": ("id", f"{_BASE} dataInput dataOutput inputSet outputSet"),
    "ioBinding": ("id operationRef inputDataRef outputDataRef", _BASE),
    "dataInput": ("id name itemSubjectRef isCollection", f"{_BASE} dataState"),
    "dataOutput": ("id name itemSubjectRef isCollection", f"{_BASE} dataState"),
    "dataState": ("id name", _BASE),
    "inputSet": (
        "id name",
        f"{_BASE} dataInputRefs optionalInputRefs whileExecutingInputRefs outputSetRefs",
    ),
    "outputSet": (
        "id name",
        f"{_BASE} dataOutputRefs optionalOutputRefs whileExecutingOutputRefs inputSetRefs",
    ),
    "dataInputAssociation": ("id", _ASSOCIATION),
    "dataOutputAssociation": ("id", _ASSOCIATION),
    "assignment": ("id", f"{_BASE} from to"),
    "loopCondition": _EXPRESSION,
    "loopCardinality": _EXPRESSION,
    "rendering": ("id", _BASE),
    "auditing": ("id", _BASE),
    "monitoring": ("id", _BASE),
    "globalTask": ("id name", f"{_CALLABLE} {_ROLES}"),
    "globalManualTask": ("id name", f"{_CALLABLE} {_ROLES}"),
    "globalUserTask": ("id name implementation", f"{_CALLABLE} {_ROLES} rendering"),
    "globalScriptTask": ("id name scriptLanguage", f"{_CALLABLE} {_ROLES} script"),
    "globalBusinessRuleTask": ("id name implementation", f"{_CALLABLE} {_ROLES}"),
}


def _check(expected: Shape) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        for key in attribute_names(element):
            if key[0] != "{" and key not in expected.attributes:
                rule, _, right = unknown_attribute(element, key, expected.attributes)
                tree.report(
                    rule, element, f"'{key}' of {a(kind(element.tag))}; it is ignored", right
                )
        _children(tree, element, expected)

    return check


def _children(tree: Tree, element: etree._Element, expected: Shape) -> None:
    reached, last = -1, ""
    for child in element:
        rank = expected.ranks.get(child.tag)
        if rank is None:
            if child.tag.startswith(BPMN):
                tree.report(
                    UNKNOWN_ELEMENT,
                    child,
                    f"'{local(child.tag)}' in {a(kind(element.tag))}; it is ignored",
                    suggest_or(
                        local(child.tag),
                        [local(each) for each in expected.ranks],
                        UNKNOWN_ELEMENT.right,
                    ),
                )
        elif rank >= reached:
            reached, last = rank, child.tag
        else:
            tree.report(
                ELEMENT_ORDER,
                child,
                f"'{local(child.tag)}' after '{local(last)}'",
                f"move it before the first '{local(last)}'; some editors refuse the file",
            )
            return


SHAPES = Checks(
    {name: _check(shape(*row)) for name, row in _TABLE.items()},
)
