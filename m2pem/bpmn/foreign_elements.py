"""Elements and attributes of other engines: what becomes of each in a mission.

Most are harmless: they say who may see a task, how a job is retried, how a form looks. Some m2pem
carries out, as it has the same. The others change what is executed, so that without them another
branch may be taken: of these it warns each time, with what to write instead.
"""

from m2pem.bpmn.xml import ACTIVITI, CAMUNDA, FLOWABLE, ZEEBE

ENGINES = (ZEEBE, CAMUNDA, FLOWABLE, ACTIVITI)
"""Namespaces of the engines whose elements are known."""

_CALLS = 'list each value: <m2pem:in source="a.b" target="x"/> and <m2pem:out .../>'
_WRITES = "if it writes data, write that in a script task before or after: name = expression"
_SERVICE = 'let a service of a plugin decide: <m2pem:service class="..."/>'
_RESULT = "let a service or a script task write it: name = expression"
_DECISIONS = 'ask for it: <m2pem:prompt store="name">...?</m2pem:prompt> with m2pem:decision'
_PROPERTIES = '<m2pem:property name="..." value="..."/> for each, beside the service'

CARRIED_OUT = frozenset(
    {
        "adHoc", "calledElement", "input", "inputOutput", "inputParameter", "ioMapping",
        "loopCharacteristics", "output", "outputParameter", "script", "subscription",
        "taskDefinition",
    }
)  # fmt: skip
"""Elements that say what m2pem does, too (docs/missions.md)."""

HARMLESS = frozenset(
    {
        "assignmentDefinition", "constraint", "failedJobRetryTimeCycle", "formDefinition",
        "linkedResource", "linkedResources", "listener", "parameter", "potentialStarter",
        "priorityDefinition", "properties", "property", "taskSchedule", "userTask",
        "userTaskForm", "versionTag",
    }
)  # fmt: skip
"""Elements without an effect on what is executed, or with a finding of their own."""

CHANGING = {
    "calledDecision": ("the decision is not evaluated", _SERVICE),
    "conditionalFilter": (
        "the condition is evaluated after any name of the data was written",
        "add what it filters to the condition",
    ),
    "connector": ("the connector is not called", _SERVICE),
    "errorEventDefinition": (
        "a failure of the task is not turned into that error",
        "let the service fail with that code",
    ),
    "eventInParameter": ("nothing is passed with the event", "send a message with data inputs"),
    "eventListener": ("the listener is not called", _WRITES),
    "eventOutParameter": ("nothing of the event is stored", "receive a message with data outputs"),
    "executionListener": ("the listener is not called", _WRITES),
    "executionListeners": ("the listeners are not called", _WRITES),
    "field": ("the field is not passed", _PROPERTIES),
    "formData": ("the form is not shown, and its fields and defaults are not written", _DECISIONS),
    "formProperty": ("the form is not shown, and its default is not written", _DECISIONS),
    "in": ("nothing is passed: it is no call activity", "write it in a script task before it"),
    "mapException": (
        "an exception is not turned into that error",
        "let the service fail with that code",
    ),
    "out": ("nothing is passed: it is no call activity", "write it in a script task after it"),
    "taskHeaders": ("the headers are not passed", _PROPERTIES),
    "taskListener": ("the listener is not called", _WRITES),
    "taskListeners": ("the listeners are not called", _WRITES),
    "variableAggregation": (
        "the values of the instances are not collected",
        "collect them by loopDataOutputRef and outputDataItem",
    ),
    "variableListener": ("the listener is not called", _WRITES),
}
"""Elements that change what is executed: what becomes of them, and what to write instead."""

NOT_OF_A_CALL = ("nothing is passed by it into or out of the called process", _CALLS)
"""What becomes of `camunda:inputOutput` on a call activity."""

_RESULT_ATTRIBUTES = ("resultVariable", "resultVariableName")

CHANGING_ATTRIBUTES = {
    **dict.fromkeys(_RESULT_ATTRIBUTES, ("the result is not stored", _RESULT)),
    "decisionRef": ("the decision is not evaluated", _SERVICE),
    "decisionTableReferenceKey": ("the decision is not evaluated", _SERVICE),
    "errorVariableName": (
        "the error is not stored",
        'camunda:errorCodeVariable="name" stores its code, camunda:errorMessageVariable its reason',
    ),
    "idVariableName": ("the variable is not written", "delete it"),
    "inheritVariables": ("nothing passes that is not listed", _CALLS),
    "initiator": (
        "no one who starts a mission is stored",
        "give it with --data, or let a service write it",
    ),
    "resource": ("the file of the script is not read", "write the script into the element"),
    "skipExpression": (
        "the task is not skipped",
        "draw a gateway before it, with a flow around it",
    ),
    "terminateAll": (
        "its own scope ends, and no other",
        "throw an error that the outer one catches",
    ),
    "triggerable": (
        "the task does not wait for a trigger after it",
        "draw a receive task after it",
    ),
    "variableMappingClass": ("nothing passes that is not listed", _CALLS),
    "variableMappingDelegateExpression": ("nothing passes that is not listed", _CALLS),
    "variableName": (
        "the condition is evaluated after any name of the data was written",
        "add what it filters to the condition",
    ),
}
"""Attributes that change what is executed, as `CHANGING`; with the value "false" they do not."""

EXPRESSIONS = ("feel", "juel")
"""Formats of scripts that are one expression, whose value a result variable gets."""

AD_HOC_OUTPUT = (
    "the values of the activities are not collected",
    "write them in script tasks: name = expression",
)
"""What becomes of an `outputCollection` of `zeebe:adHoc`."""

PROPAGATES = ("propagateAllParentVariables", "propagateAllChildVariables")
"""Attributes of `zeebe:calledElement` that are true where they are left out."""

PROPAGATES_REMEDY = f'{_CALLS}; {PROPAGATES[0]}="false" and {PROPAGATES[1]}="false" say so'
