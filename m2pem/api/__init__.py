"""What plugin authors import: `from m2pem.api import Arbiter, BehaviorSpec, ...`.

Everything here is an interface, kept from release to release; what is not here may change.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem.api.alerts import AlertsChanged, AlertSeverity, OperatorAlert
    from m2pem.api.approval import EarlierApproval, GivenApproval, MissionApproval
    from m2pem.api.arbiter import (
        AddressedArbiter,
        AdjustingArbiter,
        Arbiter,
        ArbiterContext,
        BehaviorId,
        BehaviorReport,
        BehaviorRequest,
        Connection,
        DetectingArbiter,
        FencingArbiter,
        Limits,
        ReclaimingArbiter,
        ResolvedValue,
        SightedArbiter,
        adjusts,
    )
    from m2pem.api.async_queue import AsyncQueue
    from m2pem.api.authoring import (
        DataName,
        Draft,
        Editable,
        MissionFiles,
        MissionSource,
        Outline,
        OutlineElement,
        OutlineProcess,
        OutlineTrigger,
        SearchLimits,
        SearchProgress,
    )
    from m2pem.api.behavior_parameters import (
        BehaviorParameters,
        decode_parameters,
        encode_parameters,
    )
    from m2pem.api.behavior_tracker import BehaviorTracker
    from m2pem.api.bus import FleetBus
    from m2pem.api.capabilities import ArbiterCapabilities, FaceCapabilities, OcuCapabilities
    from m2pem.api.clock import Clock, SystemClock
    from m2pem.api.commands import LazyCommand, command_group, simulator_group
    from m2pem.api.connection_reader import ConnectionReader
    from m2pem.api.control import MissionControl
    from m2pem.api.declared_behaviors import read_declared_behaviors
    from m2pem.api.description import Description, Importance, Kind, describe
    from m2pem.api.epoch_fence import EpochFence
    from m2pem.api.estimates import (
        MissionEstimate,
        NotEstimated,
        TaskEstimate,
        VehicleEstimate,
    )
    from m2pem.api.event_rules import (
        UNKNOWN,
        AnswerRule,
        EventCondition,
        EventThrower,
        Fields,
        ReceiveRule,
        SendRule,
        Thrown,
        ThrownEvents,
        Unknown,
        read_rules,
        read_template,
    )
    from m2pem.api.exporter import ExportedRecord, ExportedRun, Exporter, ExportOptions
    from m2pem.api.face import Face, FaceSettings
    from m2pem.api.follower import Follower, Listener, follow
    from m2pem.api.goals import GoalArbiter
    from m2pem.api.health import ExecutiveAddress, HealthCheck, HealthStatus, listening_check
    from m2pem.api.hosting import CutOffPolicy, Host, HostedArbiter, HostLink, WhenCutOff
    from m2pem.api.latest_task import LatestTask
    from m2pem.api.log_context import current_run, trace_ids
    from m2pem.api.map_geometries import shown_geometries
    from m2pem.api.mission_control.watching import ControlEvent
    from m2pem.api.ocu import Ocu, StandbyOcu
    from m2pem.api.operations import (
        MAX_DATA_VALUES,
        MAX_NAME_CHARACTERS,
        MAX_REASON_CHARACTERS,
        OPERATIONS,
        Operation,
    )
    from m2pem.api.people import (
        ABSENT_AFTER_S,
        MAX_NOTE_CHARACTERS,
        PRESENCE_EVERY_S,
        OpenControlRequest,
        OperatorPresence,
        OperatorsChanged,
    )
    from m2pem.api.remaining import (
        RemainingRoute,
        RemainingSurvey,
        RemainingWork,
        raw_parameters,
        restored_work,
    )
    from m2pem.api.requirement_states import RequirementState, RequirementStates, worst_first
    from m2pem.api.revision import (
        RevisionEffect,
        RevisionPreview,
        RevisionRefusal,
        RunVersion,
    )
    from m2pem.api.run_view import RunView
    from m2pem.api.runs import (
        CONTROL_REQUEST,
        NEWS,
        SCHEDULE,
        Alert,
        GeometryVersion,
        HandedOver,
        IncidentPreview,
        IncidentVerdict,
        OpenIncident,
        OpenPrompt,
        PromptClosed,
        RequirementOutlook,
        RequirementProspect,
        RunId,
        RunStatus,
        RunSummary,
        ScopeData,
        SimulationResult,
        StampedRecord,
        TelemetrySample,
    )
    from m2pem.api.schedule import (
        WHEN_FREE,
        Concurrency,
        EntryId,
        Missed,
        Schedule,
        ScheduleChanged,
        ScheduledMission,
        ScheduledStatus,
        SettledTime,
        Settlement,
        When,
    )
    from m2pem.api.service import Service, ServiceContext, ServiceError
    from m2pem.api.statistics import (
        DurationCounts,
        ExecutiveStatistics,
        LinkStatistics,
        SubscriptionStatistics,
    )
    from m2pem.api.telemetry import (
        Detection,
        GeoPosition,
        LinkState,
        PayloadState,
        TeamMemberState,
        TeamState,
        Telemetry,
        VehicleState,
    )
    from m2pem.bpmn import parse_mission
    from m2pem.engine.records import Record
    from m2pem.findings import Finding, Severity
    from m2pem.fleet.approval import file_digest, person_of
    from m2pem.fleet.behaviors import SHARED
    from m2pem.fleet.endurance import lasts_s
    from m2pem.fleet.fleet import Fleet
    from m2pem.geo.cameras import KNOWN_CAMERAS, ImagePlan, SurveyCamera, image_plan
    from m2pem.geo.elevation_files import TerrainError
    from m2pem.geo.fence import Fence
    from m2pem.geo.geoid import ellipsoidal_m, mean_sea_level_m, undulation_m
    from m2pem.geo.geojson import GeometryError, as_geojson, kind_of, parse_geojson
    from m2pem.geo.geometry_files import (
        READ_SUFFIXES,
        FileFormat,
        FileProblem,
        GeometryFile,
        NamedGeometry,
        read_geometry_file,
        write_geometry_file,
    )
    from m2pem.geo.lawn_mower import lawn_mower, longest_edge_yaw, strip_width_m
    from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame, distance_m, offset
    from m2pem.geo.polygon import convex_hull, edges_enclose, middle_of
    from m2pem.geo.polyline import Polyline, Segment
    from m2pem.geo.survey_pattern import (
        Surveyor,
        SurveyPattern,
        SurveyRoute,
        best_heading_rad,
        survey_routes,
    )
    from m2pem.geo.survey_tracks import SurveyTracks
    from m2pem.geo.terrain import TERRAIN_FOLDER, ProfilePoint, Terrain, lowest, profile
    from m2pem.geo.terrain_following import TOLERANCE_M, follow_terrain, not_covered
    from m2pem.mission.behavior import BehaviorType, Decision
    from m2pem.mission.catalogue import (
        BehaviorSpec,
        BehaviorState,
        ParameterKind,
        ParameterSpec,
        ResourceId,
        ResumePolicy,
    )
    from m2pem.mission.geometry import Area, Point, Route, VehiclePosition
    from m2pem.mission.library import MissionFile
    from m2pem.mission.mission import Mission
    from m2pem.mission.values import Value
    from m2pem.suggestions import did_you_mean
    from m2pem.units import US_PER_S, Dimension, UnitError, quantity

# Loaded when asked for: an arbiter's module need not pay for what an OCU imports.
_MODULES = {
    "m2pem.api.alerts": "AlertSeverity AlertsChanged OperatorAlert",
    "m2pem.api.approval": "EarlierApproval GivenApproval MissionApproval",
    "m2pem.api.arbiter": (
        "AddressedArbiter AdjustingArbiter Arbiter ArbiterContext BehaviorId BehaviorReport"
        " BehaviorRequest Connection DetectingArbiter FencingArbiter Limits"
        " ReclaimingArbiter ResolvedValue SightedArbiter adjusts"
    ),
    "m2pem.api.authoring": (
        "DataName Draft Editable MissionFiles MissionSource Outline OutlineElement"
        " OutlineProcess OutlineTrigger SearchLimits SearchProgress"
    ),
    "m2pem.api.bus": "FleetBus",
    "m2pem.api.capabilities": "ArbiterCapabilities FaceCapabilities OcuCapabilities",
    "m2pem.api.clock": "Clock SystemClock",
    "m2pem.api.commands": "LazyCommand command_group simulator_group",
    "m2pem.api.connection_reader": "ConnectionReader",
    "m2pem.api.control": "MissionControl",
    "m2pem.api.mission_control.watching": "ControlEvent",
    "m2pem.api.declared_behaviors": "read_declared_behaviors",
    "m2pem.api.description": "Description Importance Kind describe",
    "m2pem.api.epoch_fence": "EpochFence",
    "m2pem.api.follower": "Follower Listener follow",
    "m2pem.api.goals": "GoalArbiter",
    "m2pem.api.health": "ExecutiveAddress HealthCheck HealthStatus listening_check",
    "m2pem.api.hosting": "CutOffPolicy Host HostLink HostedArbiter WhenCutOff",
    "m2pem.api.behavior_parameters": "BehaviorParameters decode_parameters encode_parameters",
    "m2pem.api.behavior_tracker": "BehaviorTracker",
    "m2pem.api.async_queue": "AsyncQueue",
    "m2pem.api.latest_task": "LatestTask",
    "m2pem.api.estimates": "MissionEstimate NotEstimated TaskEstimate VehicleEstimate",
    "m2pem.api.event_rules": "AnswerRule EventCondition EventThrower Fields ReceiveRule SendRule "
    "Thrown ThrownEvents UNKNOWN Unknown read_rules read_template",
    "m2pem.api.exporter": "ExportedRecord ExportedRun Exporter ExportOptions",
    "m2pem.api.face": "Face FaceSettings",
    "m2pem.api.log_context": "current_run trace_ids",
    "m2pem.api.map_geometries": "shown_geometries",
    "m2pem.api.ocu": "Ocu StandbyOcu",
    "m2pem.api.operations": (
        "MAX_DATA_VALUES MAX_NAME_CHARACTERS MAX_REASON_CHARACTERS OPERATIONS Operation"
    ),
    "m2pem.api.people": (
        "ABSENT_AFTER_S MAX_NOTE_CHARACTERS PRESENCE_EVERY_S OpenControlRequest OperatorPresence"
        " OperatorsChanged"
    ),
    "m2pem.api.remaining": (
        "RemainingRoute RemainingSurvey RemainingWork raw_parameters restored_work"
    ),
    "m2pem.api.requirement_states": "RequirementState RequirementStates worst_first",
    "m2pem.api.revision": "RevisionEffect RevisionPreview RevisionRefusal RunVersion",
    "m2pem.api.run_view": "RunView",
    "m2pem.api.runs": (
        "CONTROL_REQUEST NEWS SCHEDULE Alert GeometryVersion HandedOver IncidentPreview"
        " IncidentVerdict"
        " OpenIncident OpenPrompt PromptClosed RequirementOutlook RequirementProspect RunId"
        " RunStatus RunSummary ScopeData"
        " SimulationResult StampedRecord TelemetrySample"
    ),
    "m2pem.api.statistics": (
        "DurationCounts ExecutiveStatistics LinkStatistics SubscriptionStatistics"
    ),
    "m2pem.api.schedule": (
        "WHEN_FREE Concurrency EntryId Missed Schedule ScheduleChanged ScheduledMission"
        " ScheduledStatus SettledTime Settlement When"
    ),
    "m2pem.api.service": "Service ServiceContext ServiceError",
    "m2pem.api.telemetry": (
        "Detection GeoPosition LinkState PayloadState TeamMemberState TeamState Telemetry"
        " VehicleState"
    ),
    "m2pem.engine.records": "Record",
    "m2pem.findings": "Finding Severity",
    "m2pem.mission.behavior": "BehaviorType Decision",
    "m2pem.bpmn": "parse_mission",
    "m2pem.mission.catalogue": (
        "BehaviorSpec BehaviorState ParameterKind ParameterSpec ResourceId ResumePolicy"
    ),
    "m2pem.mission.library": "MissionFile",
    "m2pem.mission.mission": "Mission",
    "m2pem.mission.geometry": "Area Point Route VehiclePosition",
    "m2pem.mission.values": "Value",
    "m2pem.fleet.behaviors": "SHARED",
    "m2pem.geo.cameras": "ImagePlan KNOWN_CAMERAS SurveyCamera image_plan",
    "m2pem.geo.fence": "Fence",
    "m2pem.fleet.endurance": "lasts_s",
    "m2pem.fleet.approval": "file_digest person_of",
    "m2pem.fleet.fleet": "Fleet",
    "m2pem.geo.geoid": "ellipsoidal_m mean_sea_level_m undulation_m",
    "m2pem.geo.geojson": "GeometryError as_geojson kind_of parse_geojson",
    "m2pem.geo.geometry_files": (
        "FileFormat FileProblem GeometryFile NamedGeometry READ_SUFFIXES read_geometry_file"
        " write_geometry_file"
    ),
    "m2pem.geo.lawn_mower": "lawn_mower longest_edge_yaw strip_width_m",
    "m2pem.geo.local_frame": "EastNorth LatLon LocalFrame distance_m offset",
    "m2pem.geo.polygon": "convex_hull edges_enclose middle_of",
    "m2pem.geo.polyline": "Polyline Segment",
    "m2pem.geo.survey_pattern": "SurveyPattern SurveyRoute Surveyor best_heading_rad survey_routes",
    "m2pem.geo.survey_tracks": "SurveyTracks",
    "m2pem.geo.elevation_files": "TerrainError",
    "m2pem.geo.terrain": "ProfilePoint TERRAIN_FOLDER Terrain lowest profile",
    "m2pem.geo.terrain_following": "TOLERANCE_M follow_terrain not_covered",
    "m2pem.suggestions": "did_you_mean",
    "m2pem.units": "US_PER_S Dimension UnitError quantity",
}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = [
    "ABSENT_AFTER_S",
    "MAX_NOTE_CHARACTERS",
    "OpenControlRequest",
    "OperatorPresence",
    "OperatorsChanged",
    "PRESENCE_EVERY_S",
    "EarlierApproval",
    "GivenApproval",
    "MissionApproval",
    "file_digest",
    "person_of",
    "read_rules",
    "read_template",
    "Unknown",
    "UNKNOWN",
    "ThrownEvents",
    "EventCondition",
    "EventThrower",
    "AnswerRule",
    "CONTROL_REQUEST",
    "NEWS",
    "SCHEDULE",
    "WHEN_FREE",
    "When",
    "Settlement",
    "SettledTime",
    "ScheduledStatus",
    "ScheduledMission",
    "ScheduleChanged",
    "Schedule",
    "Missed",
    "EntryId",
    "Concurrency",
    "MAX_DATA_VALUES",
    "MAX_NAME_CHARACTERS",
    "MAX_REASON_CHARACTERS",
    "OPERATIONS",
    "SHARED",
    "US_PER_S",
    "AddressedArbiter",
    "AdjustingArbiter",
    "Alert",
    "AlertSeverity",
    "AlertsChanged",
    "Arbiter",
    "ArbiterCapabilities",
    "ArbiterContext",
    "Area",
    "BehaviorId",
    "BehaviorParameters",
    "BehaviorReport",
    "BehaviorRequest",
    "BehaviorSpec",
    "BehaviorState",
    "BehaviorType",
    "Clock",
    "Connection",
    "ConnectionReader",
    "ExportOptions",
    "ExportedRecord",
    "ExportedRun",
    "Exporter",
    "Face",
    "FaceCapabilities",
    "FaceSettings",
    "Fields",
    "ReceiveRule",
    "SendRule",
    "Thrown",
    "CutOffPolicy",
    "DataName",
    "Decision",
    "Description",
    "DetectingArbiter",
    "Detection",
    "Dimension",
    "Draft",
    "DurationCounts",
    "EastNorth",
    "Editable",
    "EpochFence",
    "Fence",
    "ExecutiveAddress",
    "ExecutiveStatistics",
    "FencingArbiter",
    "FileFormat",
    "FileProblem",
    "Finding",
    "Fleet",
    "FleetBus",
    "Follower",
    "GeoPosition",
    "GeometryError",
    "GeometryFile",
    "GeometryVersion",
    "NamedGeometry",
    "READ_SUFFIXES",
    "kind_of",
    "read_geometry_file",
    "write_geometry_file",
    "GoalArbiter",
    "HandedOver",
    "HealthCheck",
    "HealthStatus",
    "Host",
    "HostLink",
    "HostedArbiter",
    "BehaviorTracker",
    "Importance",
    "Kind",
    "LatLon",
    "LatestTask",
    "LazyCommand",
    "Limits",
    "LinkState",
    "LinkStatistics",
    "Listener",
    "LocalFrame",
    "AsyncQueue",
    "Mission",
    "IncidentPreview",
    "IncidentVerdict",
    "MissionControl",
    "MissionEstimate",
    "NotEstimated",
    "TaskEstimate",
    "VehicleEstimate",
    "MissionFile",
    "MissionFiles",
    "MissionSource",
    "ControlEvent",
    "Ocu",
    "OcuCapabilities",
    "OpenIncident",
    "OpenPrompt",
    "Operation",
    "OperatorAlert",
    "Outline",
    "OutlineElement",
    "OutlineProcess",
    "OutlineTrigger",
    "ParameterKind",
    "ParameterSpec",
    "PayloadState",
    "Point",
    "Polyline",
    "PromptClosed",
    "Record",
    "ReclaimingArbiter",
    "RemainingRoute",
    "RemainingSurvey",
    "RemainingWork",
    "RequirementOutlook",
    "RequirementProspect",
    "RequirementState",
    "RequirementStates",
    "ResolvedValue",
    "ResourceId",
    "ResumePolicy",
    "RevisionEffect",
    "RevisionPreview",
    "RevisionRefusal",
    "Route",
    "RunId",
    "RunStatus",
    "RunSummary",
    "RunVersion",
    "RunView",
    "ScopeData",
    "SearchLimits",
    "SearchProgress",
    "Segment",
    "Service",
    "ServiceContext",
    "ServiceError",
    "Severity",
    "SightedArbiter",
    "SimulationResult",
    "StandbyOcu",
    "StampedRecord",
    "SubscriptionStatistics",
    "ImagePlan",
    "KNOWN_CAMERAS",
    "SurveyCamera",
    "SurveyPattern",
    "SurveyRoute",
    "SurveyTracks",
    "Surveyor",
    "best_heading_rad",
    "image_plan",
    "lasts_s",
    "lowest",
    "profile",
    "ProfilePoint",
    "TERRAIN_FOLDER",
    "TOLERANCE_M",
    "follow_terrain",
    "not_covered",
    "Terrain",
    "TerrainError",
    "survey_routes",
    "SystemClock",
    "TeamMemberState",
    "TeamState",
    "Telemetry",
    "TelemetrySample",
    "UnitError",
    "Value",
    "VehiclePosition",
    "VehicleState",
    "WhenCutOff",
    "adjusts",
    "as_geojson",
    "command_group",
    "current_run",
    "decode_parameters",
    "describe",
    "did_you_mean",
    "distance_m",
    "convex_hull",
    "edges_enclose",
    "ellipsoidal_m",
    "encode_parameters",
    "follow",
    "lawn_mower",
    "listening_check",
    "longest_edge_yaw",
    "mean_sea_level_m",
    "middle_of",
    "offset",
    "parse_geojson",
    "parse_mission",
    "quantity",
    "raw_parameters",
    "read_declared_behaviors",
    "restored_work",
    "shown_geometries",
    "simulator_group",
    "strip_width_m",
    "trace_ids",
    "undulation_m",
    "worst_first",
]


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_LAZY[name]), name)
    globals()[name] = value
    return value
