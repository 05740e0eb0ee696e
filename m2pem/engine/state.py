"""The state of a run. Only `m2pem.engine.apply` changes it.

Finished tokens, scopes, behaviors and prompts leave the state: its size depends on what is active,
not on the length of the run. All dicts are in order of creation, so that every iteration is the
same on every machine.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias

from m2pem.engine.inputs import IncidentChoice, Input
from m2pem.engine.records import (
    RequirementDecided,
    RequirementLeftOpen,
    RequirementMonitored,
    RunOutcome,
    Trigger,
)
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import (
    Activity,
    Container,
    FlowNode,
    SequenceFlow,
)
from m2pem.mission.losses import Loss
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value


class RunStatus(StrEnum):
    """The status of a run: `m2pem.engine.lifecycle` says which inputs it takes in each."""

    NEW = "new"
    RUNNING = "running"
    PAUSED = "paused"
    ENDED = "ended"


@dataclass(slots=True, eq=False)
class DataStores:
    """The data stores of a run, which all its processes share (BPMN 2.0.2, clause 10.4.1)."""

    keys: frozenset[str]
    data: dict[str, Value] = field(default_factory=dict)
    now_us: int | None = None
    """When the input that is decided came, microseconds since the Unix epoch: `now()`. No record
    has it; None while none is decided."""


@dataclass(slots=True, eq=False)
class Scope:
    """An instance of a container: a process or a subprocess.

    `owner` is the token on the activity in `parent`; both None for a process that was not called.
    `joins` are the tokens waiting at each join, by the flow that they came by. `waits` are the
    start events of its event subprocesses. `loop`: it holds the instances of a loop or
    multi-instance activity, which is the owner's; its container is then the activity's own.
    `compensable`: activities that completed in it and can be undone, in that order.
    `compensations`: what is being undone in it. A scope that holds something to undo is kept by its
    `CompletedActivity` when it has completed, out of `RunState.scopes`.
    """

    id: int
    container: Container
    parent: "Scope | None"
    owner: "Token | None"
    depth: int
    shared: DataStores
    tokens: "dict[int, Token]" = field(default_factory=dict)
    data: dict[str, Value] = field(default_factory=dict)
    joins: "dict[FlowNode, Join]" = field(default_factory=dict)
    waits: "dict[int, Wait] | None" = None
    loop: "Loop | None" = None
    gathered: "dict[FlowNode, list[Token]]" = field(default_factory=dict)
    """Tokens at activities that begin with several tokens, and have not begun."""
    activated: "dict[FlowNode, tuple[SequenceFlow, ...]]" = field(default_factory=dict)
    """Complex gateways that wait to reset, and the flows whose tokens activated them."""
    chosen: "list[FlowNode]" = field(default_factory=list)
    """Of an ad-hoc subprocess: chosen activities that have not begun."""
    begun: "dict[FlowNode, None]" = field(default_factory=dict)
    """Of an ad-hoc subprocess: activities that were begun by choice."""
    completing: bool = False
    """Only event subprocesses are still active in it: no other one can begin."""
    interrupted: bool = False
    """An interrupting event subprocess of it has begun: no other one can."""
    compensable: "dict[int, CompletedActivity] | None" = None
    compensations: "dict[int, Compensation] | None" = None
    reopened: bool = False
    """It had completed, and is being compensated."""
    cancelled: bool = False
    """A transaction that is left as soon as what was done in it is compensated."""


@dataclass(slots=True, eq=False)
class Loop:
    """Progress of the instances of an activity (BPMN 2.0.2, table 10.31).

    `total`: number of instances, -1 if not known (a standard loop). `items`: the item of each, when
    they come from a collection. `outputs`: the output of each, by instance. Started instances are
    active, or `completed`, or ended otherwise (`terminated`).
    """

    total: int
    items: tuple[Value, ...] | None
    started: int = 0
    completed: int = 0
    terminated: int = 0
    outputs: dict[int, Value] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class CompletedActivity:
    """An activity, or an instance of one, that completed in `scope` and can be compensated.

    `kept_scope`: its own scope as it was then, to be compensated by what is in it; None: the
    activity's compensation activity compensates it. `own`: the data of the activity itself then.
    `claimed_by`: the compensation that will handle it; 0: none yet.
    """

    id: int
    scope: Scope
    node: Activity
    instance: int | None
    own: dict[str, Value] | None
    kept_scope: Scope | None
    claimed_by: int = 0


@dataclass(slots=True, eq=False)
class Compensation:
    """A compensation: completed activities of `scope` that are undone one after the other.

    `left`: those that are still to be undone, in this order. `begins`: the one whose turn it is,
    and the id of the token that will undo it. `token`: on what compensates it now. `waiter`: on the
    event that threw it and waits for its end; None: no event waits.
    """

    id: int
    scope: Scope
    left: list[CompletedActivity]
    waiter: "Token | None" = None
    begins: tuple[int, CompletedActivity] | None = None
    token: "Token | None" = None


@dataclass(slots=True, eq=False)
class Join:
    """Tokens waiting at a join by incoming flow, first come first; empty flows are absent."""

    by_flow: "dict[SequenceFlow, list[Token]]" = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class LostWork:
    """What a task has lost whose work goes on with other resources.

    `behavior`, `loss`: the last one that was lost. `remaining`: the parameters of what was left
    then that differ from those of the task.
    `resources`: what the task does not get again, until it has returned.
    """

    behavior: str
    loss: Loss
    remaining: dict[str, Value]
    resources: dict[str, Loss] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class Token:
    """A token on a flow node. `flow`: how it came. A move makes a new object with the same id.

    At most one of `behavior`, `allocation`, `service` and `inner` is set: the work of its activity.
    `instance`: which instance of a loop or multi-instance activity it is, from 0; None: none.
    `own`: data of the activity itself (item variable, data inputs and outputs); None: nothing.
    """

    id: int
    node: FlowNode
    scope: Scope
    flow: SequenceFlow | None
    waits: "dict[int, Wait] | None" = None
    behavior: str = ""
    allocation: str = ""
    prompt: str = ""
    service: str = ""
    inner: Scope | None = None
    instance: int | None = None
    own: dict[str, Value] | None = None
    compensations: dict[int, Compensation] | None = None
    """The compensations that its compensation event waits for."""
    compensates: Compensation | None = None
    """The compensation that it is part of, on a compensation or a completed activity."""
    kept_scope: Scope | None = None
    """The completed scope of its activity, which can be compensated."""
    armed: bool = False
    """Its events have been armed: they are not armed again in its turn."""
    ended_early: bool = False
    """Its activity was ended early (terminated, or interrupted by an event subprocess), so that
    there is nothing to compensate."""
    lost_work: LostWork | None = None
    """What was lost that did the work of its activity before; None: nothing was."""
    incident: str = ""
    """The open incident that stops it."""
    replacements: dict[str, tuple[str, ...]] | None = None
    """Who fills roles of the behavior that starts again, by an operator's choice; the others are
    filled as at the start of the task. None: all are."""

    @property
    def is_reopened(self) -> bool:
        """Whether its activity had completed, and is being compensated."""
        return self.inner is not None and self.inner.reopened


@dataclass(slots=True, eq=False)
class Wait:
    """An armed catch event.

    `token` waits: at its own node, at a boundary event of its activity, or at an event after the
    event-based gateway that it is on. None: `scope` waits, for the start event of an event
    subprocess of it, or for a condition that begins another process.
    Other fields as in record `EventAwaited`.
    """

    id: int
    token: Token | None
    scope: Scope
    node: FlowNode
    trigger: Trigger
    ref: str
    due_us: int
    calendar: bool
    left: int
    cycle: str
    armed_us: int | None = None


TokenOrScope: TypeAlias = Token | Scope
"""A place in the mission where names are read and events are awaited."""


class BehaviorPhase(StrEnum):
    """The phase of a behavior: running, being cancelled, or waiting for an operator's decision."""

    ACTIVE = "active"
    CANCELLING = "cancelling"
    UNSETTLED = "unsettled"


@dataclass(slots=True, eq=False)
class Behavior:
    """A behavior that was requested and has not ended. Fields as in record `BehaviorRequested`.

    `remaining`: the parameters by which another vehicle would do what is left, as last reported.
    `adjusted`: names of the parameters that were changed since it was started.
    """

    id: str
    token: int
    element: str
    process: str
    scope: int
    type: str
    name: str
    resources: tuple[str, ...]
    roles: dict[str, tuple[str, ...]]
    parameters: dict[str, Value]
    preempts: tuple[str, ...]
    phase: BehaviorPhase = BehaviorPhase.ACTIVE
    state: BehaviorState | None = None
    number: int = 0
    native_ref: str | None = None
    remaining: dict[str, Value] | None = None
    adjusted: tuple[str, ...] = ()

    @property
    def left(self) -> dict[str, Value] | None:
        """`remaining` with what was adjusted as it is now: arbiters may report what they began
        with."""
        if self.remaining is None:
            return None
        return {
            name: self.parameters[name] if name in self.adjusted and value is not None else value
            for name, value in self.remaining.items()
        }


@dataclass(frozen=True, slots=True)
class ControlRequest:
    """An operator asks the one who has a resource, `holder`, for it."""

    by: str
    holder: str


@dataclass(frozen=True, slots=True)
class OutOfReach:
    """A behavior that ended as LOST, and that its resource may still do. `native_ref`: the
    arbiter's own reference to it."""

    behavior: str
    native_ref: str | None


@dataclass(frozen=True, slots=True, eq=False)
class Keeping:
    """What the run keeps between tasks, until the scope `until` ends. Other fields as in record
    `ResourceKept`."""

    id: str
    token: int
    element: str
    role: str
    resource: str
    until: Scope
    priority: int


@dataclass(slots=True, eq=False)
class AllocationRequest:
    """A task that waits for resources to be chosen. Fields as in record `AllocationRequested`.

    `reason`, `holders`: why they are not free, as far as it was said.
    """

    id: str
    token: Token
    parameters: dict[str, Value]
    deadline: int
    at_us: int
    reason: str = ""
    holders: dict[str, str] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class Prompt:
    """An open prompt. `behavior`: the behavior that it asks about after a restart."""

    id: str
    token: Token
    text: str
    decisions: tuple[dict[str, str], ...]
    role: str
    behavior: str


@dataclass(slots=True, eq=False)
class Incident:
    """An open incident. Fields as in record `IncidentOpened`."""

    id: str
    token: Token
    code: str
    reason: str
    choices: tuple[IncidentChoice, ...]
    resources: tuple[str, ...]
    roles: dict[str, tuple[str, ...]]
    operator_role: str


@dataclass(slots=True, eq=False)
class Service:
    """A running service."""

    id: str
    token: Token
    name: str
    roles: dict[str, tuple[str, ...]]
    properties: dict[str, Value]


@dataclass(frozen=True, slots=True)
class KeptMessage:
    """A message without a receiver yet: its data and its correlation keys."""

    data: dict[str, Value]
    keys: dict[str, Value]


@dataclass(frozen=True, slots=True)
class Breakpoints:
    """Where a run is paused. Fields as in record `BreakpointsSet`."""

    elements: frozenset[str]
    conditions: tuple[str, ...]


@dataclass(slots=True, eq=False)
class RunState:
    """The state of a run. Times are microseconds: `_us` since the Unix epoch unless said
    otherwise."""

    run: str
    mission: Mission
    """The version that holds now."""
    new_mission: Mission | None = None
    """The version that the revision brings which is being decided or replayed; None: none is."""
    status: RunStatus = RunStatus.NEW
    by: str = ""
    """Who has started it."""
    outcome: RunOutcome | None = None
    detail: str = ""
    epoch: int = 1
    seq: int = 0
    started_us: int = 0
    expression_rules: int = 0
    """Those by which the run is decided."""
    paused_at_us: int = 0
    paused_total_us: int = 0

    last_token: int = 0
    last_scope: int = 0
    last_wait: int = 0
    last_completion: int = 0
    last_compensation: int = 0
    last_allocation: int = 0
    last_keeping: int = 0
    last_behavior: int = 0
    last_prompt: int = 0
    last_service: int = 0
    last_incident: int = 0

    shared: DataStores = field(init=False)
    root: Scope | None = None
    scopes: dict[int, Scope] = field(default_factory=dict)
    tokens: dict[int, Token] = field(default_factory=dict)
    allocations: dict[str, AllocationRequest] = field(default_factory=dict)
    behaviors: dict[str, Behavior] = field(default_factory=dict)
    held: dict[str, list[str]] = field(default_factory=dict)
    """Behaviors that hold a resource: at most one that is not being cancelled."""
    kept: dict[str, Keeping] = field(default_factory=dict)
    """What the run keeps between tasks, by resource."""
    commanded: dict[str, None] = field(default_factory=dict)
    """Every resource that a behavior of the run has had."""
    taken: dict[str, str] = field(default_factory=dict)
    """Resources that operators have taken, and who has each."""
    control_requests: dict[str, ControlRequest] = field(default_factory=dict)
    """Requests for resources that operators have taken, by resource."""
    lost: dict[str, OutOfReach] = field(default_factory=dict)
    """Resources that ended as LOST, and what they may still do: until they have returned, or do
    something else for the run."""
    prompts: dict[str, Prompt] = field(default_factory=dict)
    services: dict[str, Service] = field(default_factory=dict)
    incidents: dict[str, Incident] = field(default_factory=dict)

    waits: dict[int, Wait] = field(default_factory=dict)
    catchers: dict[tuple[Trigger, str], dict[int, Wait]] = field(default_factory=dict)
    """Waits for a signal or message, by its id."""
    conditions: dict[int, bool] = field(default_factory=dict)
    """Waits for a condition, and whether it may fire: one that has fired must be false first."""
    timers: list[tuple[int, int]] = field(default_factory=list)
    """Heap of (due mission time, wait); waits that are over may still be in it, but not first."""
    dates: list[tuple[int, int]] = field(default_factory=list)
    """Heap of (due time since the Unix epoch, wait); likewise."""
    kept_messages: dict[str, list[KeptMessage]] = field(default_factory=dict)
    """Messages that no receiver waits for yet, by message id; first come first."""

    breakpoints: Breakpoints | None = None
    stepping: bool = False
    """It is paused before the next step."""
    requirements: dict[str, RequirementMonitored] = field(default_factory=dict)
    """The requirements that the run is monitored for, by id."""
    verdicts: dict[str, RequirementDecided | RequirementLeftOpen] = field(default_factory=dict)
    """Of those that are decided, and of those that the end of the run has left open."""
    telemetry_conditions: dict[str, bool | None] = field(default_factory=dict)
    """What telemetry says of conditions in requirements, as far as it has said anything."""
    geometries: dict[str, dict[str, Value]] = field(default_factory=dict)
    deferred: list[Input] = field(default_factory=list)
    yielded: tuple[int, ...] = ()
    seen: dict[str, None] = field(default_factory=dict)
    """Ids of inputs that carried one."""

    def __post_init__(self) -> None:
        self.shared = DataStores(self.mission.data_stores)

    def label_of(self, element: str) -> str:
        """Return what to call an element that a revision may have removed since."""
        found = self.mission.elements.get(element)
        return found.label if found is not None else element

    def mission_time_us(self, now_us: int) -> int:
        """Microseconds from the start of the run, not counting pauses."""
        if self.status is RunStatus.PAUSED:
            now_us = self.paused_at_us
        return now_us - self.started_us - self.paused_total_us

    def awaited(self) -> list[str]:
        """Return what the tokens wait for, each with its element."""
        found = [
            f"{behavior.element} (behavior {behavior.name})"
            for behavior in self.behaviors.values()
            if behavior.phase is not BehaviorPhase.CANCELLING
        ]
        found += [
            f"{request.token.node.id} (resources: {request.reason or 'not chosen yet'})"
            for request in self.allocations.values()
        ]
        found += [f"{prompt.token.node.id} (an answer)" for prompt in self.prompts.values()]
        found += [
            f"{incident.token.node.id} (a choice about incident {incident.id}: {incident.code})"
            for incident in self.incidents.values()
        ]
        found += [f"{service.token.node.id} ({service.name})" for service in self.services.values()]
        found += [f"{wait.node.id} ({wait.trigger.value})" for wait in self.waits.values()]
        return list(dict.fromkeys(found))
