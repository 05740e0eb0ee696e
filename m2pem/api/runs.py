"""Runs as operators see them: their status, records, prompts, incidents and alerts."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import count, repeat
from typing import NamedTuple, TypeAlias

from m2pem.api.alerts import AlertSeverity
from m2pem.api.requirement_states import RequirementState
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.engine.records import Record
from m2pem.mission.behavior import Decision
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.library import MissionFile
from m2pem.mission.values import Value

RunId: TypeAlias = str
"""r1, r2, ... in a journal."""


class RunStatus(StrEnum):
    """The status of a run. INTERRUPTED: it has not ended, and no executive drives it."""

    RUNNING = "running"
    PAUSED = "paused"
    INTERRUPTED = "interrupted"
    COMPLETED = "completed"
    TERMINATED = "terminated"
    FAILED = "failed"
    STOPPED = "stopped"

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen in it."""
        return self in (
            RunStatus.COMPLETED,
            RunStatus.TERMINATED,
            RunStatus.FAILED,
            RunStatus.STOPPED,
        )


@dataclass(frozen=True, slots=True)
class RunSummary:
    """One line of `m2pem runs`. Times are microseconds since the Unix epoch.

    `started_us` and `ended_us` are by the executive's clock, which `--speed` takes ahead of the
    wall clock; `began_us` is by that one. 0: not known.
    """

    run: RunId
    mission: str
    process: str
    status: RunStatus
    started_us: int
    ended_us: int | None = None
    records: int = 0
    detail: str = ""
    began_us: int = 0

    @property
    def took_s(self) -> float | None:
        """Seconds of the executive's clock from start to end, pauses too; None: not ended."""
        if self.ended_us is None:
            return None
        return max(0, self.ended_us - self.started_us) / 1_000_000


class StampedRecord(NamedTuple):
    """A record with its position: `seq` counts from 1 in its run; `t_s` is mission time."""

    run: RunId
    seq: int
    t_s: float
    record: Record


def stamped_records(
    run: RunId, first_seq: int, t_s: float, records: Sequence[Record]
) -> Iterator[StampedRecord]:
    """Return the records of one input with their positions."""
    # Every subscriber waits for this: the interpreter does it in half of the time of a loop.
    fields = zip(repeat(run), count(first_seq), repeat(t_s), records)
    return map(tuple.__new__, repeat(StampedRecord), fields)


@dataclass(frozen=True, slots=True)
class OpenPrompt:
    """A question that is open. The first answer to it wins."""

    run: RunId
    prompt: str
    element: str
    text: str
    decisions: tuple[Decision, ...]
    role: str = ""


@dataclass(frozen=True, slots=True)
class PromptClosed:
    """A question is closed: `decision` and `by` are "" when it was withdrawn."""

    run: RunId
    prompt: str
    decision: str = ""
    by: str = ""


@dataclass(frozen=True, slots=True)
class ScopeData:
    """The data of an active process, subprocess or task.

    `process`, `element`: ids, the same for a process; both "" for the data stores of the run.
    `scope`: the number with which `MissionControl.set_data` changes it, None: it cannot.
    `instance`: of a loop or multi-instance activity, from 0; None: of none. `token`: on the
    activity whose own data this is, its item variable, data inputs and outputs; None: it is data
    of a process or subprocess.
    """

    process: str
    element: str
    data: Mapping[str, Value]
    scope: int | None = None
    instance: int | None = None
    token: int | None = None


@dataclass(frozen=True, slots=True)
class ExpressionValue:
    """What an expression gives over the data of a run.

    `kind`: of the value in the expression's language; data has dates and durations as ISO 8601
    texts. `reason`: which name is not set, so that it is null; "": none.
    """

    value: Value
    kind: str
    reason: str = ""

    def __str__(self) -> str:
        if self.value is None:
            return f"null: {self.reason}" if self.reason else "null"
        return f"{json.dumps(self.value, ensure_ascii=False)} ({self.kind})"


@dataclass(frozen=True, slots=True)
class OpenIncident:
    """An error that no event catches, about which an operator decides (docs/incidents.md).

    `task`: the element's label. `choices`: what can be chosen, of `retry`, `retry_with`, `skip`,
    `set_data`, `move` and `end`. `resources`: what is held for it. `roles`: those of the behavior,
    with who had each. `targets`: where the token can move, by id, with labels. `operator_role`:
    which operators may decide; "": all.
    """

    run: RunId
    incident: str
    element: str
    task: str
    code: str
    reason: str
    choices: tuple[str, ...]
    resources: tuple[str, ...] = ()
    roles: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    targets: Mapping[str, str] = field(default_factory=dict)
    operator_role: str = ""

    def __str__(self) -> str:
        held = f"; held for it: {', '.join(self.resources)}" if self.resources else ""
        reason = f": {self.reason}" if self.reason else ""
        who = f"; for {self.operator_role}" if self.operator_role else ""
        return f"{self.incident}: {self.task}: {self.code}{reason}{held}{who}"


class IncidentVerdict(StrEnum):
    """What the checker says of a mission after a choice about an incident."""

    COMPLETES = "completes"
    MAY_NOT_COMPLETE = "may not complete"
    CANNOT_COMPLETE = "cannot complete"
    UNKNOWN = "not known"


class RequirementProspect(StrEnum):
    """What is foreseen of a requirement that is monitored and open."""

    HOLDS = "holds"
    MAY_BE_VIOLATED = "may be violated"
    WILL_BE_VIOLATED = "will be violated"
    UNKNOWN = "not known"


@dataclass(frozen=True, slots=True)
class RequirementOutlook:
    """What is foreseen of a requirement. `text`: the requirement, in words."""

    requirement: str
    text: str
    verdict: RequirementProspect
    reason: str = ""

    def __str__(self) -> str:
        reason = f": {self.reason}" if self.reason else ""
        return f"requirement {self.requirement} {_PROSPECTS[self.verdict]}{reason}"


@dataclass(frozen=True, slots=True)
class IncidentPreview:
    """What follows a choice about an incident, explored from the run's present state.

    `requirements`: what follows for those that the run is monitored for, and that are open.
    """

    verdict: IncidentVerdict
    reason: str = ""
    requirements: tuple[RequirementOutlook, ...] = ()

    @property
    def completion(self) -> str:
        """Whether the mission completes, as a sentence."""
        reason = f": {self.reason}" if self.reason else ""
        return f"the mission {_VERDICTS[self.verdict]}{reason}"

    def __str__(self) -> str:
        return "\n".join([self.completion, *(f"  {each}" for each in self.requirements)])


_PROSPECTS = {
    RequirementProspect.HOLDS: "holds on all paths from there",
    RequirementProspect.MAY_BE_VIOLATED: "may be violated from there",
    RequirementProspect.WILL_BE_VIOLATED: "is violated on all paths from there",
    RequirementProspect.UNKNOWN: "may or may not hold from there, which is not known",
}
_VERDICTS = {
    IncidentVerdict.COMPLETES: "completes on all paths from there",
    IncidentVerdict.MAY_NOT_COMPLETE: "may not complete from there",
    IncidentVerdict.CANNOT_COMPLETE: "cannot complete from there",
    IncidentVerdict.UNKNOWN: "may or may not complete from there, which is not known",
}

LOGGED = "LOGGED"
"""The code of alerts that are also logged: what an arbiter warns of, for instance. Who shows the
log to an operator need not show them again."""
LEFT_ARMED = "LEFT_ARMED"
"""The code of the alert that says which vehicles stay armed when a run has ended."""
SCHEDULE = "SCHEDULE"
"""The code of alerts that say what operators, or the schedule itself, have done with it."""
APPROVAL = "APPROVAL"
"""The code of alerts that say who has approved a mission, or withdrawn it."""
CONTROL_REQUEST = "CONTROL_REQUEST"
"""The code of alerts that say who asks whom for a vehicle, and how that has ended."""
CONTROL_FORCED = "CONTROL_FORCED"
"""The code of the alert of a vehicle that an operator gave back to the missions though another one
had it."""
FACE = "FACE"
"""The code of the alert that says that a face does not serve any more."""
STARTS_SOON = "STARTS_SOON"
"""The code of the alert before each start of a scheduled mission."""
NEWS = frozenset({SCHEDULE, STARTS_SOON, APPROVAL, CONTROL_REQUEST})
"""The codes of alerts that say what operators have done, or what they have scheduled and comes now:
nothing is wrong."""
NOT_STARTED = "NOT_STARTED"
"""The code of alerts about scheduled missions that did not start: missed, refused or held."""


@dataclass(frozen=True, slots=True)
class Alert:
    """A warning which no record has: a vehicle that did not take STOP, what an autopilot warns of,
    a journal that does not write, a plugin that blocks. `run` "": it concerns all of them.

    `resources`: whom it is about. `group`: those that are alike are one line of the list when they
    come together; with the code as their group, also later. `listed`: whether the list gets it;
    else a condition of the list says the same. `clears`: what alerts of the same code said before
    is over.
    """

    run: RunId
    code: str
    text: str
    severity: AlertSeverity = AlertSeverity.WARNING
    resources: tuple[str, ...] = ()
    group: str = ""
    listed: bool = True
    clears: bool = False


@dataclass(frozen=True, slots=True)
class HandedOver:
    """A geometry (GeoJSON) from an operator, `at_us` microseconds since the Unix epoch."""

    geometry: Mapping[str, Value]
    by: str
    at_us: int


@dataclass(frozen=True, slots=True)
class GeometryVersion:
    """A version of a geometry that was handed over for all runs; `number` rises with time.

    `geometry` None: it was deleted then.
    """

    number: int
    geometry: Mapping[str, Value] | None
    by: str
    at_us: int


@dataclass(frozen=True, slots=True)
class TelemetrySample:
    """The states of vehicles and payloads of a rehearsal at one mission time."""

    t_s: float
    vehicles: Mapping[ResourceId, VehicleState]
    payloads: Mapping[ResourceId, PayloadState] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SimulationResult:
    """What a rehearsal did. `telemetry`: at even intervals; long ones have longer intervals.

    `files`: of the mission, its own first. `requirements`: those that it was monitored for, with
    their verdicts.
    """

    summary: RunSummary
    records: Sequence[StampedRecord] = field(default_factory=tuple)
    telemetry: Sequence[TelemetrySample] = field(default_factory=tuple)
    files: Sequence[MissionFile] = field(default_factory=tuple)
    requirements: Sequence[RequirementState] = field(default_factory=tuple)
