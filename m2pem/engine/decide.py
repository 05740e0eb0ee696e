"""What each input means: the handlers that turn inputs into records.

Deciding may change between releases; what was decided is in the journal, and `apply` alone
replays it. A handler that finds an input redundant calls `ignore` and does nothing else.
"""

from collections.abc import Callable
from typing import Any

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.data import flatten
from m2pem.engine.interruption import end_run, throw_error
from m2pem.engine.lifecycle import Welcome, welcome
from m2pem.engine.messaging import receive
from m2pem.engine.nodes.activities import answered, complete
from m2pem.engine.nodes.containers import begin
from m2pem.engine.records import RunOutcome
from m2pem.engine.state import Behavior, BehaviorPhase
from m2pem.engine.steps import Steps
from m2pem.engine.waiting import next_timer, throw_signal, trigger
from m2pem.model.catalogue import BehaviorState, ResumePolicy
from m2pem.model.elements import Activity

DEFAULT_CODES: dict[BehaviorState, str] = {
    BehaviorState.FAILED: "FAILED",
    BehaviorState.REJECTED: "REJECTED",
    BehaviorState.CANCELLED: "FAILED",
    BehaviorState.LOST: "LINK_LOST",
    BehaviorState.UNKNOWN: "FAILED",
}
"""Error code of a task whose behavior ended so, where its arbiter gave none."""

RECOVERY_DECISIONS: tuple[dict[str, str], ...] = (
    {"value": "resume", "label": "Resume"},
    {"value": "skip", "label": "Skip the task"},
    {"value": "abort", "label": "Abort the mission"},
)
"""What an operator may say of a behavior that is not as it was after a restart."""


def decide(x: Steps, item: i.Input) -> None:
    """Emit what an input means; steps that it causes are left in the queue."""
    match welcome(x.state.status, item):
        case Welcome.IGNORE:
            ignore(x, f"{type(item).__name__} while the run is {x.state.status.value}")
        case Welcome.DEFER:
            _defer(x, item)
        case Welcome.DECIDE:
            number = getattr(item, "id", "")
            if number in x.state.seen:
                ignore(x, f"{type(item).__name__} {number} was taken before")
                return
            _DECIDERS[type(item)](x, item)


def ignore(x: Steps, reason: str) -> None:
    """Say why an input changes nothing."""
    x.emit(r.InputIgnored(reason))


def _defer(x: Steps, item: i.Input) -> None:
    refusal = _why_no_answer(x, item) if isinstance(item, i.PromptAnswer) else ""
    if refusal:
        ignore(x, refusal)
    else:
        x.emit(r.InputDeferred(item))


# --- the run ------------------------------------------------------------------------------------


def _start(x: Steps, item: i.StartRun) -> None:
    try:
        process = x.mission.process(item.process)
    except KeyError:
        ignore(x, f"the mission has no process {item.process!r}")
        return
    x.emit(r.RunStarted(process.id, x.now_us, item.by))
    x.emit(r.ScopeOpened(1, process.id, process.id))
    root = x.state.scopes[1]
    for name, value in item.data.items():
        for key, entry in flatten(name, value):
            x.emit(r.DataWritten(0, process.id, process.id, root.id, key, entry, root.id))
    begin(x, root)


def _claim(x: Steps, item: i.ClaimRun) -> None:
    x.emit(r.RunClaimed(item.epoch, item.by))


def _stop(x: Steps, item: i.StopRun) -> None:
    end_run(x, RunOutcome.STOPPED, item.reason or (f"stopped by {item.by}" if item.by else ""))


def _pause(x: Steps, item: i.PauseRun) -> None:
    x.emit(r.RunPaused(x.now_us, item.by))


def _resume(x: Steps, item: i.ResumeRun) -> None:
    deferred = list(x.state.deferred)
    x.emit(r.RunResumed(x.now_us, item.by))
    x.reload_queue()
    for late in deferred:
        x.run_steps()
        decide(x, late)


def _continue(x: Steps, item: i.Continue) -> None:
    if not x.queue:
        ignore(x, "no step was left over")


def _tick(x: Steps, item: i.Tick) -> None:
    t_us = x.state.mission_time_us(x.now_us)
    fired = False
    while (due := next_timer(x)) is not None and due[0] <= t_us:
        fired = True
        trigger(x, due[1], {})
        x.run_steps()
        if x.queue:
            return
    if not fired:
        ignore(x, "no timer is due")


def _give_up(x: Steps, item: i.GiveUp) -> None:
    state = x.state
    awaited = [
        f"{behavior.element} (behavior {behavior.name})"
        for behavior in state.behaviors.values()
        if behavior.phase is not BehaviorPhase.CANCELLING
    ]
    awaited += [f"{prompt.token.node.id} (an answer)" for prompt in state.prompts.values()]
    awaited += [f"{service.token.node.id} ({service.name})" for service in state.services.values()]
    awaited += [f"{wait.node.id} ({wait.trigger.value})" for wait in state.waits.values()]
    waiting = f"; awaited: {', '.join(dict.fromkeys(awaited))}" if awaited else ""
    end_run(x, RunOutcome.FAILED, item.reason + waiting)


def _geometry(x: Steps, item: i.GeometrySet) -> None:
    x.emit(r.GeometryReceived(item.name, item.geometry, item.by))


# --- behaviors ----------------------------------------------------------------------------------


def _reported(x: Steps, item: i.BehaviorReported) -> None:
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        ignore(x, f"{item.state.value} for {item.behavior}, which is not active")
        return
    if not item.state.terminal:
        if item.number <= behavior.number:
            ignore(x, f"report {item.number} of {item.behavior} came before")
            return
        x.emit(r.BehaviorProgressed(item.behavior, item.number, item.state, item.native_ref))
        return
    _ended(x, behavior, item.state, item.code, item.reason)


def _ended(
    x: Steps, behavior: Behavior, state: BehaviorState, code: str = "", reason: str = ""
) -> None:
    if state is BehaviorState.SUCCEEDED:
        code = ""
    elif state is not BehaviorState.CANCELLED or behavior.phase is not BehaviorPhase.CANCELLING:
        code = code or DEFAULT_CODES[state]
    token = x.state.tokens.get(behavior.token)
    if token is not None and token.behavior != behavior.id:
        token = None
    if token is not None and token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    x.emit(
        r.BehaviorEnded(
            behavior.token,
            behavior.process,
            behavior.element,
            behavior.scope,
            behavior.id,
            state,
            code,
            reason,
        )
    )
    if token is None:
        return
    if state is BehaviorState.SUCCEEDED:
        complete(x, token)
    else:
        throw_error(x, token, code, reason or f"{behavior.name} ended {state.value}")


def _missing(x: Steps, item: i.BehaviorMissing) -> None:
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        ignore(x, f"{item.behavior} is not active")
        return
    if behavior.phase is BehaviorPhase.CANCELLING:
        _ended(x, behavior, BehaviorState.CANCELLED, "", item.reason)
        return
    if behavior.phase is BehaviorPhase.UNSETTLED:
        ignore(x, f"an operator is asked about {item.behavior} already")
        return
    if item.policy is ResumePolicy.RESTART:
        x.emit(r.BehaviorRestarted(behavior.id, x.state.epoch))
    elif item.policy is ResumePolicy.FAIL:
        _ended(x, behavior, BehaviorState.LOST, "FAILED", item.reason)
    else:
        _ask_what_to_do(x, behavior, item)


def _ask_what_to_do(x: Steps, behavior: Behavior, item: i.BehaviorMissing) -> None:
    token = x.state.tokens[behavior.token]
    label = token.node.label
    x.emit(r.BehaviorUnsettled(behavior.id, item.state, item.reason))
    x.emit(
        r.PromptOpened(
            token.id,
            behavior.process,
            behavior.element,
            behavior.scope,
            f"p{x.state.last_prompt + 1}",
            f"{label}: {behavior.name} of {', '.join(behavior.resources)} is not as it was"
            f" ({item.reason or item.state.value}). Resume it, skip the task, or abort?",
            RECOVERY_DECISIONS,
            "",
            behavior.id,
        )
    )


def _settle(x: Steps, behavior: Behavior, answer: i.PromptAnswer) -> None:
    if answer.decision == "resume":
        if behavior.state in (BehaviorState.RUNNING, BehaviorState.ACCEPTED):
            x.emit(r.BehaviorContinued(behavior.id, answer.by))
        else:
            x.emit(r.BehaviorRestarted(behavior.id, x.state.epoch, answer.by))
    elif answer.decision == "skip":
        token = x.state.tokens[behavior.token]
        x.emit(r.BehaviorCancelRequested(behavior.id, "", f"skipped by {answer.by}"))
        complete(x, token)
    else:
        end_run(x, RunOutcome.STOPPED, f"aborted by {answer.by}")


def _fault(x: Steps, item: i.ResourceFault) -> None:
    told = False
    for holder in list(x.state.held.get(item.resource, ())):
        behavior = x.state.behaviors[holder]
        if not item.reachable and len(behavior.resources) == 1:
            _ended(x, behavior, BehaviorState.LOST, item.code, item.reason)
        elif behavior.phase is not BehaviorPhase.CANCELLING:
            _give_behavior_up(x, behavior, item)
        else:
            continue  # it ends by its report, or when it has not answered its cancel in time
        told = True
    if not told:
        ignore(x, f"{item.code} of {item.resource}, which does nothing for this run")


def _give_behavior_up(x: Steps, behavior: Behavior, item: i.ResourceFault) -> None:
    """Cancel it, for what can still be reached of its resources must stop."""
    token = x.state.tokens[behavior.token]
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    x.emit(r.BehaviorCancelRequested(behavior.id, item.code, item.reason))
    throw_error(x, token, item.code, item.reason)


# --- operators, services, the outside -----------------------------------------------------------


def _answer(x: Steps, item: i.PromptAnswer) -> None:
    refusal = _why_no_answer(x, item)
    if refusal:
        ignore(x, refusal)
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
        _settle(x, x.state.behaviors[prompt.behavior], item)
    else:
        answered(x, token, item.decision)


def _why_no_answer(x: Steps, item: i.PromptAnswer) -> str:
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
        ignore(x, f"service {item.service} is not running")
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
        ignore(x, f"service {item.service} is not running")
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
    _note_id(x, item.id)
    x.emit(r.SignalThrown(item.signal, by=item.by or "outside"))
    throw_signal(x, item.signal, item.data)


def _message(x: Steps, item: i.MessageReceived) -> None:
    if item.message not in x.receivable:
        ignore(x, f"nothing in the mission receives message {item.message}")
        return
    _note_id(x, item.id)
    receive(x, item.message, item.data, item.by or "outside")


def _note_id(x: Steps, number: str) -> None:
    if number:
        x.emit(r.InputSeen(number))


_DECIDERS: dict[type, Callable[[Steps, Any], None]] = {
    i.StartRun: _start,
    i.ClaimRun: _claim,
    i.StopRun: _stop,
    i.PauseRun: _pause,
    i.ResumeRun: _resume,
    i.Tick: _tick,
    i.Continue: _continue,
    i.GiveUp: _give_up,
    i.BehaviorReported: _reported,
    i.BehaviorMissing: _missing,
    i.PromptAnswer: _answer,
    i.ServiceCompleted: _service_completed,
    i.ServiceFailed: _service_failed,
    i.SignalReceived: _signal,
    i.MessageReceived: _message,
    i.ResourceFault: _fault,
    i.GeometrySet: _geometry,
}
