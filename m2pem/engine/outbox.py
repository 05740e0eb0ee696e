"""The outbox is a fold over the state: which commands records lead to, and which still stand."""

from collections.abc import Sequence

from m2pem.engine import records as r
from m2pem.engine.commands import (
    CancelBehavior,
    CancelService,
    ClosePrompt,
    Command,
    HoldResource,
    OpenPrompt,
    ResumeResource,
    RunService,
    StartBehavior,
)
from m2pem.engine.records import Record
from m2pem.engine.state import Behavior, BehaviorPhase, Prompt, RunState, RunStatus, Service
from m2pem.mission.behavior import Decision

_ASKING = frozenset(
    {
        r.BehaviorRequested,
        r.BehaviorRestarted,
        r.BehaviorCancelRequested,
        r.BehaviorUnsettled,
        r.BehaviorContinued,
        r.PromptOpened,
        r.PromptAnswered,
        r.PromptWithdrawn,
        r.ServiceRequested,
        r.ServiceWithdrawn,
        r.RunPaused,
        r.RunResumed,
    }
)
"""Records that may ask something of the outside: few of those that a run writes."""


def commands_of(state: RunState, records: Sequence[Record]) -> list[Command]:
    """What newly decided records ask of the outside, in their order.

    What was requested and is not wanted any more within the same records is never asked for.
    """
    commands: list[Command] = []
    unasked: set[str] = set()
    for record in records:
        if type(record) not in _ASKING:
            continue
        match record:
            case r.BehaviorRequested() | r.BehaviorRestarted():
                behavior = state.behaviors.get(record.behavior)
                if behavior is not None and behavior.phase is not BehaviorPhase.CANCELLING:
                    commands.append(_start(state, behavior))
            case r.BehaviorCancelRequested():
                behavior = state.behaviors.get(record.behavior)
                if behavior is not None:
                    commands.append(_cancel(state, behavior))
            case r.BehaviorUnsettled():
                behavior = state.behaviors.get(record.behavior)
                if behavior is not None:
                    commands.extend(_hold(behavior))
            case r.BehaviorContinued():
                behavior = state.behaviors.get(record.behavior)
                if behavior is not None and behavior.phase is BehaviorPhase.ACTIVE:
                    commands.extend(ResumeResource(name) for name in behavior.resources)
            case r.PromptOpened():
                prompt = state.prompts.get(record.prompt)
                if prompt is not None:
                    commands.append(_open(prompt))
                else:
                    unasked.add(record.prompt)
            case r.PromptAnswered():
                commands.append(ClosePrompt(record.prompt, record.decision, record.by))
            case r.PromptWithdrawn():
                if record.prompt not in unasked:
                    commands.append(ClosePrompt(record.prompt))
            case r.ServiceRequested():
                service = state.services.get(record.service)
                if service is not None:
                    commands.append(_run(service))
                else:
                    unasked.add(record.service)
            case r.ServiceWithdrawn():
                if record.service not in unasked:
                    commands.append(CancelService(record.service))
            case r.RunPaused():
                commands.extend(HoldResource(resource) for resource in _commanded(state))
            case r.RunResumed():
                commands.extend(ResumeResource(name) for name in _still_wanted(state, records))
            case _:
                pass
    return commands


def outstanding(state: RunState) -> list[Command]:
    """What the outside should be busy with now.

    For behaviors that nobody has cancelled, the executive asks their arbiter before it starts them
    (`StartBehavior` here means: it should be running).
    """
    commands: list[Command] = []
    for behavior in state.behaviors.values():
        if behavior.phase is BehaviorPhase.CANCELLING:
            commands.append(_cancel(state, behavior))
        elif behavior.phase is BehaviorPhase.UNSETTLED:
            commands.extend(_hold(behavior))
        else:
            commands.append(_start(state, behavior))
    commands.extend(_open(prompt) for prompt in state.prompts.values())
    commands.extend(_run(service) for service in state.services.values())
    if state.status is RunStatus.PAUSED:
        commands.extend(HoldResource(resource) for resource in _commanded(state))
    return commands


def _commanded(state: RunState) -> list[str]:
    """Resources of behaviors that are neither being cancelled nor held already."""
    return [
        resource
        for resource, holders in state.held.items()
        if any(state.behaviors[holder].phase is BehaviorPhase.ACTIVE for holder in holders)
    ]


def _still_wanted(state: RunState, records: Sequence[Record]) -> list[str]:
    """Resources that go on with what a pause held: not those that what came in the pause has given
    something else to do, which says so by a command of its own."""
    new = {
        record.behavior
        for record in records
        if isinstance(record, r.BehaviorRequested | r.BehaviorRestarted | r.BehaviorContinued)
    }
    return [name for name in _commanded(state) if new.isdisjoint(state.held[name])]


def _start(state: RunState, behavior: Behavior) -> StartBehavior:
    return StartBehavior(
        behavior.id,
        behavior.element,
        state.epoch,
        behavior.type,
        behavior.name,
        behavior.resources,
        behavior.roles,
        behavior.parameters,
        behavior.preempts,
    )


def _cancel(state: RunState, behavior: Behavior) -> CancelBehavior:
    return CancelBehavior(behavior.id, state.epoch, behavior.resources)


def _hold(behavior: Behavior) -> list[Command]:
    return [HoldResource(resource) for resource in behavior.resources]


def _open(prompt: Prompt) -> OpenPrompt:
    decisions = tuple(Decision(d["value"], d["label"]) for d in prompt.decisions)
    return OpenPrompt(prompt.id, prompt.token.node.id, prompt.text, decisions, prompt.role)


def _run(service: Service) -> RunService:
    return RunService(
        service.id,
        service.name,
        service.token.node.id,
        service.roles,
        service.properties,
    )
