"""What records about the run as a whole do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply.tasks import end_loss
from m2pem.engine.state import (
    Breakpoints,
    ControlRequest,
    RunState,
    RunStatus,
)
from m2pem.mission.losses import TAKEN_OVER


def run_started(state: RunState, record: r.RunStarted) -> None:
    state.status = RunStatus.RUNNING
    state.by = record.by
    state.started_us = record.started_us
    state.expression_rules = record.expression_rules


def run_claimed(state: RunState, record: r.RunClaimed) -> None:
    state.epoch = record.epoch
    state.expression_rules = record.expression_rules or state.expression_rules
    state.telemetry_conditions.clear()  # no executive has looked meanwhile
    state.last_allocation += record.lost
    state.last_keeping += record.lost
    state.last_behavior += record.lost
    state.last_prompt += record.lost
    state.last_service += record.lost
    state.last_incident += record.lost


def run_paused(state: RunState, record: r.RunPaused) -> None:
    state.status = RunStatus.PAUSED
    state.paused_at_us = record.at_us
    state.stepping = False


def run_resumed(state: RunState, record: r.RunResumed) -> None:
    state.status = RunStatus.RUNNING
    state.paused_total_us += record.at_us - state.paused_at_us
    state.deferred.clear()


def breakpoints_set(state: RunState, record: r.BreakpointsSet) -> None:
    wanted = record.elements or record.conditions
    state.breakpoints = (
        Breakpoints(frozenset(record.elements), record.conditions) if wanted else None
    )
    state.stepping = record.step


def run_ended(state: RunState, record: r.RunEnded) -> None:
    state.status = RunStatus.ENDED
    state.outcome = record.outcome
    state.detail = record.detail
    state.kept_messages.clear()
    state.kept.clear()
    state.deferred.clear()
    state.yielded = ()


def run_yielded(state: RunState, record: r.RunYielded) -> None:
    state.yielded = record.steps


def nothing(state: RunState, record: r.Record) -> None:
    pass


def input_deferred(state: RunState, record: r.InputDeferred) -> None:
    state.deferred.append(record.input)


def input_seen(state: RunState, record: r.InputSeen) -> None:
    state.seen[record.id] = None


def control_taken(state: RunState, record: r.OperatorTookControl) -> None:
    state.taken[record.resource] = record.by


def control_returned(state: RunState, record: r.OperatorGaveControlBack) -> None:
    del state.taken[record.resource]
    state.control_requests.pop(record.resource, None)
    end_loss(state, record.resource, TAKEN_OVER)


def control_requested(state: RunState, record: r.ControlRequested) -> None:
    state.control_requests[record.resource] = ControlRequest(record.by, record.holder)


def control_request_ended(state: RunState, record: r.ControlRequestEnded) -> None:
    state.control_requests.pop(record.resource, None)


def geometry_received(state: RunState, record: r.GeometryReceived) -> None:
    state.geometries[record.name] = record.geometry
