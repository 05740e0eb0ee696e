"""The fold of a run: what each record does to its state. Nothing else changes a `RunState`.

An applier never decides, and never fails on a journal that the engine wrote. It depends only on the
state and the record, so that a replay by a later release gives the same state. `APPLIERS`, at the
end, has the applier of each kind of record.
"""

from collections.abc import Callable
from typing import Any

from m2pem.engine import records as r
from m2pem.engine.apply import (
    compensation,
    events,
    incidents,
    requirements,
    revision,
    run,
    tasks,
    tokens,
)
from m2pem.engine.state import RunState


def apply(state: RunState, record: r.Record) -> None:
    """Fold one record into the state."""
    state.seq += 1
    APPLIERS[type(record)](state, record)


APPLIERS: dict[type, Callable[[RunState, Any], None]] = {
    r.RunStarted: run.run_started,
    r.RunClaimed: run.run_claimed,
    r.RunPaused: run.run_paused,
    r.RunResumed: run.run_resumed,
    r.BreakpointsSet: run.breakpoints_set,
    r.BreakpointReached: run.nothing,
    r.OperatorSetData: run.nothing,
    r.RunEnded: run.run_ended,
    r.RunYielded: run.run_yielded,
    r.InputIgnored: run.nothing,
    r.InputDeferred: run.input_deferred,
    r.InputSeen: run.input_seen,
    r.OperatorTookControl: run.control_taken,
    r.OperatorGaveControlBack: run.control_returned,
    r.ControlRequested: run.control_requested,
    r.ControlRequestEnded: run.control_request_ended,
    r.OperatorNote: run.nothing,
    r.GeometryReceived: run.geometry_received,
    r.MissionRevised: revision.mission_revised,
    r.ScopeOpened: tokens.scope_opened,
    r.ScopeClosed: tokens.scope_closed,
    r.ScopeInterrupted: tokens.scope_interrupted,
    r.ScopeCompleting: tokens.scope_completing,
    r.TokenEntered: tokens.token_entered,
    r.TokenLeft: tokens.token_left,
    r.ActivitiesChosen: tokens.activities_chosen,
    r.TokensGathered: tokens.tokens_gathered,
    r.InstanceOutput: tokens.instance_output,
    r.FlowTaken: run.nothing,
    r.GatewayActivated: tokens.gateway_activated,
    r.GatewayReset: tokens.gateway_reset,
    r.AllocationRequested: tasks.allocation_requested,
    r.AllocationDelayed: tasks.allocation_delayed,
    r.ResourcesAllocated: tasks.allocation_ended,
    r.AllocationEnded: tasks.allocation_ended,
    r.BehaviorRequested: tasks.behavior_requested,
    r.BehaviorProgressed: tasks.behavior_progressed,
    r.BehaviorAdjusted: tasks.behavior_adjusted,
    r.BehaviorCancelRequested: tasks.behavior_cancel_requested,
    r.BehaviorUnsettled: tasks.behavior_unsettled,
    r.BehaviorContinued: tasks.behavior_continued,
    r.BehaviorRestarted: tasks.behavior_restarted,
    r.BehaviorEnded: tasks.behavior_ended,
    r.WorkReassigned: tasks.work_reassigned,
    r.ResourceReturned: tasks.resource_returned,
    r.ResourceKept: tasks.resource_kept,
    r.KeepingEnded: tasks.keeping_ended,
    r.PromptOpened: tasks.prompt_opened,
    r.PromptAnswered: tasks.prompt_ended,
    r.PromptWithdrawn: tasks.prompt_ended,
    r.ServiceRequested: tasks.service_requested,
    r.ServiceEnded: tasks.service_ended,
    r.ServiceWithdrawn: tasks.service_ended,
    r.DataWritten: events.data_written,
    r.EventAwaited: events.event_awaited,
    r.EventTriggered: events.event_triggered,
    r.ConditionReset: events.condition_reset,
    r.SignalThrown: run.nothing,
    r.MessageThrown: events.message_thrown,
    r.EscalationThrown: run.nothing,
    r.ErrorThrown: run.nothing,
    r.IncidentOpened: incidents.incident_opened,
    r.IncidentUpdated: run.nothing,
    r.IncidentResolved: incidents.incident_resolved,
    r.IncidentClosed: incidents.incident_closed,
    r.CompensationEnabled: compensation.compensation_enabled,
    r.CompensationTriggered: compensation.compensation_triggered,
    r.CompensationBegan: compensation.compensation_began,
    r.CompensationEnded: compensation.compensation_ended,
    r.ScopeReopened: compensation.scope_reopened,
    r.TransactionCancelled: tokens.transaction_cancelled,
    r.RequirementMonitored: requirements.requirement_monitored,
    r.RequirementDropped: requirements.requirement_dropped,
    r.RequirementDecided: requirements.requirement_judged,
    r.RequirementLeftOpen: requirements.requirement_judged,
    r.TelemetryConditionChanged: requirements.telemetry_condition_changed,
}
