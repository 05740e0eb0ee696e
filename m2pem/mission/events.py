"""Event definitions and the root elements they refer to (BPMN 2.0.2, clauses 8.4 and 10.5.5)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.mission.expression import Expression


@dataclass(frozen=True, slots=True)
class RootElement:
    """An element of `definitions` that event definitions refer to by id."""

    id: str
    name: str
    line: int
    file: str = field(init=False, repr=False, compare=False, default="")
    """The file that declares it; "" for one that an event of the mission's own file made up."""


@dataclass(frozen=True, slots=True)
class Signal(RootElement):
    """A broadcast (clause 10.5.5). `from_operator`: operators are expected to send it.

    `returned`: the resource whose return by an operator throws it; "" for none.
    """

    from_operator: bool = False
    returned: str = ""


@dataclass(frozen=True, slots=True)
class Message(RootElement):
    """Something sent to one receiver (clause 8.4.11). `from_operator` as for signals.

    `correlation_key`: what sender and receiver must agree on, each by its own data; None: nothing.
    """

    from_operator: bool = False
    correlation_key: Expression | None = None


@dataclass(frozen=True, slots=True)
class CorrelationProperty(RootElement):
    """What messages are matched by (clause 8.4.2).

    `retrieve`: by message id, where a message carries it, as an expression over what it carries.
    """

    retrieve: Mapping[str, Expression]


@dataclass(frozen=True, slots=True)
class Error(RootElement):
    """An error with which an activity may fail (clause 8.4.8). `code` defaults to the id."""

    code: str = ""


@dataclass(frozen=True, slots=True)
class Escalation(RootElement):
    """A non-critical notice to an outer scope (clause 8.4.8). `code` defaults to the id."""

    code: str = ""


@dataclass(frozen=True, slots=True)
class EventDefinition:
    """The trigger or the result of an event."""

    line: int


@dataclass(frozen=True, slots=True)
class SignalEventDefinition(EventDefinition):
    signal: Signal


@dataclass(frozen=True, slots=True)
class MessageEventDefinition(EventDefinition):
    message: Message


@dataclass(frozen=True, slots=True)
class ErrorEventDefinition(EventDefinition):
    """`error` None catches every error; a throw always names one.

    `code_variable`, `message_variable`: the names of data that get the code and the reason of what
    is caught, "" for none.
    """

    error: Error | None
    code_variable: str = ""
    message_variable: str = ""


@dataclass(frozen=True, slots=True)
class EscalationEventDefinition(EventDefinition):
    """`escalation` None catches every escalation; a throw always names one. `code_variable` as for
    errors."""

    escalation: Escalation | None
    code_variable: str = ""


def error_code(definition: EventDefinition) -> str | None:
    """Return the code that an error definition catches, "" for all; None: it catches no error."""
    if not isinstance(definition, ErrorEventDefinition):
        return None
    return definition.error.code if definition.error is not None else ""


def escalation_code(definition: EventDefinition) -> str | None:
    """Return the code that an escalation definition catches, as `error_code` does."""
    if not isinstance(definition, EscalationEventDefinition):
        return None
    return definition.escalation.code if definition.escalation is not None else ""


def signals_and_messages(definitions: Iterable[EventDefinition]) -> list[Signal | Message]:
    """Return the signals and messages that event definitions name, in their order."""
    found: list[Signal | Message] = []
    for each in definitions:
        if isinstance(each, SignalEventDefinition):
            found.append(each.signal)
        elif isinstance(each, MessageEventDefinition):
            found.append(each.message)
    return found


def caught_data(event: Sequence[EventDefinition], code: str, reason: str = "") -> dict[str, str]:
    """What an event that catches an error or escalation writes, by name: its code, its reason."""
    found = {}
    for each in event:
        if isinstance(each, ErrorEventDefinition | EscalationEventDefinition):
            found[each.code_variable] = code
        if isinstance(each, ErrorEventDefinition):
            found[each.message_variable] = reason
    return {name: value for name, value in found.items() if name}


class TimerKind(StrEnum):
    """The three ways to say when (BPMN 2.0.2, table 10.101)."""

    DATE = "timeDate"
    DURATION = "timeDuration"
    CYCLE = "timeCycle"


@dataclass(frozen=True, slots=True)
class TimerEventDefinition(EventDefinition):
    """`expression` gives a text that `m2pem.mission.timers` reads."""

    kind: TimerKind
    expression: Expression


@dataclass(frozen=True, slots=True)
class TerminateEventDefinition(EventDefinition):
    """Ends its own scope at once (clause 13.5.6)."""


@dataclass(frozen=True, slots=True)
class ConditionalEventDefinition(EventDefinition):
    """Triggered when the condition becomes true (table 10.95)."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class LinkEventDefinition(EventDefinition):
    """Joins a source to the target of the same name in one container (table 10.98)."""

    name: str


@dataclass(frozen=True, slots=True)
class CancelEventDefinition(EventDefinition):
    """Cancels a transaction, or catches that it was cancelled (clause 10.5.6)."""


@dataclass(frozen=True, slots=True)
class CompensateEventDefinition(EventDefinition):
    """Undoes completed activities (table 10.94, clause 13.5.5).

    `activity`: the id of the one to undo, "" for all of the scope. `wait`: the throwing event
    waits until that is done.
    """

    activity: str = ""
    wait: bool = True
