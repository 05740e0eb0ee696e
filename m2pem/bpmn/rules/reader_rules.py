"""BPMN's rules that the readers hold: ids, references, flows, where elements stand.

Their findings bear these slugs; `registry` gives them their numbers.
"""

from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared

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
    W,
    "an element that others could refer to has no id; m2pem makes one up",
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
NO_START = Rule(
    13201,
    "no-start",
    "13.2",
    E,
    "nothing in a process or subprocess can start, or an event subprocess has no start event",
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
MISSPELLED_ATTRIBUTE = Rule(
    15309,
    "misspelled-attribute",
    "15.3",
    W,
    "BPMN has no such attribute there, but one with a name like it",
    "correct the name; until then the attribute has no effect",
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
