"""BPMN's rules that the readers hold: what they find on the way while they read.

Their findings bear these slugs; `registry` gives them their numbers.
"""

from m2pem.model.bpmn.rules.rule import E, Rule, Topic, W, declared

FLOW_INTO_START = Rule(
    7601,
    "flow-into-start",
    "7.6.2",
    E,
    "a sequence flow leads into a start event",
    "lead it to what follows the start event",
)
FLOW_INTO_BOUNDARY = Rule(
    7602,
    "flow-into-boundary",
    "7.6.2",
    E,
    "a sequence flow leads into a boundary event",
    "lead it to the activity, or to what follows the boundary event",
)
FLOW_OUT_OF_END = Rule(
    7603,
    "flow-out-of-end",
    "7.6.2",
    E,
    "a sequence flow leads out of an end event",
    "make it an intermediate throw event, or delete the flow",
)
CROSSING = Rule(
    7604,
    "flow-crosses-border",
    "7.6.2",
    E,
    "a sequence flow crosses the border of a subprocess or pool",
    "let it lead from or to the subprocess itself; between pools, draw a message flow",
)
MISSING_ID = Rule(
    8301,
    "missing-id",
    "8.3.1",
    E,
    "an element to which others refer has no id",
    "give it an id that nothing else in the file has",
)
DUPLICATE_ID = Rule(
    8302,
    "duplicate-id",
    "8.3.1",
    E,
    "two elements have the same id",
    "give one of the two another id, and its references too",
)
CONDITION_PLACE = Rule(
    8471,
    "condition-not-allowed",
    "8.4.13",
    E,
    "a flow out of an event has a condition",
    "put an exclusive gateway behind the event",
)
CONDITION_IGNORED = Rule(
    8472,
    "condition-ignored",
    "8.4.13",
    W,
    "a flow out of a parallel gateway has a condition",
    "delete the condition, or make the gateway inclusive",
)
DEFAULT_CONDITION = Rule(
    8473,
    "default-with-condition",
    "8.4.13",
    W,
    "the default flow has a condition",
    "delete the condition, or make another flow the default",
)
DEFAULT_NOT_OWN = Rule(
    8474,
    "default-not-own",
    "8.4.13",
    E,
    "the default flow leaves another element",
    "name one of its own outgoing sequence flows",
)
EMPTY_CONDITION = Rule(
    8475,
    "empty-condition",
    "8.4.13",
    W,
    "a conditionExpression is empty",
    "write the condition, or delete the conditionExpression",
)
TYPED_START = Rule(
    10331,
    "typed-start-in-subprocess",
    "10.3.5",
    E,
    "a start event in an embedded subprocess waits for something",
    "use a plain start event, and a catching intermediate event after it",
)
NO_CALLED = Rule(
    10321,
    "no-called-element",
    "10.3.6",
    E,
    "a call activity does not say what it calls",
    "name a process in calledElement",
)
NO_TRIGGER = Rule(
    10507,
    "no-trigger",
    "10.5.4",
    E,
    "a catching intermediate event or a boundary event has no trigger",
    "give it an event definition",
)
ERROR_GOES_ON = Rule(
    10508,
    "error-not-interrupting",
    "10.5.4",
    E,
    "a boundary event that catches an error does not interrupt",
    "make it interrupting, or throw and catch an escalation",
)
ATTACHMENT = Rule(
    10519,
    "bad-attachment",
    "10.5.4",
    E,
    "a boundary event is attached to no activity beside it",
    "attach it to an activity of the same process or subprocess",
)
TIMER = Rule(
    10531,
    "timer-time",
    "10.5.5",
    E,
    "a timer has no time, several, or one that is no ISO 8601",
    "give it one timeDuration, timeDate or timeCycle",
)
MISSING_REFERENCE = Rule(
    10532,
    "missing-reference",
    "10.5.5",
    W,
    "an event or task names no message, signal, error or escalation",
    "add messageRef, signalRef, errorRef or escalationRef",
)
RETRIEVAL_MESSAGE = Rule(
    8412,
    "retrieval-message",
    "8.4.2",
    E,
    "the retrieval expression's messageRef names no message",
    "name the message from which the value is read",
)
RETRIEVAL_PATH = Rule(
    8413,
    "retrieval-path",
    "8.4.2",
    E,
    "the retrieval expression has no messagePath",
    "write the expression that gives the value",
)
BINDING_PROPERTY = Rule(
    8417,
    "binding-property",
    "8.4.2",
    E,
    "the correlation binding's correlationPropertyRef names no correlation property",
    "name a correlationProperty that stands in definitions",
)
BINDING_PATH = Rule(
    8418,
    "binding-path",
    "8.4.2",
    E,
    "the correlation binding has no dataPath",
    "write the expression that gives the value in the process",
)
START_QUANTITY = Rule(
    10301,
    "start-quantity",
    "10.3",
    E,
    "startQuantity is no whole number from 1 (a warning for 0, which counts as 1)",
    "write how many tokens begin the activity, or delete it",
)
COMPLETION_QUANTITY = Rule(
    10302,
    "completion-quantity",
    "10.3",
    E,
    "completionQuantity is no whole number from 1 (a warning for 0, which counts as 1)",
    "write how many tokens leave the activity, or delete it",
)
AD_HOC_ORDERING = Rule(
    10355,
    "ad-hoc-ordering",
    "10.3.5",
    E,
    "the ad-hoc subprocess's ordering is none that BPMN has",
    "write Parallel or Sequential",
)
ASSIGNMENT = Rule(
    10424,
    "bad-assignment",
    "10.4.1",
    E,
    "an assignment of a data association lacks from or to",
    "write both",
)
ACTIVATION = Rule(
    10605,
    "no-activation-condition",
    "10.6.5",
    W,
    "a complex gateway does not say when it is activated",
    "add an activationCondition",
)
PARALLEL_EVENTS = Rule(
    10618,
    "parallel-event-gateway",
    "10.6.6",
    E,
    "an event-based gateway that does not begin a process cannot be parallel",
    "use a parallel gateway before the events",
)
NO_START = Rule(
    13201,
    "no-start",
    "13.2",
    E,
    "nothing in a process or subprocess can start",
    "add a start event",
)
UNREACHABLE = Rule(
    13202,
    "unreachable",
    "13.2",
    E,
    "no start event, and nothing else that begins, leads to an element",
    "draw a sequence flow to it, or delete it",
)
DANGLING = Rule(
    15301,
    "dangling-reference",
    "15.3.2",
    E,
    "a reference names nothing, or nothing of the right kind (a warning where it has no effect on "
    "execution: pools, lanes, message flows, data)",
    "name an element that is there",
)
ELEMENT_ORDER = Rule(
    15302,
    "element-order",
    "15.3",
    W,
    "an element comes after one that BPMN's schema has behind it",
    "move it up; some editors refuse the file",
)
UNKNOWN_ATTRIBUTE = Rule(
    15303,
    "unknown-attribute",
    "15.3",
    W,
    "BPMN has no such attribute there",
    "delete it, or give it its namespace",
)
UNKNOWN_ELEMENT = Rule(
    15304,
    "unknown-element",
    "15.3",
    W,
    "BPMN has no such element there (an error in a process, where it might be part of the flow)",
    "delete it, or give it its namespace",
)
BAD_VALUE = Rule(
    15308,
    "bad-value",
    "15.3",
    E,
    "the value of an attribute is none that it can have",
    "write one of its values",
)

TOPIC = Topic(declared(globals()), {})
