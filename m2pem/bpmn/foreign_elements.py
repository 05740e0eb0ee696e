"""Elements and attributes of other engines: what becomes of each in a mission.

Most are harmless: they say who may see a task, how a job is retried, how a form looks. Some m2pem
carries out, as it has the same. The others change what is executed, so that without them another
branch may be taken: of these it warns each time, with what to write instead.
"""

from m2pem.bpmn.xml import ACTIVITI, BPMN, CAMUNDA, FLOWABLE, JBPM, ZEEBE

ENGINES = (ZEEBE, CAMUNDA, FLOWABLE, ACTIVITI, JBPM)
"""Namespaces of the engines whose elements are known."""

_CALLS = 'list each value: <m2pem:in source="a.b" target="x"/> and <m2pem:out .../>'
_WRITES = "if it writes data, write that in a script task before or after: name = expression"
_SERVICE = 'let a service of a plugin decide: <m2pem:service class="..."/>'
_RESULT = "let a service or a script task write it: name = expression"
_DECISIONS = 'ask for it: <m2pem:prompt store="name">...?</m2pem:prompt> with m2pem:decision'
_PROPERTIES = '<m2pem:property name="..." value="..."/> for each, beside the service'

HARMLESS = frozenset(
    {
        "adHoc", "assignmentDefinition", "calledElement", "constraint", "failedJobRetryTimeCycle",
        "formDefinition", "input", "inputOutput", "inputParameter", "ioMapping", "linkedResource",
        "linkedResources", "listener", "loopCharacteristics", "metaData", "output",
        "outputParameter", "parameter", "potentialStarter", "priorityDefinition", "properties",
        "property", "script", "subscription", "taskDefinition", "taskSchedule", "userTask",
        "userTaskForm", "versionTag",
    }
)  # fmt: skip
"""Elements that m2pem carries out (docs/missions.md), that do not change what is executed, or that
have a finding of their own."""

_LISTENER = ("the listener is not called", _WRITES)
_FORM = ("the form is not shown, and its fields and defaults are not written", _DECISIONS)
_FAILURE = (
    "a failure of the task is not turned into that error",
    "let the service fail with that code",
)
_DECISION = ("the decision is not evaluated", _SERVICE)
_LISTED = ("nothing passes that is not listed", _CALLS)
_FILTER = (
    "the condition is evaluated after any name of the data was written",
    "add what it filters to the condition",
)

CHANGING = {
    **dict.fromkeys(("eventListener", "variableListener"), _LISTENER),
    **dict.fromkeys(("executionListener", "executionListeners"), _LISTENER),
    **dict.fromkeys(("taskListener", "taskListeners"), _LISTENER),
    **dict.fromkeys(("onEntry-script", "onExit-script"), ("the script is not run", _WRITES)),
    **dict.fromkeys(("formData", "formProperty"), _FORM),
    **dict.fromkeys(("errorEventDefinition", "mapException"), _FAILURE),
    **dict.fromkeys(("field", "taskHeaders"), ("it is not passed to the service", _PROPERTIES)),
    "calledDecision": _DECISION,
    "conditionalFilter": _FILTER,
    "connector": ("the connector is not called", _SERVICE),
    "eventInParameter": ("nothing is passed with the event", "send a message with data inputs"),
    "eventOutParameter": ("nothing of the event is stored", "receive a message with data outputs"),
    "in": ("nothing is passed: it is no call activity", "write it in a script task before it"),
    "out": ("nothing is passed: it is no call activity", "write it in a script task after it"),
    "variableAggregation": (
        "the values of the instances are not collected",
        "collect them by loopDataOutputRef and outputDataItem",
    ),
}
"""Elements that change what is executed: what becomes of them, and what to write instead."""

SERVING = frozenset({BPMN + "serviceTask", BPMN + "businessRuleTask"})
"""What does the work of a class or job of another engine."""

NOT_SERVING = ("the worker is not called", _SERVICE)
"""What becomes of a class or job at any other element."""

COMPUTED = ("it is read as it stands, and not evaluated", "write an element for each value")
"""What becomes of an expression in the name or code of a signal, message, error or escalation."""

COUNTED = ("loopCounter is 0 in the first instance here, and 1 there", "write loopCounter + 1")
"""What becomes of `loopCounter` in an activity with `zeebe:loopCharacteristics`."""

NOT_OF_A_CALL = ("nothing is passed by it into or out of the called process", _CALLS)
"""What becomes of `camunda:inputOutput` on a call activity."""

_VARIABLES = (
    "idVariableName", "processInstanceIdVariableName", "taskCompleterVariableName",
    "taskIdVariableName",
)  # fmt: skip
CHANGING_ATTRIBUTES = {
    **dict.fromkeys(("resultVariable", "resultVariableName"), ("it is not stored", _RESULT)),
    **dict.fromkeys(("decisionRef", "decisionTableReferenceKey"), _DECISION),
    **dict.fromkeys(("inheritVariables", "variableMappingClass"), _LISTED),
    **dict.fromkeys(("class", "delegateExpression", "expression", "type"), NOT_SERVING),
    **dict.fromkeys(("formKey", "formRef"), _FORM),
    **dict.fromkeys(_VARIABLES, ("it is not written", "delete it")),
    "businessCalendarName": ("every day counts", "write the times as a cron text"),
    "endDate": (
        "the cycle does not end then",
        "write R3/START/PERIOD, or R/PERIOD/END, in ISO 8601",
    ),
    "elementIndexVariable": ("it is not written", "read loopCounter, which counts from 0"),
    "variableMappingDelegateExpression": _LISTED,
    "variableName": _FILTER,
    "errorVariableName": (
        "the error is not stored",
        'camunda:errorCodeVariable="name" stores its code, camunda:errorMessageVariable its reason',
    ),
    "initiator": (
        "no one who starts a mission is stored",
        "give it with --data, or let a service write it",
    ),
    "resource": ("the file of the script is not read", "write the script into the element"),
    "skipExpression": ("the task is not skipped", "draw a gateway and a flow around the task"),
    "terminateAll": (
        "its own scope ends, and no other",
        "throw an error that the outer one catches",
    ),
    "triggerable": ("the task does not wait for a trigger", "draw a receive task after it"),
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
