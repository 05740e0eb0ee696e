"""Records about the run as a whole."""

from enum import StrEnum

import msgspec

from m2pem.engine.inputs import Input, RequestOutcome
from m2pem.engine.records.base import BaseRecord, RunOutcome
from m2pem.mission.values import Value


class StopReason(StrEnum):
    """Why a run is paused that is being debugged."""

    BREAKPOINT = "breakpoint"
    CONDITION = "condition"
    STEP = "step"


class RunStarted(BaseRecord, frozen=True):
    """The run began. `started_us`: microseconds since the Unix epoch, the zero of mission time.
    `expression_rules`: those that it is decided by (`m2pem.mission.expression`)."""

    process: str
    started_us: int
    by: str = ""
    expression_rules: int = 0


class RunClaimed(BaseRecord, frozen=True):
    """Another executive, or the same after a restart, has claimed the run.

    `lost`: number of records that the journal had lost; so many ids are left out.
    `expression_rules`: those of what is decided from here on, if they are others than before.
    """

    epoch: int
    by: str = ""
    lost: int = 0
    expression_rules: int = 0


class RunPaused(BaseRecord, frozen=True):
    """The run was paused: no token moves and mission time stops until `RunResumed`."""

    at_us: int
    by: str = ""


class RunResumed(BaseRecord, frozen=True):
    at_us: int
    by: str = ""


class BreakpointsSet(BaseRecord, frozen=True):
    """Where the run is paused from now on, in place of what was set before. `step`: also before the
    next step."""

    elements: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()
    step: bool = False
    by: str = ""


class BreakpointReached(BaseRecord, frozen=True):
    """The run is paused next, as a token is on an element with a breakpoint, as a condition has
    become true, or because it was to make one step. `token`, `process`, `element`, `scope`: what
    would be executed now; 0 and "": nothing would. `condition`: what has become true."""

    reason: StopReason
    token: int = 0
    process: str = ""
    element: str = ""
    scope: int = 0
    condition: str = ""


class OperatorSetData(BaseRecord, frozen=True):
    """An operator has changed the data of a paused run; `DataWritten` follows for each value."""

    process: str
    element: str
    scope: int
    by: str = ""


class RunEnded(BaseRecord, frozen=True):
    """The run ended. Only the ends of behaviors that were being cancelled may follow."""

    outcome: RunOutcome
    detail: str


class RunYielded(BaseRecord, frozen=True):
    """One input caused more steps than a batch; these are left, in order, for `Continue`.

    A positive number is a token to execute, a negative one a scope to check.
    """

    steps: tuple[int, ...]


class InputIgnored(BaseRecord, frozen=True):
    """An input was redundant or late; it changed nothing else."""

    reason: str


class InputDeferred(BaseRecord, frozen=True):
    """An input came during a pause; it is decided at resume."""

    input: Input


class InputSeen(BaseRecord, frozen=True):
    """An input with an id was taken; another one with the same id will be ignored."""

    id: str


class OperatorTookControl(BaseRecord, frozen=True):
    """An operator has control of `resource`: it gets no behavior until control is released."""

    resource: str
    by: str


class OperatorGaveControlBack(BaseRecord, frozen=True):
    """The operator has released control of `resource` to the missions. `holder`: the operator who
    had it, if `by` is another; `reason`: why `by` did it then."""

    resource: str
    by: str
    holder: str = ""
    reason: str = ""


class ControlRequested(BaseRecord, frozen=True):
    """An operator has asked `holder` for `resource`."""

    resource: str
    by: str
    holder: str


class ControlRequestEnded(BaseRecord, frozen=True):
    """A request for control has ended. `requested_by`: who asked. `by`: who ended it; "": its time
    was over. If it is GIVEN, `OperatorTookControl` follows."""

    resource: str
    requested_by: str
    outcome: RequestOutcome
    by: str = ""


class MissionRevised(BaseRecord, frozen=True):
    """The run goes on with a new version of its mission; the files are in the input `Revise`.

    `version`, `previous`: hashes of the files. `moves`: where tokens went, by the element that they
    were on; "": they ended. `disarmed`: waits that are over. `restarted`: tokens whose task begins
    again.
    """

    version: str
    previous: str
    by: str = ""
    moves: dict[str, str] = msgspec.field(default_factory=dict)
    disarmed: tuple[int, ...] = ()
    restarted: tuple[int, ...] = ()


class OperatorNote(BaseRecord, frozen=True):
    """An operator wrote a note into the run's log."""

    text: str
    by: str


class GeometryReceived(BaseRecord, frozen=True):
    """An OCU sent a route, area or point (GeoJSON geometry)."""

    name: str
    geometry: dict[str, Value]
    by: str = ""
