"""Which attributes and children BPMN 2.0.2 gives each element that m2pem reads, and their order.

From the standard's XML schemas (Semantic.xsd). A group of names joined by `|` may come in any
order among themselves; groups come in the order written. `INSIDE` also distinguishes names that
BPMN does not know from those that m2pem does not execute.
"""

from dataclasses import dataclass

from m2pem.bpmn.xml import BPMN

_BASE = "documentation extensionElements"
_FLOW_ELEMENT = f"{_BASE} auditing monitoring categoryValueRef"
_NODE = f"{_FLOW_ELEMENT} incoming outgoing"
_RESOURCES = "resourceRole|performer|humanPerformer|potentialOwner"
_LOOPS = "loopCharacteristics|standardLoopCharacteristics|multiInstanceLoopCharacteristics"
_ACTIVITY = (
    f"{_NODE} ioSpecification property dataInputAssociation dataOutputAssociation"
    f" {_RESOURCES} {_LOOPS}"
)
_DEFINITIONS = (
    "eventDefinition|cancelEventDefinition|compensateEventDefinition|conditionalEventDefinition"
    "|errorEventDefinition|escalationEventDefinition|linkEventDefinition|messageEventDefinition"
    "|signalEventDefinition|terminateEventDefinition|timerEventDefinition"
)
_CATCH = (
    f"{_NODE} property dataOutput dataOutputAssociation outputSet {_DEFINITIONS} eventDefinitionRef"
)
_THROW = (
    f"{_NODE} property dataInput dataInputAssociation inputSet {_DEFINITIONS} eventDefinitionRef"
)
_EVENTS = "boundaryEvent|endEvent|event|intermediateCatchEvent|intermediateThrowEvent|startEvent"
_EVENTS += "|implicitThrowEvent"
_TASKS = (
    "businessRuleTask|callActivity|manualTask|receiveTask|scriptTask|sendTask|serviceTask|task"
    "|userTask"
)
_SUBPROCESSES = "adHocSubProcess|subProcess|transaction"
_GATEWAYS = "complexGateway|eventBasedGateway|exclusiveGateway|inclusiveGateway|parallelGateway"
_CHOREOGRAPHY = "callChoreography|choreographyTask|subChoreography"
_DATA = "dataObject|dataObjectReference|dataStoreReference"
FLOW_ELEMENTS = (
    f"{_EVENTS}|{_TASKS}|{_SUBPROCESSES}|{_GATEWAYS}|{_CHOREOGRAPHY}|{_DATA}|sequenceFlow"
)
_ARTIFACTS = "artifact|association|group|textAnnotation"
_ROOTS = (
    "category|collaboration|choreography|globalChoreographyTask|conversation|globalConversation"
    "|correlationProperty|dataStore|endPoint|error|escalation|globalBusinessRuleTask"
    "|globalManualTask|globalScriptTask|globalTask|globalUserTask|interface|itemDefinition|message"
    f"|partnerEntity|partnerRole|process|resource|rootElement|signal|{_DEFINITIONS}"
)

_GLOBAL = f"{_BASE} supportedInterfaceRef ioSpecification ioBinding {_RESOURCES}"
_ACTIVITY_ATTRIBUTES = "id name isForCompensation startQuantity completionQuantity default"

_TABLE: dict[str, tuple[str, str]] = {
    "definitions": (
        "id name targetNamespace expressionLanguage typeLanguage exporter exporterVersion",
        f"import extension {_ROOTS} BPMNDiagram relationship",
    ),
    "process": (
        "id name definitionalCollaborationRef processType isClosed isExecutable",
        f"{_BASE} supportedInterfaceRef ioSpecification ioBinding auditing monitoring property"
        f" laneSet {FLOW_ELEMENTS} {_ARTIFACTS} {_RESOURCES} correlationSubscription supports",
    ),
    "subProcess": (
        f"{_ACTIVITY_ATTRIBUTES} triggeredByEvent",
        f"{_ACTIVITY} laneSet {FLOW_ELEMENTS} {_ARTIFACTS}",
    ),
    "transaction": (
        f"{_ACTIVITY_ATTRIBUTES} triggeredByEvent method",
        f"{_ACTIVITY} laneSet {FLOW_ELEMENTS} {_ARTIFACTS}",
    ),
    "adHocSubProcess": (
        f"{_ACTIVITY_ATTRIBUTES} triggeredByEvent cancelRemainingInstances ordering",
        f"{_ACTIVITY} laneSet {FLOW_ELEMENTS} {_ARTIFACTS} completionCondition",
    ),
    "task": (_ACTIVITY_ATTRIBUTES, _ACTIVITY),
    "manualTask": (_ACTIVITY_ATTRIBUTES, _ACTIVITY),
    "userTask": (f"{_ACTIVITY_ATTRIBUTES} implementation", f"{_ACTIVITY} rendering"),
    "scriptTask": (f"{_ACTIVITY_ATTRIBUTES} scriptFormat", f"{_ACTIVITY} script"),
    # `class` is m2pem's own (docs/missions.md), the rest BPMN's.
    "serviceTask": (f"{_ACTIVITY_ATTRIBUTES} implementation operationRef class", _ACTIVITY),
    "sendTask": (f"{_ACTIVITY_ATTRIBUTES} implementation operationRef messageRef", _ACTIVITY),
    "receiveTask": (
        f"{_ACTIVITY_ATTRIBUTES} implementation operationRef messageRef instantiate",
        _ACTIVITY,
    ),
    "businessRuleTask": (f"{_ACTIVITY_ATTRIBUTES} implementation", _ACTIVITY),
    "callActivity": (f"{_ACTIVITY_ATTRIBUTES} calledElement", _ACTIVITY),
    "globalTask": ("id name", _GLOBAL),
    "globalBusinessRuleTask": ("id name implementation", _GLOBAL),
    "globalManualTask": ("id name", _GLOBAL),
    "globalScriptTask": ("id name scriptLanguage", f"{_GLOBAL} script"),
    "globalUserTask": ("id name implementation", f"{_GLOBAL} rendering"),
    "exclusiveGateway": ("id name gatewayDirection default", _NODE),
    "inclusiveGateway": ("id name gatewayDirection default", _NODE),
    "parallelGateway": ("id name gatewayDirection", _NODE),
    "complexGateway": ("id name gatewayDirection default", f"{_NODE} activationCondition"),
    "eventBasedGateway": ("id name gatewayDirection instantiate eventGatewayType", _NODE),
    "startEvent": ("id name isInterrupting parallelMultiple", _CATCH),
    "intermediateCatchEvent": ("id name parallelMultiple", _CATCH),
    "boundaryEvent": ("id name parallelMultiple attachedToRef cancelActivity", _CATCH),
    "endEvent": ("id name", _THROW),
    "intermediateThrowEvent": ("id name", _THROW),
    "sequenceFlow": (
        "id name sourceRef targetRef isImmediate",
        f"{_FLOW_ELEMENT} conditionExpression",
    ),
    "dataObject": ("id name itemSubjectRef isCollection", f"{_FLOW_ELEMENT} dataState"),
    "dataObjectReference": ("id name itemSubjectRef dataObjectRef", f"{_FLOW_ELEMENT} dataState"),
    "dataStoreReference": ("id name itemSubjectRef dataStoreRef", f"{_FLOW_ELEMENT} dataState"),
    "dataStore": ("id name capacity isUnlimited itemSubjectRef", f"{_BASE} dataState"),
    "property": ("id name itemSubjectRef", f"{_BASE} dataState"),
    "signal": ("id name structureRef", _BASE),
    "message": ("id name itemRef", _BASE),
    "error": ("id name errorCode structureRef", _BASE),
    "escalation": ("id name escalationCode structureRef", _BASE),
    "signalEventDefinition": ("id signalRef", _BASE),
    "messageEventDefinition": ("id messageRef", f"{_BASE} operationRef"),
    "errorEventDefinition": ("id errorRef", _BASE),
    "escalationEventDefinition": ("id escalationRef", _BASE),
    "timerEventDefinition": ("id", f"{_BASE} timeDate|timeDuration|timeCycle"),
    "terminateEventDefinition": ("id", _BASE),
    "cancelEventDefinition": ("id", _BASE),
    "compensateEventDefinition": ("id activityRef waitForCompletion", _BASE),
    "conditionalEventDefinition": ("id", f"{_BASE} condition"),
    "linkEventDefinition": ("id name", f"{_BASE} source target"),
    "condition": ("id language evaluatesToTypeRef", _BASE),
    "activationCondition": ("id language evaluatesToTypeRef", _BASE),
    "completionCondition": ("id language evaluatesToTypeRef", _BASE),
    "conditionExpression": ("id language evaluatesToTypeRef", _BASE),
    "timeDate": ("id language evaluatesToTypeRef", _BASE),
    "timeDuration": ("id language evaluatesToTypeRef", _BASE),
    "timeCycle": ("id language evaluatesToTypeRef", _BASE),
    "association": ("id sourceRef targetRef associationDirection", _BASE),
    "standardLoopCharacteristics": ("id testBefore loopMaximum", f"{_BASE} loopCondition"),
    "multiInstanceLoopCharacteristics": (
        "id isSequential behavior oneBehaviorEventRef noneBehaviorEventRef",
        f"{_BASE} loopCardinality loopDataInputRef loopDataOutputRef inputDataItem outputDataItem"
        " complexBehaviorDefinition completionCondition",
    ),
    "complexBehaviorDefinition": ("id", f"{_BASE} condition event"),
    "event": ("id name", _THROW),
    "inputDataItem": ("id name itemSubjectRef isCollection", f"{_BASE} dataState"),
    "outputDataItem": ("id name itemSubjectRef isCollection", f"{_BASE} dataState"),
    "participant": (
        "id name processRef",
        f"{_BASE} interfaceRef endPointRef participantMultiplicity",
    ),
    "messageFlow": ("id name sourceRef targetRef messageRef", _BASE),
    "laneSet": ("id name", f"{_BASE} lane"),
    "lane": (
        "id name partitionElementRef",
        f"{_BASE} partitionElement flowNodeRef childLaneSet",
    ),
}


@dataclass(frozen=True, slots=True)
class Shape:
    """The allowed plain attributes of one element, and the rank of each child's tag."""

    attributes: frozenset[str]
    ranks: dict[str, int]


def shape(attributes: str, children: str) -> Shape:
    """The shape of an element by the names of its attributes and children, in order."""
    ranks = {
        BPMN + name: rank
        for rank, group in enumerate(children.split())
        for name in group.split("|")
    }
    return Shape(frozenset(attributes.split()), ranks)


SHAPES: dict[str, Shape] = {BPMN + name: shape(*row) for name, row in _TABLE.items()}
"""By tag; an element that is not here is not looked into."""

SHAPES[BPMN + "childLaneSet"] = SHAPES[BPMN + "laneSet"]

FLOW_ELEMENT_NAMES = frozenset(FLOW_ELEMENTS.split("|"))
"""Local names of flow elements of a process or subprocess."""

ROOT_NAMES = frozenset(_ROOTS.split("|"))
"""Local names of the children of `definitions`."""
