"""The base of all records, and the enumerations that several of them use."""

from enum import StrEnum

import msgspec


class TokenOutcome(StrEnum):
    """How a token left an element."""

    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    TERMINATED = "terminated"
    FAILED = "failed"
    CONSUMED = "consumed"
    """Together with other tokens it began one execution of an activity (`startQuantity`)."""


class RunOutcome(StrEnum):
    """How a run ended."""

    COMPLETED = "completed"
    TERMINATED = "terminated"
    FAILED = "failed"
    STOPPED = "stopped"


class Trigger(StrEnum):
    """What an awaited event waits for."""

    SIGNAL = "signal"
    MESSAGE = "message"
    TIMER = "timer"
    CONDITION = "condition"


class BaseRecord(
    msgspec.Struct, frozen=True, tag_field="record", tag=True, gc=False, omit_defaults=True
):
    """Base of all records: immutable, and JSON with its name under "record"."""
