"""Inputs: everything that can happen to a run from outside. `MissionRun.receive` is the only door.

Each carries all it needs (time comes beside it), so that a journaled input can be decided again.
`id`, where given, makes an input idempotent: a seen id is ignored, and a record says so.
"""

from typing import TypeAlias, Union

import msgspec

from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from m2pem.mission.values import Value


class _Input(
    msgspec.Struct, frozen=True, tag_field="input", tag=True, gc=False, omit_defaults=True
):
    """Base of all inputs: immutable, and JSON with its name under "input"."""


class StartRun(_Input, frozen=True):
    """Begin: one token for each start event of the process, and the data given at start.

    `taken`: resources that operators have at that moment, and who has each.
    """

    process: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""
    taken: dict[str, str] = msgspec.field(default_factory=dict)


class ClaimRun(_Input, frozen=True):
    """An executive has taken the run over after a restart, with a new epoch.

    `lost`: how many records the journal has lost. So many ids of behaviors, prompts and services
    are left out: the lost records may have used them.
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


class Tick(_Input, frozen=True):
    """Time has passed: fire every timer that is due, earliest first."""


class Continue(_Input, frozen=True):
    """Go on with steps left over when one input caused more than a batch of them."""


class GiveUp(_Input, frozen=True):
    """A rehearsal can go no further: nothing scheduled can happen any more, or a limit is reached.

    The run fails, naming what it awaits.
    """

    reason: str


class BehaviorReported(_Input, frozen=True):
    """An arbiter's report. `number` rises with each report of one behavior. `outputs`: what is
    written for its task when it has ended."""

    behavior: str
    number: int
    state: BehaviorState
    code: str = ""
    reason: str = ""
    native_ref: str | None = None
    outputs: dict[str, Value] = msgspec.field(default_factory=dict)


class BehaviorMissing(_Input, frozen=True):
    """After a restart a behavior is not as it was: what to do with it, by its resume policy.

    `state`: what its arbiter says of it (UNKNOWN, or RUNNING when the outage was too long).
    """

    behavior: str
    policy: ResumePolicy
    state: BehaviorState = BehaviorState.UNKNOWN
    reason: str = ""


class PromptAnswer(_Input, frozen=True):
    """An operator's decision; the first one wins."""

    prompt: str
    decision: str
    by: str = ""


class ServiceCompleted(_Input, frozen=True):
    """A service has ended well and writes `data`."""

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

    `reachable` says whether its arbiter can still cancel what it does.
    """

    resource: str
    code: str
    reason: str = ""
    reachable: bool = True


class ControlTaken(_Input, frozen=True):
    """An operator has taken a vehicle or payload; `by` has it until `ControlReturned`."""

    resource: str
    by: str


class ControlReturned(_Input, frozen=True):
    """An operator has given a vehicle or payload back to the missions."""

    resource: str
    by: str


class GeometrySet(_Input, frozen=True):
    """An OCU hands over a route, area or point under a name (paper, section 4.3). GeoJSON."""

    name: str
    geometry: dict[str, Value]
    by: str = ""


Input: TypeAlias = Union[
    StartRun,
    ClaimRun,
    StopRun,
    PauseRun,
    ResumeRun,
    Tick,
    Continue,
    GiveUp,
    BehaviorReported,
    BehaviorMissing,
    PromptAnswer,
    ServiceCompleted,
    ServiceFailed,
    SignalReceived,
    MessageReceived,
    ResourceFault,
    ControlTaken,
    ControlReturned,
    GeometrySet,
]
