"""What plugin authors import: `from m2pem.api import Arbiter, BehaviorSpec, ...`.

Everything here is an interface, kept from release to release; what is not here may change.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem.api.alerts import AlertsChanged as AlertsChanged
    from m2pem.api.alerts import AlertSeverity as AlertSeverity
    from m2pem.api.alerts import OperatorAlert as OperatorAlert
    from m2pem.api.approval import EarlierApproval as EarlierApproval
    from m2pem.api.approval import GivenApproval as GivenApproval
    from m2pem.api.approval import MissionApproval as MissionApproval
    from m2pem.api.arbiter import AddressedArbiter as AddressedArbiter
    from m2pem.api.arbiter import AdjustingArbiter as AdjustingArbiter
    from m2pem.api.arbiter import Arbiter as Arbiter
    from m2pem.api.arbiter import ArbiterContext as ArbiterContext
    from m2pem.api.arbiter import BehaviorId as BehaviorId
    from m2pem.api.arbiter import BehaviorReport as BehaviorReport
    from m2pem.api.arbiter import BehaviorRequest as BehaviorRequest
    from m2pem.api.arbiter import Connection as Connection
    from m2pem.api.arbiter import DetectingArbiter as DetectingArbiter
    from m2pem.api.arbiter import FencingArbiter as FencingArbiter
    from m2pem.api.arbiter import Limits as Limits
    from m2pem.api.arbiter import ReclaimingArbiter as ReclaimingArbiter
    from m2pem.api.arbiter import ResolvedValue as ResolvedValue
    from m2pem.api.arbiter import SightedArbiter as SightedArbiter
    from m2pem.api.arbiter import adjusts as adjusts
    from m2pem.api.async_queue import AsyncQueue as AsyncQueue
    from m2pem.api.authoring import DataName as DataName
    from m2pem.api.authoring import Draft as Draft
    from m2pem.api.authoring import Editable as Editable
    from m2pem.api.authoring import MissionFiles as MissionFiles
    from m2pem.api.authoring import MissionSource as MissionSource
    from m2pem.api.authoring import Outline as Outline
    from m2pem.api.authoring import OutlineElement as OutlineElement
    from m2pem.api.authoring import OutlineProcess as OutlineProcess
    from m2pem.api.authoring import OutlineTrigger as OutlineTrigger
    from m2pem.api.authoring import SearchLimits as SearchLimits
    from m2pem.api.authoring import SearchProgress as SearchProgress
    from m2pem.api.behavior_parameters import BehaviorParameters as BehaviorParameters
    from m2pem.api.behavior_parameters import decode_parameters as decode_parameters
    from m2pem.api.behavior_parameters import encode_parameters as encode_parameters
    from m2pem.api.behavior_tracker import BehaviorTracker as BehaviorTracker
    from m2pem.api.bus import FleetBus as FleetBus
    from m2pem.api.capabilities import ArbiterCapabilities as ArbiterCapabilities
    from m2pem.api.capabilities import FaceCapabilities as FaceCapabilities
    from m2pem.api.capabilities import OcuCapabilities as OcuCapabilities
    from m2pem.api.clock import Clock as Clock
    from m2pem.api.clock import SystemClock as SystemClock
    from m2pem.api.commands import LazyCommand as LazyCommand
    from m2pem.api.commands import command_group as command_group
    from m2pem.api.commands import simulator_group as simulator_group
    from m2pem.api.connection_reader import ConnectionReader as ConnectionReader
    from m2pem.api.control import MissionControl as MissionControl
    from m2pem.api.declared_behaviors import read_declared_behaviors as read_declared_behaviors
    from m2pem.api.description import Description as Description
    from m2pem.api.description import Importance as Importance
    from m2pem.api.description import Kind as Kind
    from m2pem.api.description import describe as describe
    from m2pem.api.epoch_fence import EpochFence as EpochFence
    from m2pem.api.estimates import MissionEstimate as MissionEstimate
    from m2pem.api.estimates import NotEstimated as NotEstimated
    from m2pem.api.estimates import TaskEstimate as TaskEstimate
    from m2pem.api.estimates import VehicleEstimate as VehicleEstimate
    from m2pem.api.event_rules import UNKNOWN as UNKNOWN
    from m2pem.api.event_rules import AnswerRule as AnswerRule
    from m2pem.api.event_rules import EventCondition as EventCondition
    from m2pem.api.event_rules import EventThrower as EventThrower
    from m2pem.api.event_rules import Fields as Fields
    from m2pem.api.event_rules import ReceiveRule as ReceiveRule
    from m2pem.api.event_rules import SendRule as SendRule
    from m2pem.api.event_rules import Thrown as Thrown
    from m2pem.api.event_rules import ThrownEvents as ThrownEvents
    from m2pem.api.event_rules import Unknown as Unknown
    from m2pem.api.event_rules import read_rules as read_rules
    from m2pem.api.event_rules import read_template as read_template
    from m2pem.api.exporter import ExportedRecord as ExportedRecord
    from m2pem.api.exporter import ExportedRun as ExportedRun
    from m2pem.api.exporter import Exporter as Exporter
    from m2pem.api.exporter import ExportOptions as ExportOptions
    from m2pem.api.face import Face as Face
    from m2pem.api.face import FaceSettings as FaceSettings
    from m2pem.api.fence_check import BEHIND_RAD as BEHIND_RAD
    from m2pem.api.fence_check import OFFSET_M as OFFSET_M
    from m2pem.api.fence_check import find_breach as find_breach
    from m2pem.api.fence_check import known_yaw_rad as known_yaw_rad
    from m2pem.api.fence_check import stance_on as stance_on
    from m2pem.api.follower import Follower as Follower
    from m2pem.api.follower import Listener as Listener
    from m2pem.api.follower import follow as follow
    from m2pem.api.goals import GoalArbiter as GoalArbiter
    from m2pem.api.health import ExecutiveAddress as ExecutiveAddress
    from m2pem.api.health import HealthCheck as HealthCheck
    from m2pem.api.health import HealthStatus as HealthStatus
    from m2pem.api.health import listening_check as listening_check
    from m2pem.api.hosting import CutOffPolicy as CutOffPolicy
    from m2pem.api.hosting import Host as Host
    from m2pem.api.hosting import HostedArbiter as HostedArbiter
    from m2pem.api.hosting import HostLink as HostLink
    from m2pem.api.hosting import WhenCutOff as WhenCutOff
    from m2pem.api.latest_task import LatestTask as LatestTask
    from m2pem.api.log_context import current_run as current_run
    from m2pem.api.log_context import trace_ids as trace_ids
    from m2pem.api.map_geometries import shown_geometries as shown_geometries
    from m2pem.api.mission_control.watching import ControlEvent as ControlEvent
    from m2pem.api.ocu import Ocu as Ocu
    from m2pem.api.ocu import StandbyOcu as StandbyOcu
    from m2pem.api.operations import MAX_DATA_VALUES as MAX_DATA_VALUES
    from m2pem.api.operations import MAX_NAME_CHARACTERS as MAX_NAME_CHARACTERS
    from m2pem.api.operations import MAX_REASON_CHARACTERS as MAX_REASON_CHARACTERS
    from m2pem.api.operations import OPERATIONS as OPERATIONS
    from m2pem.api.operations import Operation as Operation
    from m2pem.api.people import ABSENT_AFTER_S as ABSENT_AFTER_S
    from m2pem.api.people import MAX_NOTE_CHARACTERS as MAX_NOTE_CHARACTERS
    from m2pem.api.people import PRESENCE_EVERY_S as PRESENCE_EVERY_S
    from m2pem.api.people import OpenControlRequest as OpenControlRequest
    from m2pem.api.people import OperatorPresence as OperatorPresence
    from m2pem.api.people import OperatorsChanged as OperatorsChanged
    from m2pem.api.remaining import RemainingRoute as RemainingRoute
    from m2pem.api.remaining import RemainingSurvey as RemainingSurvey
    from m2pem.api.remaining import RemainingWork as RemainingWork
    from m2pem.api.remaining import raw_parameters as raw_parameters
    from m2pem.api.remaining import restored_work as restored_work
    from m2pem.api.requirement_states import RequirementState as RequirementState
    from m2pem.api.requirement_states import RequirementStates as RequirementStates
    from m2pem.api.requirement_states import worst_first as worst_first
    from m2pem.api.revision import RevisionEffect as RevisionEffect
    from m2pem.api.revision import RevisionPreview as RevisionPreview
    from m2pem.api.revision import RevisionRefusal as RevisionRefusal
    from m2pem.api.revision import RunVersion as RunVersion
    from m2pem.api.run_view import RunView as RunView
    from m2pem.api.runs import CONTROL_REQUEST as CONTROL_REQUEST
    from m2pem.api.runs import NEWS as NEWS
    from m2pem.api.runs import SCHEDULE as SCHEDULE
    from m2pem.api.runs import Alert as Alert
    from m2pem.api.runs import GeometryVersion as GeometryVersion
    from m2pem.api.runs import HandedOver as HandedOver
    from m2pem.api.runs import IncidentPreview as IncidentPreview
    from m2pem.api.runs import IncidentVerdict as IncidentVerdict
    from m2pem.api.runs import OpenIncident as OpenIncident
    from m2pem.api.runs import OpenPrompt as OpenPrompt
    from m2pem.api.runs import PromptClosed as PromptClosed
    from m2pem.api.runs import RequirementOutlook as RequirementOutlook
    from m2pem.api.runs import RequirementProspect as RequirementProspect
    from m2pem.api.runs import RunId as RunId
    from m2pem.api.runs import RunStatus as RunStatus
    from m2pem.api.runs import RunSummary as RunSummary
    from m2pem.api.runs import ScopeData as ScopeData
    from m2pem.api.runs import SimulationResult as SimulationResult
    from m2pem.api.runs import StampedRecord as StampedRecord
    from m2pem.api.runs import TelemetrySample as TelemetrySample
    from m2pem.api.schedule import WHEN_FREE as WHEN_FREE
    from m2pem.api.schedule import Concurrency as Concurrency
    from m2pem.api.schedule import EntryId as EntryId
    from m2pem.api.schedule import Missed as Missed
    from m2pem.api.schedule import Schedule as Schedule
    from m2pem.api.schedule import ScheduleChanged as ScheduleChanged
    from m2pem.api.schedule import ScheduledMission as ScheduledMission
    from m2pem.api.schedule import ScheduledStatus as ScheduledStatus
    from m2pem.api.schedule import SettledTime as SettledTime
    from m2pem.api.schedule import Settlement as Settlement
    from m2pem.api.schedule import When as When
    from m2pem.api.service import Service as Service
    from m2pem.api.service import ServiceContext as ServiceContext
    from m2pem.api.service import ServiceError as ServiceError
    from m2pem.api.statistics import DurationCounts as DurationCounts
    from m2pem.api.statistics import ExecutiveStatistics as ExecutiveStatistics
    from m2pem.api.statistics import LinkStatistics as LinkStatistics
    from m2pem.api.statistics import SubscriptionStatistics as SubscriptionStatistics
    from m2pem.api.telemetry import Detection as Detection
    from m2pem.api.telemetry import GeoPosition as GeoPosition
    from m2pem.api.telemetry import LinkState as LinkState
    from m2pem.api.telemetry import PayloadState as PayloadState
    from m2pem.api.telemetry import TeamMemberState as TeamMemberState
    from m2pem.api.telemetry import TeamState as TeamState
    from m2pem.api.telemetry import Telemetry as Telemetry
    from m2pem.api.telemetry import VehicleState as VehicleState
    from m2pem.bpmn import parse_mission as parse_mission
    from m2pem.engine.records import Record as Record
    from m2pem.findings import Finding as Finding
    from m2pem.findings import Severity as Severity
    from m2pem.fleet.approval import file_digest as file_digest
    from m2pem.fleet.approval import person_of as person_of
    from m2pem.fleet.behaviors import FLOWN as FLOWN
    from m2pem.fleet.behaviors import SHARED as SHARED
    from m2pem.fleet.behaviors import takeoff_first as takeoff_first
    from m2pem.fleet.endurance import lasts_s as lasts_s
    from m2pem.fleet.fleet import Fleet as Fleet
    from m2pem.geo.cameras import KNOWN_CAMERAS as KNOWN_CAMERAS
    from m2pem.geo.cameras import ImagePlan as ImagePlan
    from m2pem.geo.cameras import SurveyCamera as SurveyCamera
    from m2pem.geo.cameras import image_plan as image_plan
    from m2pem.geo.elevation_files import TERRAIN_FOLDER as TERRAIN_FOLDER
    from m2pem.geo.elevation_files import Terrain as Terrain
    from m2pem.geo.elevation_files import TerrainError as TerrainError
    from m2pem.geo.fence import Fence as Fence
    from m2pem.geo.geoid import ellipsoidal_m as ellipsoidal_m
    from m2pem.geo.geoid import mean_sea_level_m as mean_sea_level_m
    from m2pem.geo.geoid import undulation_m as undulation_m
    from m2pem.geo.geojson import GeometryError as GeometryError
    from m2pem.geo.geojson import as_geojson as as_geojson
    from m2pem.geo.geojson import kind_of as kind_of
    from m2pem.geo.geojson import parse_geojson as parse_geojson
    from m2pem.geo.geometry_files import READ_SUFFIXES as READ_SUFFIXES
    from m2pem.geo.geometry_files import FileFormat as FileFormat
    from m2pem.geo.geometry_files import FileProblem as FileProblem
    from m2pem.geo.geometry_files import GeometryFile as GeometryFile
    from m2pem.geo.geometry_files import NamedGeometry as NamedGeometry
    from m2pem.geo.geometry_files import read_geometry_file as read_geometry_file
    from m2pem.geo.geometry_files import write_geometry_file as write_geometry_file
    from m2pem.geo.local_frame import EastNorth as EastNorth
    from m2pem.geo.local_frame import LatLon as LatLon
    from m2pem.geo.local_frame import LocalFrame as LocalFrame
    from m2pem.geo.local_frame import distance_m as distance_m
    from m2pem.geo.local_frame import offset as offset
    from m2pem.geo.polygon import convex_hull as convex_hull
    from m2pem.geo.polygon import edges_enclose as edges_enclose
    from m2pem.geo.polygon import middle_of as middle_of
    from m2pem.geo.polyline import Polyline as Polyline
    from m2pem.geo.polyline import Segment as Segment
    from m2pem.geo.survey_pattern import Surveyor as Surveyor
    from m2pem.geo.survey_pattern import SurveyPattern as SurveyPattern
    from m2pem.geo.survey_pattern import SurveyRoute as SurveyRoute
    from m2pem.geo.survey_pattern import best_heading_rad as best_heading_rad
    from m2pem.geo.survey_pattern import survey_routes as survey_routes
    from m2pem.geo.survey_tracks import SURVEY_SPACING_M as SURVEY_SPACING_M
    from m2pem.geo.survey_tracks import SurveyTracks as SurveyTracks
    from m2pem.geo.terrain import ProfilePoint as ProfilePoint
    from m2pem.geo.terrain import lowest as lowest
    from m2pem.geo.terrain import profile as profile
    from m2pem.geo.terrain_following import TOLERANCE_M as TOLERANCE_M
    from m2pem.geo.terrain_following import follow_terrain as follow_terrain
    from m2pem.geo.terrain_following import not_covered as not_covered
    from m2pem.mission.behavior import BehaviorType as BehaviorType
    from m2pem.mission.behavior import Decision as Decision
    from m2pem.mission.catalogue import BehaviorSpec as BehaviorSpec
    from m2pem.mission.catalogue import BehaviorState as BehaviorState
    from m2pem.mission.catalogue import ParameterKind as ParameterKind
    from m2pem.mission.catalogue import ParameterSpec as ParameterSpec
    from m2pem.mission.catalogue import ResourceId as ResourceId
    from m2pem.mission.catalogue import ResumePolicy as ResumePolicy
    from m2pem.mission.expression.described import expression_dialects as expression_dialects
    from m2pem.mission.geometry import Area as Area
    from m2pem.mission.geometry import Point as Point
    from m2pem.mission.geometry import Route as Route
    from m2pem.mission.geometry import VehiclePosition as VehiclePosition
    from m2pem.mission.library import MissionFile as MissionFile
    from m2pem.mission.mission import Mission as Mission
    from m2pem.mission.values import Value as Value
    from m2pem.suggestions import did_you_mean as did_you_mean
    from m2pem.units import US_PER_S as US_PER_S
    from m2pem.units import Dimension as Dimension
    from m2pem.units import UnitError as UnitError
    from m2pem.units import quantity as quantity

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
    "m2pem.mission.expression.described": "expression_dialects",
    "m2pem.mission.geometry": "Area Point Route VehiclePosition",
    "m2pem.mission.values": "Value",
    "m2pem.fleet.behaviors": "FLOWN SHARED takeoff_first",
    "m2pem.geo.cameras": "ImagePlan KNOWN_CAMERAS SurveyCamera image_plan",
    "m2pem.geo.fence": "Fence",
    "m2pem.api.fence_check": "BEHIND_RAD OFFSET_M find_breach known_yaw_rad stance_on",
    "m2pem.fleet.endurance": "lasts_s",
    "m2pem.fleet.approval": "file_digest person_of",
    "m2pem.fleet.fleet": "Fleet",
    "m2pem.geo.geoid": "ellipsoidal_m mean_sea_level_m undulation_m",
    "m2pem.geo.geojson": "GeometryError as_geojson kind_of parse_geojson",
    "m2pem.geo.geometry_files": (
        "FileFormat FileProblem GeometryFile NamedGeometry READ_SUFFIXES read_geometry_file"
        " write_geometry_file"
    ),
    "m2pem.geo.local_frame": "EastNorth LatLon LocalFrame distance_m offset",
    "m2pem.geo.polygon": "convex_hull edges_enclose middle_of",
    "m2pem.geo.polyline": "Polyline Segment",
    "m2pem.geo.survey_pattern": "SurveyPattern SurveyRoute Surveyor best_heading_rad survey_routes",
    "m2pem.geo.survey_tracks": "SURVEY_SPACING_M SurveyTracks",
    "m2pem.geo.elevation_files": "TERRAIN_FOLDER Terrain TerrainError",
    "m2pem.geo.terrain": "ProfilePoint lowest profile",
    "m2pem.geo.terrain_following": "TOLERANCE_M follow_terrain not_covered",
    "m2pem.suggestions": "did_you_mean",
    "m2pem.units": "US_PER_S Dimension UnitError quantity",
}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = list(_LAZY)


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_LAZY[name]), name)
    globals()[name] = value
    return value
