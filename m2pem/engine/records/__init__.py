"""Records: the events of a run in their order, as in event sourcing. The journal stores them.

`m2pem.engine.apply` folds them into `RunState`, and nothing else changes it. Names and fields are
an interface (docs/records.md): fields and records are only added. As JSON, a record is an object
with its name under "record"; the journal adds "run", "seq" and "t" (mission time, seconds).

`token` is the id of a token, `scope` the id of the scope it is in, `process` the id of the process
that contains `element`.
"""

from typing import TypeAlias, Union

from m2pem.engine.inputs import RequestOutcome as RequestOutcome
from m2pem.engine.inputs import RequirementVerdict as RequirementVerdict
from m2pem.engine.records.base import RunOutcome as RunOutcome
from m2pem.engine.records.base import TokenOutcome as TokenOutcome
from m2pem.engine.records.base import Trigger as Trigger
from m2pem.engine.records.compensation import CompensationBegan as CompensationBegan
from m2pem.engine.records.compensation import CompensationEnabled as CompensationEnabled
from m2pem.engine.records.compensation import CompensationEnded as CompensationEnded
from m2pem.engine.records.compensation import CompensationTriggered as CompensationTriggered
from m2pem.engine.records.compensation import ScopeReopened as ScopeReopened
from m2pem.engine.records.compensation import TransactionCancelled as TransactionCancelled
from m2pem.engine.records.events import ConditionReset as ConditionReset
from m2pem.engine.records.events import DataWritten as DataWritten
from m2pem.engine.records.events import ErrorThrown as ErrorThrown
from m2pem.engine.records.events import EscalationThrown as EscalationThrown
from m2pem.engine.records.events import EventAwaited as EventAwaited
from m2pem.engine.records.events import EventTriggered as EventTriggered
from m2pem.engine.records.events import MessageThrown as MessageThrown
from m2pem.engine.records.events import SignalThrown as SignalThrown
from m2pem.engine.records.incidents import IncidentClosed as IncidentClosed
from m2pem.engine.records.incidents import IncidentOpened as IncidentOpened
from m2pem.engine.records.incidents import IncidentResolved as IncidentResolved
from m2pem.engine.records.incidents import IncidentUpdated as IncidentUpdated
from m2pem.engine.records.requirements import RequirementDecided as RequirementDecided
from m2pem.engine.records.requirements import RequirementDropped as RequirementDropped
from m2pem.engine.records.requirements import RequirementLeftOpen as RequirementLeftOpen
from m2pem.engine.records.requirements import RequirementMonitored as RequirementMonitored
from m2pem.engine.records.requirements import TelemetryConditionChanged as TelemetryConditionChanged
from m2pem.engine.records.run import BreakpointReached as BreakpointReached
from m2pem.engine.records.run import BreakpointsSet as BreakpointsSet
from m2pem.engine.records.run import ControlRequested as ControlRequested
from m2pem.engine.records.run import ControlRequestEnded as ControlRequestEnded
from m2pem.engine.records.run import GeometryReceived as GeometryReceived
from m2pem.engine.records.run import InputDeferred as InputDeferred
from m2pem.engine.records.run import InputIgnored as InputIgnored
from m2pem.engine.records.run import InputSeen as InputSeen
from m2pem.engine.records.run import MissionRevised as MissionRevised
from m2pem.engine.records.run import OperatorGaveControlBack as OperatorGaveControlBack
from m2pem.engine.records.run import OperatorNote as OperatorNote
from m2pem.engine.records.run import OperatorSetData as OperatorSetData
from m2pem.engine.records.run import OperatorTookControl as OperatorTookControl
from m2pem.engine.records.run import RunClaimed as RunClaimed
from m2pem.engine.records.run import RunEnded as RunEnded
from m2pem.engine.records.run import RunPaused as RunPaused
from m2pem.engine.records.run import RunResumed as RunResumed
from m2pem.engine.records.run import RunStarted as RunStarted
from m2pem.engine.records.run import RunYielded as RunYielded
from m2pem.engine.records.run import StopReason as StopReason
from m2pem.engine.records.tasks import AllocationDelayed as AllocationDelayed
from m2pem.engine.records.tasks import AllocationEnded as AllocationEnded
from m2pem.engine.records.tasks import AllocationRequested as AllocationRequested
from m2pem.engine.records.tasks import BehaviorAdjusted as BehaviorAdjusted
from m2pem.engine.records.tasks import BehaviorCancelRequested as BehaviorCancelRequested
from m2pem.engine.records.tasks import BehaviorContinued as BehaviorContinued
from m2pem.engine.records.tasks import BehaviorEnded as BehaviorEnded
from m2pem.engine.records.tasks import BehaviorProgressed as BehaviorProgressed
from m2pem.engine.records.tasks import BehaviorRequested as BehaviorRequested
from m2pem.engine.records.tasks import BehaviorRestarted as BehaviorRestarted
from m2pem.engine.records.tasks import BehaviorUnsettled as BehaviorUnsettled
from m2pem.engine.records.tasks import KeepingEnded as KeepingEnded
from m2pem.engine.records.tasks import PromptAnswered as PromptAnswered
from m2pem.engine.records.tasks import PromptOpened as PromptOpened
from m2pem.engine.records.tasks import PromptWithdrawn as PromptWithdrawn
from m2pem.engine.records.tasks import ResourceKept as ResourceKept
from m2pem.engine.records.tasks import ResourceReturned as ResourceReturned
from m2pem.engine.records.tasks import ResourcesAllocated as ResourcesAllocated
from m2pem.engine.records.tasks import ServiceEnded as ServiceEnded
from m2pem.engine.records.tasks import ServiceRequested as ServiceRequested
from m2pem.engine.records.tasks import ServiceWithdrawn as ServiceWithdrawn
from m2pem.engine.records.tasks import WorkReassigned as WorkReassigned
from m2pem.engine.records.tokens import ActivitiesChosen as ActivitiesChosen
from m2pem.engine.records.tokens import FlowTaken as FlowTaken
from m2pem.engine.records.tokens import GatewayActivated as GatewayActivated
from m2pem.engine.records.tokens import GatewayReset as GatewayReset
from m2pem.engine.records.tokens import InstanceOutput as InstanceOutput
from m2pem.engine.records.tokens import ScopeClosed as ScopeClosed
from m2pem.engine.records.tokens import ScopeCompleting as ScopeCompleting
from m2pem.engine.records.tokens import ScopeInterrupted as ScopeInterrupted
from m2pem.engine.records.tokens import ScopeOpened as ScopeOpened
from m2pem.engine.records.tokens import TokenEntered as TokenEntered
from m2pem.engine.records.tokens import TokenLeft as TokenLeft
from m2pem.engine.records.tokens import TokensGathered as TokensGathered

Record: TypeAlias = Union[
    RunStarted,
    RunClaimed,
    RunPaused,
    RunResumed,
    BreakpointsSet,
    BreakpointReached,
    OperatorSetData,
    RunEnded,
    RunYielded,
    InputIgnored,
    InputDeferred,
    InputSeen,
    OperatorTookControl,
    OperatorGaveControlBack,
    ControlRequested,
    ControlRequestEnded,
    OperatorNote,
    GeometryReceived,
    MissionRevised,
    ScopeOpened,
    ScopeClosed,
    ScopeInterrupted,
    ScopeCompleting,
    TokenEntered,
    TokenLeft,
    ActivitiesChosen,
    TokensGathered,
    InstanceOutput,
    FlowTaken,
    GatewayActivated,
    GatewayReset,
    AllocationRequested,
    AllocationDelayed,
    ResourcesAllocated,
    AllocationEnded,
    BehaviorRequested,
    BehaviorProgressed,
    BehaviorAdjusted,
    BehaviorCancelRequested,
    BehaviorUnsettled,
    BehaviorContinued,
    BehaviorRestarted,
    BehaviorEnded,
    WorkReassigned,
    ResourceReturned,
    ResourceKept,
    KeepingEnded,
    PromptOpened,
    PromptAnswered,
    PromptWithdrawn,
    ServiceRequested,
    ServiceEnded,
    ServiceWithdrawn,
    DataWritten,
    EventAwaited,
    EventTriggered,
    ConditionReset,
    SignalThrown,
    MessageThrown,
    EscalationThrown,
    ErrorThrown,
    IncidentOpened,
    IncidentUpdated,
    IncidentResolved,
    IncidentClosed,
    CompensationEnabled,
    CompensationTriggered,
    CompensationBegan,
    CompensationEnded,
    ScopeReopened,
    TransactionCancelled,
    RequirementMonitored,
    RequirementDropped,
    RequirementDecided,
    RequirementLeftOpen,
    TelemetryConditionChanged,
]
