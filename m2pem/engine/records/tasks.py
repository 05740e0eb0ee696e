"""Records about the work of tasks: allocations, behaviors, prompts and services."""

import msgspec

from m2pem.engine.records.base import BaseRecord
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.values import Value


class AllocationRequested(BaseRecord, frozen=True):
    """A task asks for resources that are to be chosen now; its behavior follows.

    `allocation`: the id of the request. `parameters`: those of the behavior. `deadline`: the wait
    (`EventAwaited`) that ends it; 0: the task does not wait, or waits without a limit. `at_us`:
    when it asked, in microseconds since the Unix epoch.
    """

    token: int
    process: str
    element: str
    scope: int
    allocation: str
    name: str
    type: str
    parameters: dict[str, Value]
    deadline: int
    at_us: int


class AllocationDelayed(BaseRecord, frozen=True):
    """The resources of a request are not free. `reason`: for people. `holders`: the behaviors and
    operators who have what could fill its roles, by resource, or the space that its vehicles need,
    by the name of that. `again`: what was chosen had been taken meanwhile, so that the request is
    made again. `deadline`: the wait that ends the request from now on; 0: as before."""

    allocation: str
    reason: str
    holders: dict[str, str]
    again: bool = False
    deadline: int = 0


class ResourcesAllocated(BaseRecord, frozen=True):
    """Resources were chosen for the roles of a task. `considered`: the candidates of each role, and
    what each would have cost (docs/allocation.md)."""

    token: int
    process: str
    element: str
    scope: int
    allocation: str
    roles: dict[str, tuple[str, ...]]
    considered: dict[str, Value]


class AllocationEnded(BaseRecord, frozen=True):
    """A request ended without resources. `code`: the error that its task throws; "": the task was
    interrupted."""

    allocation: str
    code: str = ""
    reason: str = ""


class BehaviorRequested(BaseRecord, frozen=True):
    """The arbiters of `resources` must start a behavior.

    `roles` maps each role of the mission to the resources allocated to it. `preempts` are
    behaviors that are being cancelled and still hold one of the resources. `allocation`: the
    request by which they were chosen, if any.
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
    allocation: str = ""


class BehaviorProgressed(BaseRecord, frozen=True):
    """A behavior is ACCEPTED or RUNNING; `native_ref`: the arbiter's own reference to it.
    `remaining`: the parameters by which another vehicle would do what is left; None: as before."""

    behavior: str
    number: int
    state: BehaviorState
    native_ref: str | None = None
    remaining: dict[str, Value] | None = None


class BehaviorAdjusted(BaseRecord, frozen=True):
    """A behavior goes on with these parameters, in place of those of the same names."""

    behavior: str
    parameters: dict[str, Value]


class BehaviorCancelRequested(BaseRecord, frozen=True):
    """A behavior is to be cancelled; its resources are released when it has ended."""

    behavior: str
    code: str = ""
    reason: str = ""


class BehaviorUnsettled(BaseRecord, frozen=True):
    """The state of a behavior is not known after a restart; its vehicle is held until an operator
    decides."""

    behavior: str
    state: BehaviorState
    reason: str = ""


class BehaviorContinued(BaseRecord, frozen=True):
    """An operator lets a behavior go on after a restart: its arbiter still has it."""

    behavior: str
    by: str = ""


class BehaviorRestarted(BaseRecord, frozen=True):
    """A behavior is requested again under the same id, by an operator or its resume policy."""

    behavior: str
    epoch: int
    by: str = ""


class BehaviorEnded(BaseRecord, frozen=True):
    """A behavior has ended and released its resources. `code`: its error, "" if it succeeded.
    `evidence`: what telemetry showed of it (docs/evidence.md); empty: nothing was watched."""

    token: int
    process: str
    element: str
    scope: int
    behavior: str
    state: BehaviorState
    code: str
    reason: str = ""
    evidence: dict[str, Value] = msgspec.field(default_factory=dict)


class WorkReassigned(BaseRecord, frozen=True):
    """The resources of a behavior are lost, and others are to do what is left; the next request of
    the token is for them.

    `code`, `reason`: why; the error of the task, if no other can do it. `parameters`: of what is
    left. `excluded`: resources that the task does not get again until they have returned. `asks`:
    an incident asks an operator first what is done. `remaining`: the parameters of what is left
    that differ from those of the task, as its arbiter reported them; None: it reported nothing.
    """

    token: int
    process: str
    element: str
    scope: int
    behavior: str
    code: str
    reason: str
    parameters: dict[str, Value]
    excluded: tuple[str, ...]
    asks: bool = False
    remaining: dict[str, Value] | None = None


class ResourceReturned(BaseRecord, frozen=True):
    """A lost resource has returned and is held, or its battery is charged again: tasks that lost it
    may get it. `code`: the loss that is over."""

    resource: str
    code: str
    reason: str = ""


class ResourceKept(BaseRecord, frozen=True):
    """The run keeps a resource of a task until the scope `until` ends: only tasks in that scope get
    it, also between tasks. `keeping`: the id of that. `role`: which says so. `priority`: that of
    the task; in a fleet with preemption, a task of another run with a greater one may take it."""

    token: int
    process: str
    element: str
    scope: int
    keeping: str
    role: str
    resource: str
    until: int
    priority: int = 0


class KeepingEnded(BaseRecord, frozen=True):
    """The run keeps a resource no more: the scope has ended, or the reason says why."""

    keeping: str
    resource: str
    reason: str = ""


class PromptOpened(BaseRecord, frozen=True):
    """A prompt is open. `behavior`: the behavior that a recovery prompt is about."""

    token: int
    process: str
    element: str
    scope: int
    prompt: str
    text: str
    decisions: tuple[dict[str, str], ...]
    role: str = ""
    behavior: str = ""


class PromptAnswered(BaseRecord, frozen=True):
    token: int
    process: str
    element: str
    scope: int
    prompt: str
    decision: str
    by: str


class PromptWithdrawn(BaseRecord, frozen=True):
    """A prompt is no longer open: its task was interrupted, or it timed out."""

    prompt: str


class ServiceRequested(BaseRecord, frozen=True):
    token: int
    process: str
    element: str
    scope: int
    service: str
    name: str
    roles: dict[str, tuple[str, ...]]
    properties: dict[str, Value]


class ServiceEnded(BaseRecord, frozen=True):
    """A service has ended. `code`: "" if it completed, else the error that its task throws."""

    token: int
    process: str
    element: str
    scope: int
    service: str
    code: str = ""
    reason: str = ""


class ServiceWithdrawn(BaseRecord, frozen=True):
    """A service is no longer needed: its task was interrupted."""

    service: str
