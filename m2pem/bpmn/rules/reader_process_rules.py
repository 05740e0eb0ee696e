"""BPMN's rules of processes (chapter 10) that the readers hold.

Their findings bear these slugs; `registry` gives them their numbers.
"""

from m2pem.bpmn.rules.rule import E, Rule, Topic, W, declared

START_QUANTITY = Rule(
    10301,
    "start-quantity",
    "10.3",
    E,
    "startQuantity is no whole number from 1",
    "write how many tokens begin the activity, or delete it",
)
COMPLETION_QUANTITY = Rule(
    10302,
    "completion-quantity",
    "10.3",
    E,
    "completionQuantity is no whole number from 1",
    "write how many tokens leave the activity, or delete it",
)
NO_CALLED = Rule(
    10321,
    "no-called-element",
    "10.3.6",
    E,
    "a call activity does not say what it calls",
    "name a process in calledElement",
)
TYPED_START = Rule(
    10331,
    "typed-start-in-subprocess",
    "10.3.5",
    E,
    "a start event in an embedded subprocess waits for something",
    "use a plain start event, and a catching intermediate event after it",
)
LOOP_PLACE = Rule(
    10336,
    "loop-not-allowed",
    "10.3.5",
    E,
    "an event subprocess has a loop marker",
    "delete it, or put it on an activity inside",
)
AD_HOC_ORDERING = Rule(
    10355,
    "ad-hoc-ordering",
    "10.3.5",
    E,
    "the ad-hoc subprocess's ordering is none that BPMN has",
    "write Parallel or Sequential",
)
TWO_LOOPS = Rule(
    10371,
    "two-loops",
    "10.3.8",
    E,
    "an activity has two loop markers",
    "keep one; put the activity into a subprocess that has the other",
)
LOOP_MAXIMUM = Rule(
    10372,
    "loop-maximum",
    "10.3.8",
    E,
    "loopMaximum is no whole number",
    "write the number of rounds at most, or delete it",
)
INSTANCE_COUNT = Rule(
    10374,
    "instance-count",
    "10.3.8",
    E,
    "a multi-instance activity does not say how many instances there are",
    "add a loopCardinality or a collection",
)
COUNTED_TWICE = Rule(
    10375,
    "instances-counted-twice",
    "10.3.8",
    E,
    "a multi-instance activity has both a loopCardinality and a collection",
    "keep one of the two",
)
BEHAVIOR = Rule(
    10376,
    "instances-behavior",
    "10.3.8",
    E,
    "the multi-instance behavior is none that BPMN has",
    "write None, One, All or Complex",
)
COMPLEX_BEHAVIOR = Rule(
    10381,
    "complex-behavior",
    "10.3.8",
    E,
    "a complexBehaviorDefinition lacks its condition or its event",
    "say when something is thrown, and what",
)
NO_LOOP = Rule(
    10386,
    "no-loop",
    "10.3.8",
    E,
    "a loop marker does not say which kind of loop",
    "write standardLoopCharacteristics or multiInstanceLoopCharacteristics",
)
THROWN = Rule(
    10387,
    "event-not-allowed",
    "10.3.8",
    E,
    "a multi-instance activity throws by itself what it cannot",
    "let it throw a message, signal, escalation, error or compensation",
)
ASSIGNMENT = Rule(
    10424,
    "bad-assignment",
    "10.4.1",
    E,
    "an assignment of a data association lacks from or to",
    "write both",
)
NO_TRIGGER = Rule(
    10507,
    "no-trigger",
    "10.5.4",
    E,
    "a catching intermediate event, a boundary event or the start event of an event subprocess has "
    "no trigger",
    "give it an event definition",
)
ERROR_GOES_ON = Rule(
    10508,
    "error-not-interrupting",
    "10.5.4",
    E,
    "a boundary or start event that catches an error does not interrupt",
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
NO_CONDITION = Rule(
    10533,
    "no-condition",
    "10.5.5",
    E,
    "a conditional event has no condition",
    "write the condition that it waits for",
)
LINK_NAME = Rule(
    10541,
    "link-name",
    "10.5.5",
    E,
    "a link event has no name",
    "give both of its ends the same name",
)
LINK_TARGET = Rule(
    10542,
    "dangling-link",
    "10.5.4",
    E,
    "no catching link event has the name of a throwing one",
    "add a catching intermediate event with a link of this name",
)
LINK_TARGETS = Rule(
    10543,
    "duplicate-link",
    "10.5.4",
    E,
    "two catching link events have the same name",
    "give one another name",
)
LINK_OUTGOING = Rule(
    10545,
    "link-throw-outgoing",
    "10.5.4",
    E,
    "a sequence flow leads out of a throwing link event",
    "let it begin at what follows the link target",
)
LINK_INCOMING = Rule(
    10546,
    "link-catch-incoming",
    "10.5.4",
    E,
    "a sequence flow leads into a catching link event",
    "lead it to what follows the link target",
)
LINK_BORDER = Rule(
    10547,
    "link-crosses-border",
    "10.5.5",
    E,
    "a link leads out of its process or subprocess",
    "put both of its ends into the same process or subprocess",
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

TOPIC = Topic(declared(globals()), {})
