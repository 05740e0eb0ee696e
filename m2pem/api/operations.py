"""The operations of `MissionControl`: one table, from which operators are served.

The control socket, its client and the ROS services read requests by it. The REST interface and the
command line declare parameters of their own, for OpenAPI and `--help`; tests compare them with it.
An operation has the name of the method of `MissionControl` that it calls. Its parameters are that
method's arguments; over the socket a field may have another name.
"""

from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from inspect import Parameter, signature
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
from m2pem.api.authoring import MissionFiles, MissionSource
from m2pem.api.control import MissionControl
from m2pem.api.health import ExecutiveAddress, HealthCheck
from m2pem.api.operator import one_line
from m2pem.api.people import OpenControlRequest, OperatorPresence, OperatorsChanged
from m2pem.api.revision import RevisionPreview, RunVersion
from m2pem.api.runs import (
    Alert,
    ExpressionValue,
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
from m2pem.api.schedule import EntryId, Schedule, ScheduleChanged
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


_SENT_AS: Mapping[Any, Any] = {
    MissionSource: MissionFiles,
    Iterable[str]: list[str],
    Sequence[str]: list[str],
    Mapping[str, Value]: dict[str, Value],
    Mapping[str, Value] | None: dict[str, Value],
    Mapping[str, str] | None: dict[str, str],
    Mapping[str, Sequence[str]] | None: dict[str, list[str]],
}
"""How arguments are sent whose types no message can name. Of a mission the caller has read the
files; maps and lists that are optional are empty by default."""


def _parameters_of(name: str, *, who_asks: bool) -> type[msgspec.Struct]:
    """The arguments of a method, as they are checked when a request is received."""
    fields: list[tuple[str, Any] | tuple[str, Any, Any]] = []
    for argument in _arguments_of(name):
        kind = _SENT_AS.get(argument.annotation, argument.annotation)
        if argument.default is Parameter.empty:
            fields.append((argument.name, kind))
        else:
            default = argument.default if kind is argument.annotation else kind()
            fields.append((argument.name, kind, default))
    if who_asks:
        fields.append(("by", str, ""))
    return msgspec.defstruct(
        name,
        fields,
        frozen=True,
        kw_only=True,
        forbid_unknown_fields=True,
        rename={name: "id"},  # of a signal or message, which is also the operation's name
    )


def _arguments_of(name: str) -> list[Parameter]:
    _, *arguments = signature(getattr(MissionControl, name)).parameters.values()
    return arguments


def mission_files(mission: Mission) -> MissionFiles:
    """A mission that was read, as it is sent to another process."""
    return MissionFiles(mission.file, mission.source, mission.library)


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation. `result`: the type of what is sent; of a stream, of each value that is sent.

    `encode` and `decode` turn what the method returns into that and back. `kept`: the result never
    changes, and the client asks for it once. `alone`: the client opens a connection for it, as STOP
    waits for no other call, and no other call waits for the end of a run. `slow`: the method
    blocks, and is called in a thread. `who_asks`: a request may have `by`, which the method does
    not take.
    """

    name: str
    result: Any = None
    stream: bool = False
    kept: bool = False
    alone: bool = False
    slow: bool = False
    who_asks: bool = False
    encode: Callable[[Any], Any] = lambda value: value
    decode: Callable[[Any], Any] = lambda value: value
    parameters: type[msgspec.Struct] = field(init=False)

    def __post_init__(self) -> None:
        parameters = _parameters_of(self.name, who_asks=self.who_asks)
        object.__setattr__(self, "parameters", parameters)

    def call(self, control: MissionControl, params: msgspec.Struct) -> Any:
        """Call the method; returns its result, an awaitable of it, or a stream."""
        method = getattr(control, self.name)
        values = {each.name: getattr(params, each.name) for each in _arguments_of(self.name)}
        if "by" in values:
            values["by"] = one_line(values["by"])
        return method(**values)


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
        Operation("start", RunId, alone=True),
        Operation("check", list[Finding], alone=True, slow=True),
        Operation("execute_behavior", RunId, alone=True),
        Operation("approval", MissionApproval, alone=True),
        Operation("approve", MissionApproval, alone=True),
        Operation("withdraw_approval", MissionApproval, alone=True),
        Operation("note_edit"),
        Operation("answer"),
        Operation("incidents", list[OpenIncident]),
        Operation("preview_incident", IncidentPreview, alone=True),
        Operation("resolve_incident", alone=True),
        Operation("versions", list[RunVersion], who_asks=True),
        Operation("version_files", MissionFiles),
        Operation("plan_revision", RevisionPreview, alone=True),
        Operation("revise", alone=True),
        Operation("alerts", list[OperatorAlert]),
        Operation("acknowledge_alert"),
        Operation("own_alert"),
        Operation("signal"),
        Operation("message"),
        Operation("schedule", EntryId, alone=True),
        Operation("scheduled", Schedule),
        Operation("unschedule"),
        Operation("start_scheduled", RunId, alone=True),
        Operation("hold_schedule", alone=True),
        Operation("release_schedule"),
        Operation("stop", alone=True),
        Operation("stop_all", list[RunId], alone=True),
        Operation("switch_over", ExecutiveAddress, alone=True),
        Operation("pause", alone=True),
        Operation("resume"),
        Operation("set_breakpoints"),
        Operation("step"),
        Operation("set_data"),
        Operation("data", list[ScopeData], who_asks=True),
        Operation("evaluate", ExpressionValue, who_asks=True),
        Operation("set_geometry"),
        Operation("delete_geometry"),
        Operation("geometry_versions", list[GeometryVersion]),
        Operation("geometry_users", list[str]),
        Operation("take"),
        Operation("preview_take", list[TakeEffect]),
        Operation("give_back"),
        Operation("request_control"),
        Operation("answer_control"),
        Operation("control_requests", list[OpenControlRequest]),
        Operation("announce_presence"),
        Operation("end_presence"),
        Operation("operators", list[OperatorPresence]),
        Operation("add_note"),
        Operation("holders", dict[ResourceId, str]),
        Operation("missions", list[str], alone=True),
        Operation("preview_start", StartPreview, alone=True),
        Operation("holder_labels", dict[str, str]),
        Operation("unavailable", dict[ResourceId, str]),
        Operation("waiting", list[WaitingTask]),
        Operation("shared_space", list[SharedSpaceState]),
        Operation("runs", list[RunSummary]),
        Operation("prompts", list[OpenPrompt]),
        Operation("records", list[StampedRecord]),
        Operation("mission", MissionFiles, who_asks=True, encode=mission_files),
        Operation("mission_time_s", float, who_asks=True),
        Operation("wait", RunSummary, alone=True, who_asks=True),
        Operation(
            "fleet",
            str,
            kept=True,
            encode=lambda fleet: b64encode(dump(fleet)).decode(),
            decode=lambda sent: restore(b64decode(sent)),
        ),
        Operation("catalogue", dict[ResourceId, tuple[BehaviorSpec, ...]], kept=True),
        Operation("simulated", bool, kept=True),
        Operation("speed", float, kept=True),
        Operation("health", list[HealthCheck], alone=True),
        Operation("statistics", ExecutiveStatistics),
        Operation("standbys", list[ExecutiveAddress], alone=True),
        Operation(
            "journal_file",
            str | None,
            kept=True,
            encode=lambda path: None if path is None else str(path),
            decode=lambda sent: None if sent is None else Path(sent),
        ),
        Operation("subscribe", Event, stream=True),
        Operation("telemetry", State, stream=True),
    )
}
"""Calls are answered once; streams with null, and then with notifications of the same name until
the caller hangs up."""
