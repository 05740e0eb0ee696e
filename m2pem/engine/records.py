"""Records: facts about a run, in the order they came to be. They are the journal and the state.

`m2pem.engine.apply` folds them into `RunState`, and nothing else changes it. Names and fields are
an interface (docs/records.md): records are only ever added to. As JSON, a record is an object with
its name under "record"; the journal adds "run", "seq" and "t" (mission time, seconds).

`token` is an entity's id, `scope` the id of the scope it is in, `process` the id of the process
that contains `element`.
"""

from enum import StrEnum
from typing import TypeAlias, Union

import msgspec

from m2pem.engine.inputs import Input
from m2pem.model.catalogue import BehaviorState
from m2pem.model.values import Value


class TokenOutcome(StrEnum):
    """How a token left an element."""

    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    TERMINATED = "terminated"
    FAILED = "failed"


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


class _Record(
    msgspec.Struct, frozen=True, tag_field="record", tag=True, gc=False, omit_defaults=True
):
    """Base of all records: immutable, and JSON with its name under "record"."""


# --- the run ------------------------------------------------------------------------------------


class RunStarted(_Record, frozen=True):
    """`started_us`: microseconds since the Unix epoch; mission time counts from it."""

    process: str
    started_us: int
    by: str = ""


class RunClaimed(_Record, frozen=True):
    """Another executive, or the same after a restart, drives the run from here."""

    epoch: int
    by: str = ""


class RunPaused(_Record, frozen=True):
    """No token moves, and mission time stands, until `RunResumed`."""

    at_us: int
    by: str = ""


class RunResumed(_Record, frozen=True):
    at_us: int
    by: str = ""


class RunEnded(_Record, frozen=True):
    """Nothing follows but reports of behaviors that were still being cancelled."""

    outcome: RunOutcome
    detail: str = ""


class RunYielded(_Record, frozen=True):
    """One input caused more steps than a batch; these are left, in order, for `Continue`.

    A positive number is a token to execute, a negative one a scope to look at.
    """

    steps: tuple[int, ...]


class InputIgnored(_Record, frozen=True):
    """A redundant or late input; it changed nothing else."""

    reason: str


class InputDeferred(_Record, frozen=True):
    """An input that came during a pause; it is decided at resume."""

    input: Input


class InputSeen(_Record, frozen=True):
    """An input that carried an id was taken; another with the same id will be ignored."""

    id: str


class GeometryReceived(_Record, frozen=True):
    """A route, area or point that an OCU handed over (GeoJSON geometry)."""

    name: str
    geometry: dict[str, Value]
    by: str = ""


# --- scopes and tokens --------------------------------------------------------------------------


class ScopeOpened(_Record, frozen=True):
    """An instance of a container has begun. `token` sits on its activity in scope `parent`."""

    scope: int
    process: str
    element: str
    parent: int | None = None
    token: int | None = None


class ScopeClosed(_Record, frozen=True):
    """The instance has ended and its data is gone."""

    scope: int
    process: str
    element: str
    outcome: TokenOutcome


class TokenEntered(_Record, frozen=True):
    """A token is on an element. `flow`: the sequence flow that it came by."""

    token: int
    process: str
    element: str
    scope: int
    flow: str = ""


class TokenLeft(_Record, frozen=True):
    """It is there no more. Without a later `TokenEntered` it was consumed."""

    token: int
    process: str
    element: str
    scope: int
    outcome: TokenOutcome


class FlowTaken(_Record, frozen=True):
    """`element` is where the flow begins."""

    token: int
    process: str
    element: str
    scope: int
    flow: str


# --- behaviors, prompts, services ---------------------------------------------------------------


class BehaviorRequested(_Record, frozen=True):
    """The arbiters of `resources` must start a behavior.

    `roles` maps each role of the mission to the resources allocated to it. `preempts` are
    behaviors that are being cancelled and still hold one of the resources.
    """

    token: int
    process: str
    element: str
    scope: int
    behavior: str
    name: str
    type: str
    resources: tuple[str, ...]
    roles: dict[str, tuple[str, ...]]
    parameters: dict[str, Value]
    preempts: tuple[str, ...] = ()


class BehaviorProgressed(_Record, frozen=True):
    """ACCEPTED or RUNNING, with the arbiter's own reference for finding it again."""

    behavior: str
    number: int
    state: BehaviorState
    native_ref: str | None = None


class BehaviorCancelRequested(_Record, frozen=True):
    """Nobody waits for it any more; its resources are released when it has ended."""

    behavior: str
    code: str = ""
    reason: str = ""


class BehaviorUnsettled(_Record, frozen=True):
    """After a restart nobody knows how it stands; its vehicle is held until an operator says."""

    behavior: str
    state: BehaviorState
    reason: str = ""


class BehaviorContinued(_Record, frozen=True):
    """An operator lets it go on after a restart: its arbiter still has it."""

    behavior: str
    by: str = ""


class BehaviorRestarted(_Record, frozen=True):
    """It is requested again under the same id, by decision of an operator or its resume policy."""

    behavior: str
    epoch: int
    by: str = ""


class BehaviorEnded(_Record, frozen=True):
    """It has ended and released its resources. `code`: the error code, "" when it succeeded."""

    token: int
    process: str
    element: str
    scope: int
    behavior: str
    state: BehaviorState
    code: str
    reason: str = ""


class PromptOpened(_Record, frozen=True):
    """An operator is asked. `behavior`: the behavior that a recovery prompt is about."""

    token: int
    process: str
    element: str
    scope: int
    prompt: str
    text: str
    decisions: tuple[dict[str, str], ...]
    role: str = ""
    behavior: str = ""


class PromptAnswered(_Record, frozen=True):
    token: int
    process: str
    element: str
    scope: int
    prompt: str
    decision: str
    by: str


class PromptWithdrawn(_Record, frozen=True):
    """The question no longer stands: its task was interrupted, or it timed out."""

    prompt: str


class ServiceRequested(_Record, frozen=True):
    token: int
    process: str
    element: str
    scope: int
    service: str
    name: str
    roles: dict[str, tuple[str, ...]]
    properties: dict[str, Value]


class ServiceEnded(_Record, frozen=True):
    """`code`: "" when it completed, else the error that its task throws."""

    token: int
    process: str
    element: str
    scope: int
    service: str
    code: str = ""
    reason: str = ""


class ServiceWithdrawn(_Record, frozen=True):
    """Nobody waits for the service any more."""

    service: str


# --- data and events ----------------------------------------------------------------------------


class DataWritten(_Record, frozen=True):
    """`store` is the scope that holds the key; `scope`, `element` say who wrote it."""

    token: int
    process: str
    element: str
    scope: int
    key: str
    value: Value
    store: int


class EventAwaited(_Record, frozen=True):
    """A catch event is armed: `ref` is a signal's or message's id; `due_us` a timer's time.

    A duration or cycle is due at a mission time (microseconds from the start, which stands during
    a pause); a date (`calendar`) at a time since the Unix epoch. `left`: how often a cycle still
    fires after this one (-1: for ever), every `period_us`.
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


class EventTriggered(_Record, frozen=True):
    """The awaited event came; the wait is over. `kept`: it took a message that was kept."""

    wait: int
    kept: bool = False


class SignalThrown(_Record, frozen=True):
    """By an element, or by an operator (`by`)."""

    signal: str
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    by: str = ""


class MessageThrown(_Record, frozen=True):
    """By an element, or by an operator (`by`). `kept`: nobody waits for it yet, so its `data` is
    kept for whoever waits next."""

    message: str
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    by: str = ""
    kept: bool = False
    data: dict[str, Value] = {}


class EscalationThrown(_Record, frozen=True):
    """`caught_by`: the element that catches it, "" when none does (nothing else happens then)."""

    token: int
    process: str
    element: str
    scope: int
    escalation: str
    code: str
    caught_by: str = ""


class ErrorThrown(_Record, frozen=True):
    """`caught_by`: the element that catches it, "" when none does (the run fails then)."""

    token: int
    process: str
    element: str
    scope: int
    code: str
    reason: str = ""
    caught_by: str = ""


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
