"""The operations of `MissionControl`: one table, from which operators are served.

The control socket, its client and the ROS services read requests by it. The REST interface and the
command line declare parameters of their own, for OpenAPI and `--help`; tests compare them with it.
An operation has the name of the method of `MissionControl` that it calls. Its parameters have the
names of that method's arguments; over the socket a field may have another name.
"""

from base64 import b64decode, b64encode
from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any, get_args

import msgspec

from m2pem.api.alerts import AlertsChanged, OperatorAlert
from m2pem.api.allocation import (
    SharedSpaceChanged,
    SharedSpaceState,
    StartPreview,
    TakeEffect,
    WaitingTask,
)
from m2pem.api.approval import MissionApproval
from m2pem.api.authoring import MissionFiles
from m2pem.api.control import MissionControl
from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.people import OpenControlRequest, OperatorPresence, OperatorsChanged
from m2pem.api.revision import RevisionPreview, RunVersion
from m2pem.api.runs import (
    Alert,
    GeometryVersion,
    IncidentPreview,
    OpenIncident,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunSummary,
    ScopeData,
    StampedRecord,
)
from m2pem.api.schedule import EntryId, Schedule, ScheduleChanged, When
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.api.telemetry import PayloadState, TeamState, VehicleState
from m2pem.findings import Finding
from m2pem.fleet.fleet import dump, restore
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value

MAX_NAME_CHARACTERS = 200
MAX_REASON_CHARACTERS = 1000
MAX_DATA_VALUES = 1000
"""The longest name, the longest reason and the most values of `data` that are accepted from other
machines (REST, ROS). The control socket serves processes of this user only, and bounds nothing."""


class Params(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all parameters; `by` names who asks."""


class Nothing(Params, frozen=True):
    """No parameters."""


class OfRun(Params, frozen=True):
    """A run, and who asks."""

    run: str
    by: str = ""


class Stop(OfRun, frozen=True):
    """As `MissionControl.stop`."""

    reason: str = ""


class StopAll(Params, frozen=True):
    """As `MissionControl.stop_all`."""

    by: str = ""
    reason: str = ""


class SwitchOver(Params, frozen=True):
    """As `MissionControl.switch_over`."""

    by: str = ""


class Answer(Params, frozen=True):
    """As `MissionControl.answer`."""

    run: str
    prompt: str
    decision: str
    by: str = ""


class Choice(Params, frozen=True):
    """As `MissionControl.preview_incident`."""

    run: str
    incident: str
    choice: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    to: str = ""
    roles: dict[str, list[str]] = msgspec.field(default_factory=dict)


class Resolve(Choice, frozen=True):
    """As `MissionControl.resolve_incident`."""

    by: str = ""
    even_if_stuck: bool = False


class OfVersion(Params, frozen=True):
    """As `MissionControl.version_files`."""

    run: str
    version: str


class PlanRevision(Params, frozen=True):
    """As `MissionControl.plan_revision`; the caller has read the mission's files."""

    run: str
    mission: MissionFiles
    moves: dict[str, str] = msgspec.field(default_factory=dict)


class Revision(PlanRevision, frozen=True, kw_only=True):
    """As `MissionControl.revise`; the caller has read the mission's files."""

    plan: str
    by: str = ""
    even_if_stuck: bool = False


class Alerts(Params, frozen=True):
    """As `MissionControl.alerts`."""

    over: bool = False


class OfAlert(Params, frozen=True):
    """An alert, and who asks."""

    alert: str
    by: str = ""


class OwnAlert(OfAlert, frozen=True):
    """As `MissionControl.own_alert`."""

    owner: str | None = None


class Signal(Params, frozen=True):
    """As `MissionControl.signal`."""

    signal: str = msgspec.field(name="id")
    run: str | None = None
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""


class Message(Params, frozen=True):
    """As `MissionControl.message`."""

    message: str = msgspec.field(name="id")
    run: str
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""


class Geometry(Params, frozen=True):
    """As `MissionControl.set_geometry`."""

    name: str
    geometry: dict[str, Value]
    run: str | None = None
    by: str = ""


class OfGeometry(Params, frozen=True):
    """As `MissionControl.geometry_versions` and `geometry_users`."""

    name: str


class DeleteGeometry(OfGeometry, frozen=True):
    """As `MissionControl.delete_geometry`."""

    by: str = ""


class Resource(Params, frozen=True):
    """As `MissionControl.take` and `request_control`."""

    resource: str
    by: str = ""


class GiveBack(Params, frozen=True):
    """As `MissionControl.give_back`."""

    resource: str
    reason: str = ""
    by: str = ""


class Preview(Params, frozen=True):
    """As `MissionControl.preview_take`."""

    resource: str


class AnswerControl(Params, frozen=True):
    """As `MissionControl.answer_control`."""

    resource: str
    give: bool
    by: str = ""


class AnnouncePresence(Params, frozen=True):
    """As `MissionControl.announce_presence`."""

    client: str
    unit: str
    role: str = ""
    run: str = ""
    page: str = ""
    editing: str = ""
    by: str = ""


class EndPresence(Params, frozen=True):
    """As `MissionControl.end_presence`."""

    client: str


class SetBreakpoints(OfRun, frozen=True):
    """As `MissionControl.set_breakpoints`."""

    elements: list[str] = msgspec.field(default_factory=list)
    conditions: list[str] = msgspec.field(default_factory=list)


class SetData(Params, frozen=True):
    """As `MissionControl.set_data`."""

    run: str
    data: dict[str, Value]
    scope: int = 0
    by: str = ""


class AddNote(Params, frozen=True):
    """As `MissionControl.add_note`."""

    run: str
    text: str
    by: str = ""


class Page(Params, frozen=True):
    """As `MissionControl.records`."""

    run: str
    after_seq: int = 0
    limit: int = 1000


class Subscribe(Params, frozen=True):
    """As `MissionControl.subscribe`."""

    run: str | None = None
    size: int = 10_000


class Telemetry(Params, frozen=True):
    """As `MissionControl.telemetry`."""

    size: int = 100


class Start(Params, frozen=True):
    """As `MissionControl.start`; the caller has read the mission's files."""

    mission: MissionFiles
    process: str | None = None
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""
    even_if_busy: bool = False


class OfMission(Params, frozen=True):
    """As `MissionControl.approval`; the caller has read the mission's files."""

    mission: MissionFiles


class Approve(OfMission, frozen=True):
    """As `MissionControl.approve`."""

    digest: str = ""
    by: str = ""


class WithdrawApproval(OfMission, frozen=True):
    """As `MissionControl.withdraw_approval`."""

    by: str = ""


class NoteEdit(Params, frozen=True):
    """As `MissionControl.note_edit`."""

    digest: str
    by: str = ""


class ExecuteBehavior(Params, frozen=True):
    """As `MissionControl.execute_behavior`."""

    resource: str
    behavior: str
    parameters: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""


class ToSchedule(Params, frozen=True):
    """As `MissionControl.schedule`; the caller has read the mission's files."""

    mission: MissionFiles
    when: When = When()
    process: str | None = None
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    priority: int = 0
    by: str = ""


class OfEntry(Params, frozen=True):
    """An entry of the schedule, and who asks."""

    entry: str
    by: str = ""


class HoldSchedule(Params, frozen=True):
    """As `MissionControl.hold_schedule`."""

    entry: str | None = None
    by: str = ""
    reason: str = ""


class ReleaseSchedule(Params, frozen=True):
    """As `MissionControl.release_schedule`."""

    entry: str | None = None
    by: str = ""


class Check(Params, frozen=True):
    """As `MissionControl.check` and `preview_start`; the caller has read the mission's files."""

    mission: MissionFiles
    process: str | None = None
    data: list[str] = msgspec.field(default_factory=list)


def mission_files(mission: Mission) -> MissionFiles:
    """A mission that was read, as it is sent to another process."""
    return MissionFiles(mission.file, mission.source, mission.library)


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation. `result`: the type of what is sent; of a stream, of each value that is sent.

    `encode` and `decode` turn what the method returns into that and back. `kept`: the result never
    changes, and the client asks for it once. `alone`: the client opens a connection for it, as STOP
    waits for no other call, and no other call waits for the end of a run. `slow`: the method
    blocks, and is called in a thread.
    """

    name: str
    parameters: type[Params]
    result: Any = None
    stream: bool = False
    kept: bool = False
    alone: bool = False
    slow: bool = False
    encode: Callable[[Any], Any] = lambda value: value
    decode: Callable[[Any], Any] = lambda value: value

    def call(self, control: MissionControl, params: Params) -> Any:
        """Call the method; returns its result, an awaitable of it, or a stream."""
        method = getattr(control, self.name)
        accepted = signature(getattr(MissionControl, self.name)).parameters
        fields = self.parameters.__struct_fields__
        return method(**{name: getattr(params, name) for name in fields if name in accepted})


Event = (
    StampedRecord
    | OpenPrompt
    | PromptClosed
    | Alert
    | AlertsChanged
    | ScheduleChanged
    | SharedSpaceChanged
    | OperatorsChanged
)
State = VehicleState | PayloadState | TeamState
STREAMED: dict[str, type] = {kind.__name__: kind for kind in get_args(Event | State)}
"""What streams consist of, by the `kind` that a notification names."""

OPERATIONS: dict[str, Operation] = {
    operation.name: operation
    for operation in (
        Operation("start", Start, RunId, alone=True),
        Operation("check", Check, list[Finding], alone=True, slow=True),
        Operation("execute_behavior", ExecuteBehavior, RunId, alone=True),
        Operation("approval", OfMission, MissionApproval, alone=True),
        Operation("approve", Approve, MissionApproval, alone=True),
        Operation("withdraw_approval", WithdrawApproval, MissionApproval, alone=True),
        Operation("note_edit", NoteEdit),
        Operation("answer", Answer),
        Operation("incidents", Nothing, list[OpenIncident]),
        Operation("preview_incident", Choice, IncidentPreview, alone=True),
        Operation("resolve_incident", Resolve, alone=True),
        Operation("versions", OfRun, list[RunVersion]),
        Operation("version_files", OfVersion, MissionFiles),
        Operation("plan_revision", PlanRevision, RevisionPreview, alone=True),
        Operation("revise", Revision, alone=True),
        Operation("alerts", Alerts, list[OperatorAlert]),
        Operation("acknowledge_alert", OfAlert),
        Operation("own_alert", OwnAlert),
        Operation("signal", Signal),
        Operation("message", Message),
        Operation("schedule", ToSchedule, EntryId, alone=True),
        Operation("scheduled", Nothing, Schedule),
        Operation("unschedule", OfEntry),
        Operation("start_scheduled", OfEntry, RunId, alone=True),
        Operation("hold_schedule", HoldSchedule, alone=True),
        Operation("release_schedule", ReleaseSchedule),
        Operation("stop", Stop, alone=True),
        Operation("stop_all", StopAll, list[RunId], alone=True),
        Operation("switch_over", SwitchOver, ExecutiveAddress, alone=True),
        Operation("pause", OfRun, alone=True),
        Operation("resume", OfRun),
        Operation("set_breakpoints", SetBreakpoints),
        Operation("step", OfRun),
        Operation("set_data", SetData),
        Operation("data", OfRun, list[ScopeData]),
        Operation("set_geometry", Geometry),
        Operation("delete_geometry", DeleteGeometry),
        Operation("geometry_versions", OfGeometry, list[GeometryVersion]),
        Operation("geometry_users", OfGeometry, list[str]),
        Operation("take", Resource),
        Operation("preview_take", Preview, list[TakeEffect]),
        Operation("give_back", GiveBack),
        Operation("request_control", Resource),
        Operation("answer_control", AnswerControl),
        Operation("control_requests", Nothing, list[OpenControlRequest]),
        Operation("announce_presence", AnnouncePresence),
        Operation("end_presence", EndPresence),
        Operation("operators", Nothing, list[OperatorPresence]),
        Operation("add_note", AddNote),
        Operation("holders", Nothing, dict[ResourceId, str]),
        Operation("missions", Nothing, list[str], alone=True),
        Operation("preview_start", Check, StartPreview, alone=True),
        Operation("holder_labels", Nothing, dict[str, str]),
        Operation("unavailable", Nothing, dict[ResourceId, str]),
        Operation("waiting", Nothing, list[WaitingTask]),
        Operation("shared_space", Nothing, list[SharedSpaceState]),
        Operation("runs", Nothing, list[RunSummary]),
        Operation("prompts", Nothing, list[OpenPrompt]),
        Operation("records", Page, list[StampedRecord]),
        Operation("mission", OfRun, MissionFiles, encode=mission_files),
        Operation("mission_time_s", OfRun, float),
        Operation("wait", OfRun, RunSummary, alone=True),
        Operation(
            "fleet",
            Nothing,
            str,
            kept=True,
            encode=lambda fleet: b64encode(dump(fleet)).decode(),
            decode=lambda sent: restore(b64decode(sent)),
        ),
        Operation("catalogue", Nothing, dict[ResourceId, tuple[BehaviorSpec, ...]], kept=True),
        Operation("simulated", Nothing, bool, kept=True),
        Operation("speed", Nothing, float, kept=True),
        Operation("health", Nothing, list[HealthCheck], alone=True),
        Operation("statistics", Nothing, ExecutiveStatistics),
        Operation("standbys", Nothing, list[ExecutiveAddress], alone=True),
        Operation(
            "journal_file",
            Nothing,
            str | None,
            kept=True,
            encode=lambda path: None if path is None else str(path),
            decode=lambda sent: None if sent is None else Path(sent),
        ),
        Operation("subscribe", Subscribe, Event, stream=True),
        Operation("telemetry", Telemetry, State, stream=True),
    )
}
"""Calls are answered once; streams with null, and then with notifications of the same name until
the caller hangs up."""
