"""Attributes and order of the elements that no reader looks into (BPMN 2.0.2, 15.3).

The table is that of the readers (`schema.py`) for the rest of BPMN.
"""

from lxml import etree

from m2pem.bpmn.names import BPMN, a, attribute_names, kind, local
from m2pem.bpmn.rules.reader_rules import (
    ELEMENT_ORDER,
    MISSPELLED_ATTRIBUTE,
    UNKNOWN_ATTRIBUTE,
    UNKNOWN_ELEMENT,
)
from m2pem.bpmn.rules.rule import Check, Topic
from m2pem.bpmn.rules.tree import Tree
from m2pem.bpmn.schema import Shape, shape
from m2pem.bpmn.unknown import unknown_attribute
from m2pem.mission.near import did_you_mean

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
                slug, _, right = unknown_attribute(element, key, expected.attributes)
                rule = UNKNOWN_ATTRIBUTE if slug == UNKNOWN_ATTRIBUTE.slug else MISSPELLED_ATTRIBUTE
                tree.say(rule, element, f"'{key}' of {a(kind(element.tag))}; it is ignored", right)
        _children(tree, element, expected)

    return check


def _children(tree: Tree, element: etree._Element, expected: Shape) -> None:
    reached, last = -1, ""
    for child in element:
        rank = expected.ranks.get(child.tag)
        if rank is None:
            if child.tag.startswith(BPMN):
                tree.say(
                    UNKNOWN_ELEMENT,
                    child,
                    f"'{local(child.tag)}' in {a(kind(element.tag))}; it is ignored",
                    did_you_mean(
                        local(child.tag),
                        [local(each) for each in expected.ranks],
                        UNKNOWN_ELEMENT.right,
                    ),
                )
        elif rank >= reached:
            reached, last = rank, child.tag
        else:
            tree.say(
                ELEMENT_ORDER,
                child,
                f"'{local(child.tag)}' after '{local(last)}'",
                f"move it before the first '{local(last)}'; some editors refuse the file",
            )
            return


TOPIC = Topic(
    (),
    {name: _check(shape(*row)) for name, row in _TABLE.items()},
)
