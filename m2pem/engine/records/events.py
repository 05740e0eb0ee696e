"""Records about data, and about what is awaited and thrown."""

import msgspec

from m2pem.engine.records.base import BaseRecord, Trigger
from m2pem.mission.values import Value


class DataWritten(BaseRecord, frozen=True):
    """`store` is the scope that holds the key; `scope`, `element` say who wrote it.

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

    A duration or cycle is due at a mission time (microseconds from the start, which stands during
    a pause); a date (`calendar`) at a time since the Unix epoch. `left`: how often a cycle still
    fires after this one (-1: for ever); `cycle`: its period or cron text.
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


class EventTriggered(BaseRecord, frozen=True):
    """The awaited event came; the wait is over.

    `kept`: it took a message that was kept, the `letter`-th (from 0) of that message.
    """

    wait: int
    kept: bool = False
    letter: int = 0


class ConditionReset(BaseRecord, frozen=True):
    """A condition that had fired was seen false: it can fire again."""

    wait: int


class SignalThrown(BaseRecord, frozen=True):
    """By an element, or by an operator (`by`)."""

    signal: str
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    by: str = ""


class MessageThrown(BaseRecord, frozen=True):
    """By an element, or by an operator (`by`). `kept`: nobody waits for it yet, so its `data` is
    kept for whoever waits next. `keys`: what it is matched by (clause 8.4.2)."""

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
    """`caught_by`: the element that catches it, "" when none does (nothing else happens then)."""

    token: int
    process: str
    element: str
    scope: int
    escalation: str
    code: str
    caught_by: str = ""


class ErrorThrown(BaseRecord, frozen=True):
    """`caught_by`: the element that catches it, "" when none does (the run fails then)."""

    token: int
    process: str
    element: str
    scope: int
    code: str
    reason: str = ""
    caught_by: str = ""
