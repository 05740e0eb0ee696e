"""Records about the work of tasks: behaviors, prompts and services."""

from m2pem.engine.records.base import BaseRecord
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.values import Value


class BehaviorRequested(BaseRecord, frozen=True):
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


class BehaviorProgressed(BaseRecord, frozen=True):
    """A behavior is ACCEPTED or RUNNING; `native_ref`: the arbiter's own reference to it."""

    behavior: str
    number: int
    state: BehaviorState
    native_ref: str | None = None


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
    """A behavior has ended and released its resources. `code`: its error, "" if it succeeded."""

    token: int
    process: str
    element: str
    scope: int
    behavior: str
    state: BehaviorState
    code: str
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
