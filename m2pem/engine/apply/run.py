"""What records about the run as a whole do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply.appliers import Appliers
from m2pem.engine.state import (
    RunState,
    RunStatus,
)


def _run_started(state: RunState, record: r.RunStarted) -> None:
    state.status = RunStatus.RUNNING
    state.started_us = record.started_us


def _run_claimed(state: RunState, record: r.RunClaimed) -> None:
    state.epoch = record.epoch
    state.last_behavior += record.lost
    state.last_prompt += record.lost
    state.last_service += record.lost


def _run_paused(state: RunState, record: r.RunPaused) -> None:
    state.status = RunStatus.PAUSED
    state.paused_at_us = record.at_us


def _run_resumed(state: RunState, record: r.RunResumed) -> None:
    state.status = RunStatus.RUNNING
    state.paused_total_us += record.at_us - state.paused_at_us
    state.deferred.clear()


def _run_ended(state: RunState, record: r.RunEnded) -> None:
    state.status = RunStatus.ENDED
    state.outcome = record.outcome
    state.detail = record.detail
    state.mailbox.clear()
    state.deferred.clear()
    state.yielded = ()


def _run_yielded(state: RunState, record: r.RunYielded) -> None:
    state.yielded = record.steps


def _nothing(state: RunState, record: r.Record) -> None:
    pass


def _input_deferred(state: RunState, record: r.InputDeferred) -> None:
    state.deferred.append(record.input)


def _input_seen(state: RunState, record: r.InputSeen) -> None:
    state.seen[record.id] = None


def _control_taken(state: RunState, record: r.OperatorTookControl) -> None:
    state.taken[record.resource] = record.by


def _control_returned(state: RunState, record: r.OperatorGaveControlBack) -> None:
    del state.taken[record.resource]


def _geometry_received(state: RunState, record: r.GeometryReceived) -> None:
    state.geometries[record.name] = record.geometry


APPLIERS: Appliers = {
    r.RunStarted: _run_started,
    r.RunClaimed: _run_claimed,
    r.RunPaused: _run_paused,
    r.RunResumed: _run_resumed,
    r.RunEnded: _run_ended,
    r.RunYielded: _run_yielded,
    r.InputIgnored: _nothing,
    r.InputDeferred: _input_deferred,
    r.InputSeen: _input_seen,
    r.OperatorTookControl: _control_taken,
    r.OperatorGaveControlBack: _control_returned,
    r.GeometryReceived: _geometry_received,
    r.FlowTaken: _nothing,
    r.SignalThrown: _nothing,
    r.EscalationThrown: _nothing,
    r.ErrorThrown: _nothing,
}
