"""Inputs: everything that can happen to a run from outside. `MissionRun.receive` takes them all.

Each carries all that it needs, apart from the time, so that a journaled input can be decided again.
`id`, where given, makes an input idempotent: an id that was seen is ignored, and a record says so.
"""

from enum import StrEnum
from typing import TypeAlias, Union

import msgspec

from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from m2pem.mission.library import Source
from m2pem.mission.values import Value


class IncidentChoice(StrEnum):
    """What an operator can do about an incident."""

    RETRY = "retry"
    """The element starts again."""
    RETRY_WITH = "retry_with"
    """The element starts again, with other resources for its roles."""
    SKIP = "skip"
    """The token goes on as if the element had completed."""
    SET_DATA = "set_data"
    """Values are written where the element sees them; the incident stays open."""
    MOVE = "move"
    """The token goes to another element of its scope, or along a sequence flow there."""
    END = "end"
    """The run fails with the error."""


class _Input(
    msgspec.Struct, frozen=True, tag_field="input", tag=True, gc=False, omit_defaults=True
):
    """Base of all inputs: immutable, and JSON with its name under "input"."""


class RequirementVerdict(StrEnum):
    """What is certain of a requirement."""

    SATISFIED = "satisfied"
    VIOLATED = "violated"


class MonitoredRequirement(msgspec.Struct, frozen=True, omit_defaults=True):
    """A requirement that a run is monitored for. Fields as in record `RequirementMonitored`."""

    id: str
    formula: str
    english: str
    elements: tuple[str, ...] = ()
    on_violation: str = ""
    conditions: tuple[str, ...] = ()


class StartRun(_Input, frozen=True):
    """Begin: one token for each start event of the process, and the data given at start.

    `taken`: resources that operators have at that moment, and who has each. `step`: the run is
    paused before its first step. `requirements`: those that the run is monitored for. `conditions`:
    what telemetry says of their conditions, as far as it has said anything.
    """

    process: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""
    taken: dict[str, str] = msgspec.field(default_factory=dict)
    step: bool = False
    requirements: tuple[MonitoredRequirement, ...] = ()
    conditions: dict[str, bool] = msgspec.field(default_factory=dict)


class ClaimRun(_Input, frozen=True):
    """An executive has claimed the run after a restart, with a new epoch.

    `lost`: number of records that the journal has lost. So many ids of behaviors, prompts and
    services are left out, because the lost records may have used them.
    """

    epoch: int
    by: str = ""
    lost: int = 0


class StopRun(_Input, frozen=True):
    """End every token and cancel every behavior (paper, section 4.3)."""

    by: str = ""
    reason: str = ""


class PauseRun(_Input, frozen=True):
    """Hold every commanded resource; no token moves until `ResumeRun`."""

    by: str = ""


class ResumeRun(_Input, frozen=True):
    """Go on after a pause."""

    by: str = ""


class SetBreakpoints(_Input, frozen=True):
    """Pause the run from now on where a token has come to one of `elements`, and when one of
    `conditions` (expressions over the data of any active process or subprocess) has become true;
    in place of those that were set before."""

    elements: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()
    by: str = ""


class StepRun(_Input, frozen=True):
    """Go on after a pause for one step of a token: the run is paused again before the next."""

    by: str = ""


class SetData(_Input, frozen=True):
    """An operator writes `data` where the scope sees it, while the run is paused. `scope`: 0 is the
    process that the run began with."""

    data: dict[str, Value]
    scope: int = 0
    by: str = ""


class Tick(_Input, frozen=True):
    """Time has passed: fire every timer that is due, earliest first."""


class Continue(_Input, frozen=True):
    """Continue the steps that were left over because one input caused more than a batch."""


class GiveUp(_Input, frozen=True):
    """A rehearsal cannot go on: nothing is scheduled any more, or a limit is reached.

    The run fails with the elements that it waits for.
    """

    reason: str


class BehaviorReported(_Input, frozen=True):
    """An arbiter's report. `number` rises with each report of one behavior. `outputs`: what is
    written for its task when it has ended. `remaining`: parameters of what is left to do; None: as
    reported before. `evidence`: as in record `BehaviorEnded`."""

    behavior: str
    number: int
    state: BehaviorState
    code: str = ""
    reason: str = ""
    native_ref: str | None = None
    outputs: dict[str, Value] = msgspec.field(default_factory=dict)
    remaining: dict[str, Value] | None = None
    evidence: dict[str, Value] = msgspec.field(default_factory=dict)


class BehaviorMissing(_Input, frozen=True):
    """After a restart a behavior is not as it was; its resume policy says what to do.

    `state`: the state that its arbiter reports (UNKNOWN, or RUNNING if the outage was too long).
    """

    behavior: str
    policy: ResumePolicy
    state: BehaviorState = BehaviorState.UNKNOWN
    reason: str = ""


class ResourcesChosen(_Input, frozen=True):
    """The allocator has chosen resources for the roles of a request, and holds them for it.

    `considered`: as in record `ResourcesAllocated`.
    """

    allocation: str
    roles: dict[str, tuple[str, ...]]
    considered: dict[str, Value]


class ResourcesNotFree(_Input, frozen=True):
    """What a request needs is not free. `code`: the error that its task throws; "": it waits.
    `holders`: who has what could fill its roles, by resource, or the space that its vehicles need,
    by the name of that. `wait_s`: how long it waits from now on, if its roles do not say; None:
    as before."""

    allocation: str
    reason: str
    holders: dict[str, str] = msgspec.field(default_factory=dict)
    code: str = ""
    wait_s: float | None = None


class PromptAnswer(_Input, frozen=True):
    """An operator's decision; the first one wins."""

    prompt: str
    decision: str
    by: str = ""


class ResolveIncident(_Input, frozen=True):
    """An operator's choice about an incident; the first one that ends it wins.

    `data`: what SET_DATA writes. `to`: the element or sequence flow that MOVE goes to. `roles`:
    the resources of the roles that RETRY_WITH replaces.
    """

    incident: str
    choice: IncidentChoice
    by: str = ""
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    to: str = ""
    roles: dict[str, tuple[str, ...]] = msgspec.field(default_factory=dict)


class ServiceCompleted(_Input, frozen=True):
    """A service has completed and writes `data`."""

    service: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)


class ServiceFailed(_Input, frozen=True):
    """A service has failed; `code` is the error that its task throws."""

    service: str
    code: str
    reason: str = ""


class SignalReceived(_Input, frozen=True):
    """A signal from outside, by the id (UUID) of the `signal` root element."""

    signal: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""
    id: str = ""


class MessageReceived(_Input, frozen=True):
    """A message from outside, by the id of its root element; `data` goes to its catcher."""

    message: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""
    id: str = ""


class ResourceFault(_Input, frozen=True):
    """A vehicle or payload can no longer do its behavior: LINK_LOST, BATTERY_LOW, TAKEN_OVER.

    `reachable`: whether its arbiter can still cancel the behavior.
    """

    resource: str
    code: str
    reason: str = ""
    reachable: bool = True


class ResourceReturned(_Input, frozen=True):
    """A resource that was lost has returned and is held (LINK_LOST), or its battery is charged
    again (BATTERY_LOW). `code`: the loss that is over."""

    resource: str
    code: str
    reason: str = ""


class BehaviorPreempted(_Input, frozen=True):
    """A task of another run with a greater priority gets a resource of a behavior, or one that the
    run keeps between tasks: `behavior` is the id of the keeping then. `by`: its request."""

    behavior: str
    resource: str
    by: str
    reason: str = ""


class ControlTaken(_Input, frozen=True):
    """An operator has acquired control of a vehicle or payload; `by` keeps it until
    `ControlReturned`."""

    resource: str
    by: str


class ControlReturned(_Input, frozen=True):
    """An operator has released control of a vehicle or payload to the missions. `holder`: the one
    who had it, if `by` is another; `reason`: why `by` did it then."""

    resource: str
    by: str
    holder: str = ""
    reason: str = ""


class RequestOutcome(StrEnum):
    """How a request for control has ended."""

    GIVEN = "given"
    REFUSED = "refused"
    EXPIRED = "expired"
    WITHDRAWN = "withdrawn"
    RETURNED = "returned"


class ControlRequested(_Input, frozen=True):
    """An operator asks the one who has a vehicle or payload, `holder`, for it."""

    resource: str
    by: str
    holder: str


class ControlRequestEnded(_Input, frozen=True):
    """A request for control has ended. `requested_by`: the operator who asked; if it is GIVEN, that
    operator has the resource from now on. `by`: who ended it; "": its time was over."""

    resource: str
    requested_by: str
    outcome: RequestOutcome
    by: str = ""


class Revise(_Input, frozen=True):
    """Replace the mission of the run by a new version of its files, which the input carries.

    `version`: of the files (`m2pem.mission.mission`). `mission_name`, `mission`, `library`: as in
    the header of a run. `moves`: where a token on an element goes first, by the ids of elements or,
    at a join, of sequence flows; "": it ends there. `plan`: the digest of the plan that was shown;
    the run is only revised if that is what the revision does now. `requirements`: those that the
    run is monitored for from then on. `adjustable`: behaviors whose speed their arbiters can change
    while they go on. `conditions`: as in `StartRun`.
    """

    version: str
    mission_name: str
    mission: bytes
    plan: str
    library: tuple[Source, ...] = ()
    moves: dict[str, str] = msgspec.field(default_factory=dict)
    by: str = ""
    requirements: tuple[MonitoredRequirement, ...] = ()
    adjustable: tuple[str, ...] = ()
    conditions: dict[str, bool] = msgspec.field(default_factory=dict)


class OperatorNoted(_Input, frozen=True):
    """An operator writes a note into the run's log."""

    text: str
    by: str


class GeometrySet(_Input, frozen=True):
    """An OCU sends a route, area or point under a name (paper, section 4.3). GeoJSON."""

    name: str
    geometry: dict[str, Value]
    by: str = ""


class RequirementDecided(_Input, frozen=True):
    """A monitor has found that a requirement is satisfied or violated, whatever follows. Fields as
    in record `RequirementDecided`."""

    requirement: str
    verdict: RequirementVerdict
    decided_us: int
    because: str = ""


class RequirementLeftOpen(_Input, frozen=True):
    """The run has ended, and a monitor has found that its end does not decide a requirement.
    `because`: why not."""

    requirement: str
    because: str


class TelemetryConditionChanged(_Input, frozen=True):
    """What telemetry says of a condition in requirements has changed. `holds` None: it says
    nothing."""

    condition: str
    holds: bool | None


Input: TypeAlias = Union[
    StartRun,
    ClaimRun,
    StopRun,
    PauseRun,
    ResumeRun,
    SetBreakpoints,
    StepRun,
    SetData,
    Tick,
    Continue,
    GiveUp,
    BehaviorReported,
    BehaviorMissing,
    ResourcesChosen,
    ResourcesNotFree,
    PromptAnswer,
    ResolveIncident,
    ServiceCompleted,
    ServiceFailed,
    SignalReceived,
    MessageReceived,
    ResourceFault,
    ResourceReturned,
    BehaviorPreempted,
    ControlTaken,
    ControlReturned,
    ControlRequested,
    ControlRequestEnded,
    OperatorNoted,
    GeometrySet,
    RequirementDecided,
    RequirementLeftOpen,
    TelemetryConditionChanged,
    Revise,
]
