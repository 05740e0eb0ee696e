"""Records: facts about a run, in the order they came to be. They are the journal and the state.

`m2pem.engine.apply` folds them into `RunState`, and nothing else changes it. Names and fields are
an interface (docs/records.md): records are only ever added to. As JSON, a record is an object with
its name under "record"; the journal adds "run", "seq" and "t" (mission time, seconds).

`token` is an entity's id, `scope` the id of the scope it is in, `process` the id of the process
that contains `element`.
"""

from typing import TypeAlias, Union

from m2pem.engine.records.base import RunOutcome, TokenOutcome, Trigger
from m2pem.engine.records.events import (
    DataWritten,
    ErrorThrown,
    EscalationThrown,
    EventAwaited,
    EventTriggered,
    MessageThrown,
    SignalThrown,
)
from m2pem.engine.records.run import (
    GeometryReceived,
    InputDeferred,
    InputIgnored,
    InputSeen,
    RunClaimed,
    RunEnded,
    RunPaused,
    RunResumed,
    RunStarted,
    RunYielded,
)
from m2pem.engine.records.tokens import FlowTaken, ScopeClosed, ScopeOpened, TokenEntered, TokenLeft
from m2pem.engine.records.work import (
    BehaviorCancelRequested,
    BehaviorContinued,
    BehaviorEnded,
    BehaviorProgressed,
    BehaviorRequested,
    BehaviorRestarted,
    BehaviorUnsettled,
    PromptAnswered,
    PromptOpened,
    PromptWithdrawn,
    ServiceEnded,
    ServiceRequested,
    ServiceWithdrawn,
)

__all__ = [
    "BehaviorCancelRequested",
    "BehaviorContinued",
    "BehaviorEnded",
    "BehaviorProgressed",
    "BehaviorRequested",
    "BehaviorRestarted",
    "BehaviorUnsettled",
    "DataWritten",
    "ErrorThrown",
    "EscalationThrown",
    "EventAwaited",
    "EventTriggered",
    "FlowTaken",
    "GeometryReceived",
    "InputDeferred",
    "InputIgnored",
    "InputSeen",
    "MessageThrown",
    "PromptAnswered",
    "PromptOpened",
    "PromptWithdrawn",
    "Record",
    "RunClaimed",
    "RunEnded",
    "RunOutcome",
    "RunPaused",
    "RunResumed",
    "RunStarted",
    "RunYielded",
    "ScopeClosed",
    "ScopeOpened",
    "ServiceEnded",
    "ServiceRequested",
    "ServiceWithdrawn",
    "SignalThrown",
    "TokenEntered",
    "TokenLeft",
    "TokenOutcome",
    "Trigger",
]

Record: TypeAlias = Union[
    RunStarted,
    RunClaimed,
    RunPaused,
    RunResumed,
    RunEnded,
    RunYielded,
    InputIgnored,
    InputDeferred,
    InputSeen,
    GeometryReceived,
    ScopeOpened,
    ScopeClosed,
    TokenEntered,
    TokenLeft,
    FlowTaken,
    BehaviorRequested,
    BehaviorProgressed,
    BehaviorCancelRequested,
    BehaviorUnsettled,
    BehaviorContinued,
    BehaviorRestarted,
    BehaviorEnded,
    PromptOpened,
    PromptAnswered,
    PromptWithdrawn,
    ServiceRequested,
    ServiceEnded,
    ServiceWithdrawn,
    DataWritten,
    EventAwaited,
    EventTriggered,
    SignalThrown,
    MessageThrown,
    EscalationThrown,
    ErrorThrown,
]
