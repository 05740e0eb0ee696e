"""Deciding inputs: the handlers that turn each input into records.

Decisions may change between releases; the decided records are in the journal, and `apply` alone
replays them. A handler that finds an input redundant calls `x.ignore` and does nothing else.
`_DECIDERS`, at the end, has the handler of each kind of input.
"""

from collections.abc import Callable
from typing import Any

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.arming import arm_entered, next_timer
from m2pem.engine.breakpoints import set_breakpoints, set_data
from m2pem.engine.data import flatten
from m2pem.engine.elements.activities import complete
from m2pem.engine.elements.allocations import resources_chosen, resources_not_free
from m2pem.engine.elements.behaviors import (
    behavior_missing,
    behavior_preempted,
    behavior_reported,
    control_request_ended,
    control_requested,
    control_returned,
    control_taken,
    recovery_answered,
    resource_fault,
    resource_returned,
)
from m2pem.engine.elements.subprocesses import begin
from m2pem.engine.execution import received_messages
from m2pem.engine.lifecycle import Admission, admission
from m2pem.engine.records import RunOutcome
from m2pem.engine.requirements import (
    condition_changed,
    monitor,
    requirement_decided,
    requirement_left_open,
)
from m2pem.engine.resolving import resolve_incident, why_refused
from m2pem.engine.revision import revise
from m2pem.engine.scopes import end_run
from m2pem.engine.state import RunStatus
from m2pem.engine.steps import Steps
from m2pem.engine.throwing import throw_error
from m2pem.engine.triggering import (
    arm_conditional_starts,
    arm_triggered_timers,
    receive,
    throw_signal,
    trigger,
)
from m2pem.mission.elements import Activity
from m2pem.mission.expression import EXPRESSION_RULES

_THROW_NOTHING = (
    i.Continue,
    i.StopRun,
    i.PauseRun,
    i.SetBreakpoints,
    i.ClaimRun,
    i.GeometrySet,
    i.OperatorNoted,
    i.Revise,
)


def decide(x: Steps, item: i.Input) -> None:
    """Emit the records of an input; the steps that it causes are left in the queue."""
    match admission(x.state.status, item):
        case Admission.IGNORE:
            x.ignore(f"{type(item).__name__} while the run is {x.state.status.value}")
        case Admission.DEFER:
            _defer(x, item)
        case Admission.DECIDE:
            number = getattr(item, "id", "")
            if number in x.state.seen:
                x.ignore(f"{type(item).__name__} {number} was taken before")
                return
            if not isinstance(item, _THROW_NOTHING):
                arm_entered(x)  # tokens that a batch left over wait for what is thrown now
                if admission(x.state.status, item) is not Admission.DECIDE:  # a condition was wrong
                    x.ignore(f"{type(item).__name__} while the run is {x.state.status.value}")
                    return
            _DECIDERS[type(item)](x, item)


def _defer(x: Steps, item: i.Input) -> None:
    refusal = ""
    if isinstance(item, i.PromptAnswer):
        refusal = _why_refused(x, item)
    elif isinstance(item, i.ResolveIncident):
        refusal = why_refused(x.state, x.fleet, item)
    if refusal:
        x.ignore(refusal)
    else:
        x.emit(r.InputDeferred(item))


# --- the run ------------------------------------------------------------------------------------


def _start(x: Steps, item: i.StartRun) -> None:
    try:
        process = x.mission.process(item.process)
    except KeyError:
        x.ignore(f"the mission has no process {item.process!r}")
        return
    x.emit(r.RunStarted(process.id, x.now_us, item.by, EXPRESSION_RULES))
    if item.step:
        x.emit(r.BreakpointsSet(step=True, by=item.by))
        x.look_for_breakpoints()
    monitor(x, item)
    for resource, holder in item.taken.items():
        x.emit(r.OperatorTookControl(resource, holder))
    x.emit(r.ScopeOpened(1, process.id, process.id))
    root = x.state.scopes[1]
    for name, value in item.data.items():
        for key, entry in flatten(name, value):
            x.emit(r.DataWritten(0, process.id, process.id, root.id, key, entry, root.id))
    if not arm_triggered_timers(x, root):
        return
    begin(x, root)
    if root.id in x.state.scopes:
        arm_conditional_starts(x, root)


def _claim(x: Steps, item: i.ClaimRun) -> None:
    rules = EXPRESSION_RULES if x.state.expression_rules != EXPRESSION_RULES else 0
    x.emit(r.RunClaimed(item.epoch, item.by, item.lost, rules))


def _stop(x: Steps, item: i.StopRun) -> None:
    end_run(x, RunOutcome.STOPPED, item.reason or (f"stopped by {item.by}" if item.by else ""))


def _pause(x: Steps, item: i.PauseRun) -> None:
    x.emit(r.RunPaused(x.now_us, item.by))


def _resume(x: Steps, item: i.ResumeRun, steps: int = 0) -> None:
    deferred = list(x.state.deferred)
    x.emit(r.RunResumed(x.now_us, item.by))
    x.look_for_breakpoints()
    if x.pausing is not None:
        x.pausing.steps = steps
    x.reload_queue()
    # A breakpoint may have paused it before these were looked at, and an operator may have changed
    # data since; another process may go on with it.
    x.joins_to_check.update(x.state.scopes)
    x.data_changed = True
    for late in deferred:
        x.run_steps()
        decide(x, late)


def _step(x: Steps, item: i.StepRun) -> None:
    there = x.state.breakpoints
    elements, conditions = (sorted(there.elements), there.conditions) if there else ((), ())
    x.emit(r.BreakpointsSet(tuple(elements), conditions, True, item.by))
    _resume(x, i.ResumeRun(item.by), steps=1)


def _set_breakpoints(x: Steps, item: i.SetBreakpoints) -> None:
    set_breakpoints(x, item)
    x.look_for_breakpoints()


def _continue(x: Steps, item: i.Continue) -> None:
    if not (x.queue or x.entered):
        x.ignore("no step was left over")


def _tick(x: Steps, item: i.Tick) -> None:
    t_us = x.state.mission_time_us(x.now_us)
    fired = False
    while (due := next_timer(x)) is not None and due[0] <= t_us:
        fired = True
        trigger(x, due[1], {})
        x.run_steps()
        if x.queue or x.entered or x.state.status is not RunStatus.RUNNING:
            return
    if not fired:
        x.ignore("no timer is due")


def _give_up(x: Steps, item: i.GiveUp) -> None:
    awaited = x.state.awaited()
    waiting = f"; awaited: {', '.join(awaited)}" if awaited else ""
    end_run(x, RunOutcome.FAILED, item.reason + waiting)


def _geometry(x: Steps, item: i.GeometrySet) -> None:
    x.emit(r.GeometryReceived(item.name, item.geometry, item.by))


# --- operators, services, events ----------------------------------------------------------------


def _answer(x: Steps, item: i.PromptAnswer) -> None:
    refusal = _why_refused(x, item)
    if refusal:
        x.ignore(refusal)
        return
    prompt = x.state.prompts[item.prompt]
    token = prompt.token
    node = token.node
    x.emit(
        r.PromptAnswered(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            prompt.id,
            item.decision,
            item.by,
        )
    )
    if prompt.behavior:
        recovery_answered(x, x.state.behaviors[prompt.behavior], item)
        return
    answer = x.handlers[type(node)].answer
    assert answer is not None
    answer(x, token, item.decision)


def _why_refused(x: Steps, item: i.PromptAnswer) -> str:
    prompt = x.state.prompts.get(item.prompt)
    if prompt is None:
        return f"prompt {item.prompt} is not open: it was answered or withdrawn"
    values = [decision["value"] for decision in prompt.decisions]
    if item.decision not in values:
        return f"{item.decision!r} is no decision of prompt {item.prompt}: {', '.join(values)}"
    for earlier in x.state.deferred:
        if isinstance(earlier, i.PromptAnswer) and earlier.prompt == item.prompt:
            return f"prompt {item.prompt} was answered by {earlier.by or 'another'}"
    return ""


def _service_completed(x: Steps, item: i.ServiceCompleted) -> None:
    service = x.state.services.get(item.service)
    if service is None:
        x.ignore(f"service {item.service} is not running")
        return
    token = service.token
    node = token.node
    x.emit(r.ServiceEnded(token.id, x.process_of(node), node.id, token.scope.id, item.service))
    x.write_all(token, item.data)
    assert isinstance(node, Activity)
    complete(x, token)


def _service_failed(x: Steps, item: i.ServiceFailed) -> None:
    service = x.state.services.get(item.service)
    if service is None:
        x.ignore(f"service {item.service} is not running")
        return
    token = service.token
    node = token.node
    x.emit(
        r.ServiceEnded(
            token.id,
            x.process_of(node),
            node.id,
            token.scope.id,
            item.service,
            item.code,
            item.reason,
        )
    )
    throw_error(x, token, item.code, item.reason)


def _signal(x: Steps, item: i.SignalReceived) -> None:
    _remember_id(x, item.id)
    x.emit(r.SignalThrown(item.signal, by=item.by or "outside"))
    throw_signal(x, item.signal, item.data)


def _message(x: Steps, item: i.MessageReceived) -> None:
    if item.message not in received_messages(x.mission):
        x.ignore(f"nothing in the mission receives message {item.message}")
        return
    _remember_id(x, item.id)
    receive(x, item.message, item.data, item.by or "outside")


def _remember_id(x: Steps, number: str) -> None:
    if number:
        x.emit(r.InputSeen(number))


def _note(x: Steps, item: i.OperatorNoted) -> None:
    x.emit(r.OperatorNote(item.text, item.by))


_DECIDERS: dict[type, Callable[[Steps, Any], None]] = {
    i.ResourceReturned: resource_returned,
    i.BehaviorPreempted: behavior_preempted,
    i.ControlTaken: control_taken,
    i.ControlReturned: control_returned,
    i.ControlRequested: control_requested,
    i.ControlRequestEnded: control_request_ended,
    i.OperatorNoted: _note,
    i.StartRun: _start,
    i.ClaimRun: _claim,
    i.StopRun: _stop,
    i.PauseRun: _pause,
    i.ResumeRun: _resume,
    i.SetBreakpoints: _set_breakpoints,
    i.StepRun: _step,
    i.SetData: set_data,
    i.Tick: _tick,
    i.Continue: _continue,
    i.GiveUp: _give_up,
    i.BehaviorReported: behavior_reported,
    i.BehaviorMissing: behavior_missing,
    i.ResourcesChosen: resources_chosen,
    i.ResourcesNotFree: resources_not_free,
    i.PromptAnswer: _answer,
    i.ResolveIncident: resolve_incident,
    i.ServiceCompleted: _service_completed,
    i.ServiceFailed: _service_failed,
    i.SignalReceived: _signal,
    i.MessageReceived: _message,
    i.ResourceFault: resource_fault,
    i.GeometrySet: _geometry,
    i.RequirementDecided: requirement_decided,
    i.RequirementLeftOpen: requirement_left_open,
    i.TelemetryConditionChanged: condition_changed,
    i.Revise: revise,
}
