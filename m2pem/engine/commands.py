"""Commands: what the executive must do, derived from committed records and never stored.

It carries them out after the commit; only `HoldResource`, `CancelBehavior` and what
stops a run may go out before it.
"""

from dataclasses import dataclass
from typing import TypeAlias, Union

from m2pem.mission.behavior import Decision
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class AllocateResources:
    """Choose resources for the roles of a task; answer with `ResourcesChosen` or
    `ResourcesNotFree`. `again`: what was chosen before had been taken meanwhile."""

    allocation: str
    again: bool = False


@dataclass(frozen=True, slots=True)
class WithdrawAllocation:
    """The task needs its resources no longer: what was chosen for it is free."""

    allocation: str


@dataclass(frozen=True, slots=True)
class StartBehavior:
    """Start a behavior on the arbiters of its resources; idempotent on `behavior`. `keepings`: the
    ids under which the run keeps resources of it."""

    behavior: str
    element: str
    epoch: int
    type: str
    name: str
    resources: tuple[str, ...]
    roles: dict[str, tuple[str, ...]]
    parameters: dict[str, Value]
    preempts: tuple[str, ...] = ()
    keepings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class AdjustBehavior:
    """Let a behavior go on with other parameters. `goes_on`: as it does then; `names`: of the
    parameters that change. It is sent under `epoch`."""

    epoch: int
    goes_on: StartBehavior
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CancelBehavior:
    """Cancel a behavior; its terminal report releases the resources."""

    behavior: str
    epoch: int
    resources: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class HoldResource:
    """Bring a resource to its safe state; needs no journal."""

    resource: str


@dataclass(frozen=True, slots=True)
class ResumeResource:
    """Resume what a resource did before the hold."""

    resource: str


@dataclass(frozen=True, slots=True)
class OpenPrompt:
    """Show a prompt to the operators."""

    prompt: str
    element: str
    text: str
    decisions: tuple[Decision, ...]
    role: str = ""


@dataclass(frozen=True, slots=True)
class ClosePrompt:
    """Withdraw a prompt, or say who answered it (`by`) and how."""

    prompt: str
    decision: str = ""
    by: str = ""


@dataclass(frozen=True, slots=True)
class RunService:
    """Run a registered service; answer with `ServiceCompleted` or `ServiceFailed`."""

    service: str
    name: str
    element: str
    roles: dict[str, tuple[str, ...]]
    properties: dict[str, Value]


@dataclass(frozen=True, slots=True)
class CancelService:
    """Cancel a service: its task waits for it no longer."""

    service: str


Command: TypeAlias = Union[
    AllocateResources,
    WithdrawAllocation,
    StartBehavior,
    AdjustBehavior,
    CancelBehavior,
    HoldResource,
    ResumeResource,
    OpenPrompt,
    ClosePrompt,
    RunService,
    CancelService,
]
