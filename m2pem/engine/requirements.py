"""What the engine does of monitored requirements: it records verdicts, and acts on violations.

The verdicts themselves are inputs, which `m2pem.monitors` finds from the records.
"""

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.state import RunStatus
from m2pem.engine.throwing import throw_error_in_process
from m2pem.engine.triggering import throw_signal


def monitor(x: Execution, item: i.StartRun | i.Revise) -> None:
    """Record which requirements the run is monitored for from now on, and what telemetry says of
    their conditions.

    One of the same formula as before goes on, with its verdict; another one begins.
    """
    requirements = item.requirements
    before = x.state.requirements
    formulas = {each.id: each.formula for each in requirements}
    for number, known in list(before.items()):
        if formulas.get(number) != known.formula:
            x.emit(r.RequirementDropped(number))
    for each in requirements:
        record = r.RequirementMonitored(
            each.id, each.formula, each.english, each.elements, each.on_violation, each.conditions
        )
        if before.get(each.id) != record:
            x.emit(record)
    for condition, holds in item.conditions.items():
        if x.state.telemetry_conditions.get(condition) is not holds:
            x.emit(r.TelemetryConditionChanged(condition, holds))


def requirement_decided(x: Execution, item: i.RequirementDecided) -> None:
    """Record a verdict; a violation throws the error or signal that the requirement names."""
    monitored = _open(x, item.requirement)
    if monitored is None:
        return
    x.emit(
        r.RequirementDecided(
            item.requirement, item.verdict, monitored.english, item.decided_us, item.because
        )
    )
    if item.verdict is i.RequirementVerdict.VIOLATED and x.state.status is RunStatus.RUNNING:
        _act(x, monitored)


def requirement_left_open(x: Execution, item: i.RequirementLeftOpen) -> None:
    """Record that the end of the run does not decide a requirement."""
    monitored = _open(x, item.requirement)
    if monitored is not None:
        x.emit(r.RequirementLeftOpen(item.requirement, monitored.english, item.because))


def _open(x: Execution, requirement: str) -> r.RequirementMonitored | None:
    """The requirement, if it has no verdict yet; else the input is ignored."""
    monitored = x.state.requirements.get(requirement)
    if monitored is None:
        x.ignore(f"the run is not monitored for requirement {requirement}")
    elif requirement in x.state.verdicts:
        x.ignore(f"requirement {requirement} was decided before")
    else:
        return monitored
    return None


def _act(x: Execution, monitored: r.RequirementMonitored) -> None:
    kind, _, name = monitored.on_violation.partition(":")
    if kind == "error":
        reason = f"requirement {monitored.requirement} is violated: {monitored.english}"
        throw_error_in_process(x, name, reason)
    elif kind == "signal":
        x.emit(r.SignalThrown(name, by=f"requirement {monitored.requirement}"))
        throw_signal(x, name, {})


def condition_changed(x: Execution, item: i.TelemetryConditionChanged) -> None:
    """Record what telemetry says of a condition now."""
    known = x.state.telemetry_conditions.get(item.condition)
    if known is item.holds:
        x.ignore(f"telemetry said the same of {item.condition} before")
        return
    x.emit(r.TelemetryConditionChanged(item.condition, item.holds))
