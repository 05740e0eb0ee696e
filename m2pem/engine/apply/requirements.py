"""What records about requirements do to the state."""

from m2pem.engine import records as r
from m2pem.engine.state import RunState


def requirement_monitored(state: RunState, record: r.RequirementMonitored) -> None:
    state.requirements[record.requirement] = record


def requirement_dropped(state: RunState, record: r.RequirementDropped) -> None:
    del state.requirements[record.requirement]
    state.verdicts.pop(record.requirement, None)


def requirement_judged(
    state: RunState, record: r.RequirementDecided | r.RequirementLeftOpen
) -> None:
    state.verdicts[record.requirement] = record


def telemetry_condition_changed(state: RunState, record: r.TelemetryConditionChanged) -> None:
    state.telemetry_conditions[record.condition] = record.holds
