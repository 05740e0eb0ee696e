"""Records about data, and about events that are awaited and thrown."""

import msgspec

from m2pem.engine.records.base import BaseRecord, Trigger
from m2pem.mission.values import Value


class DataWritten(BaseRecord, frozen=True):
    """`store` is the scope that holds the key; `scope` and `element` say where it was written.

    `own`: the token whose activity holds it instead (an item variable, a data input); 0: none.
    """

    token: int
    process: str
    element: str
    scope: int
    key: str
    value: Value
    store: int
    own: int = 0


class EventAwaited(BaseRecord, frozen=True):
    """A catch event is armed: `ref` is a signal's or message's id, or the text of a condition;
    `due_us` a timer's time.

    `token` 0: it is the start event of an event subprocess, or begins another process when a
    condition becomes true or a timer is due, and `scope` waits. `spent`: the condition has fired,
    and must be seen false (`ConditionReset`) before it can again.

    A duration or cycle is due at a mission time (microseconds from the start, which stops during
    a pause); a date (`calendar`) at a time since the Unix epoch. `left`: how often a cycle still
    fires after this one (-1: for ever); `cycle`: its period or cron text, as
    `m2pem.mission.timers.Round` has it. `armed_us`: the mission time from which a duration counts.
    """

    token: int
    process: str
    element: str
    scope: int
    wait: int
    trigger: Trigger
    ref: str = ""
    due_us: int = 0
    calendar: bool = False
    left: int = 0
    cycle: str = ""
    spent: bool = False
    armed_us: int | None = None


class EventTriggered(BaseRecord, frozen=True):
    """An awaited event has occurred; the wait is over.

    `kept`: it took a kept message, the `letter`-th (from 0) of that message id.
    """

    wait: int
    kept: bool = False
    letter: int = 0


class ConditionReset(BaseRecord, frozen=True):
    """A condition that had fired has become false: it can fire again."""

    wait: int


class SignalThrown(BaseRecord, frozen=True):
    """A signal was thrown by an element with `data`, or by an operator (`by`)."""

    signal: str
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    by: str = ""
    data: dict[str, Value] = msgspec.field(default_factory=dict)


class MessageThrown(BaseRecord, frozen=True):
    """A message was thrown by an element, or by an operator (`by`).

    `kept`: no receiver waits for it yet, so its `data` is kept for the next one. `keys`: its
    correlation keys (clause 8.4.2).
    """

    message: str
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    by: str = ""
    kept: bool = False
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    keys: dict[str, Value] = msgspec.field(default_factory=dict)


class EscalationThrown(BaseRecord, frozen=True):
    """An escalation was thrown. `caught_by`: the event that catches it, "": none, and the run goes
    on."""

    token: int
    process: str
    element: str
    scope: int
    escalation: str
    code: str
    caught_by: str = ""


class ErrorThrown(BaseRecord, frozen=True):
    """An error was thrown. `caught_by`: the event that catches it, "": none, and the run fails."""

    token: int
    process: str
    element: str
    scope: int
    code: str
    reason: str = ""
    caught_by: str = ""
