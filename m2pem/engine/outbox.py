"""The outbox: the commands that records lead to, and those that are still to be carried out."""

from collections.abc import Iterable, Sequence

from m2pem.engine import records as r
from m2pem.engine.commands import (
    AdjustBehavior,
    AllocateResources,
    CancelBehavior,
    CancelService,
    ClosePrompt,
    Command,
    HoldResource,
    OpenPrompt,
    ResumeResource,
    RunService,
    StartBehavior,
    WithdrawAllocation,
)
from m2pem.engine.incidents import incident_holding
from m2pem.engine.records import Record
from m2pem.engine.state import Behavior, BehaviorPhase, Prompt, RunState, RunStatus, Service
from m2pem.mission.behavior import Decision

_WITH_COMMANDS = frozenset(
    {
        r.AllocationRequested,
        r.AllocationDelayed,
        r.AllocationEnded,
        r.BehaviorRequested,
        r.BehaviorRestarted,
        r.BehaviorAdjusted,
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
        r.IncidentOpened,
        r.IncidentResolved,
        r.IncidentClosed,
        r.OperatorGaveControlBack,
    }
)
"""Records that may lead to a command: few of those that a run writes."""


def commands_of(state: RunState, records: Sequence[Record]) -> list[Command]:
    """Return the commands that newly decided records lead to, in their order.

    What the same records request and withdraw again leads to no command.
    """
    commands: list[Command] = []
    never_opened: set[str] = set()
    for record in records:
        if type(record) not in _WITH_COMMANDS:
            continue
        match record:
            case r.AllocationRequested() | r.AllocationDelayed() | r.AllocationEnded():
                commands.extend(_allocation(state, record))
            case (
                r.BehaviorRequested()
                | r.BehaviorRestarted()
                | r.BehaviorAdjusted()
                | r.BehaviorCancelRequested()
                | r.BehaviorUnsettled()
                | r.BehaviorContinued()
            ):
                behavior = state.behaviors.get(record.behavior)
                if behavior is not None:
                    commands.extend(_behavior(state, behavior, record))
            case r.PromptOpened():
                prompt = state.prompts.get(record.prompt)
                if prompt is not None:
                    commands.append(_open(prompt))
                else:
                    never_opened.add(record.prompt)
            case r.PromptAnswered():
                commands.append(ClosePrompt(record.prompt, record.decision, record.by))
            case r.PromptWithdrawn():
                if record.prompt not in never_opened:
                    commands.append(ClosePrompt(record.prompt))
            case r.ServiceRequested():
                service = state.services.get(record.service)
                if service is not None:
                    commands.append(_run(service))
                else:
                    never_opened.add(record.service)
            case r.ServiceWithdrawn():
                if record.service not in never_opened:
                    commands.append(CancelService(record.service))
            case r.IncidentOpened() | r.IncidentResolved() | r.IncidentClosed():
                commands.extend(_incident(state, record))
            case r.OperatorGaveControlBack() if incident_holding(state, record.resource):
                commands.extend(_held_for(state, [record.resource]))
            case r.RunPaused():
                commands.extend(HoldResource(resource) for resource in _commanded(state))
            case r.RunResumed():
                commands.extend(
                    ResumeResource(name) for name in _resources_to_resume(state, records)
                )
                commands.extend(_adjusted(state))
            case _:
                pass
    return commands


def _behavior(state: RunState, behavior: Behavior, record: Record) -> list[Command]:
    match record:
        case r.BehaviorRequested() | r.BehaviorRestarted():
            if behavior.phase is not BehaviorPhase.CANCELLING:
                return [_start(state, behavior)]
        case r.BehaviorAdjusted() if state.status is not RunStatus.PAUSED:
            return [_adjust(state, behavior)]
        case r.BehaviorCancelRequested():
            return [_cancel(state, behavior)]
        case r.BehaviorUnsettled():
            return _hold(behavior)
        case r.BehaviorContinued() if behavior.phase is BehaviorPhase.ACTIVE:
            resumes = [ResumeResource(name) for name in behavior.resources]
            return [*resumes, _adjust(state, behavior)] if behavior.adjusted else [*resumes]
    return []


def _allocation(
    state: RunState, record: r.AllocationRequested | r.AllocationDelayed | r.AllocationEnded
) -> list[Command]:
    match record:
        case r.AllocationEnded():
            return [WithdrawAllocation(record.allocation)]
        case r.AllocationDelayed(again=False):
            return []
    if record.allocation not in state.allocations:
        return []
    return [AllocateResources(record.allocation, isinstance(record, r.AllocationDelayed))]


def outstanding(state: RunState) -> list[Command]:
    """Return the commands of all that should be active now, for an executive that claims the run.

    `StartBehavior` here means that the behavior should be running: the executive asks the arbiter
    before it starts it.
    """
    commands: list[Command] = []
    for behavior in state.behaviors.values():
        if behavior.phase is BehaviorPhase.CANCELLING:
            commands.append(_cancel(state, behavior))
        elif behavior.phase is BehaviorPhase.UNSETTLED:
            commands.extend(_hold(behavior))
        else:
            commands.append(_start(state, behavior))
    commands.extend(AllocateResources(allocation) for allocation in state.allocations)
    commands.extend(_open(prompt) for prompt in state.prompts.values())
    commands.extend(_run(service) for service in state.services.values())
    for incident in state.incidents.values():
        commands.extend(_held_for(state, incident.resources))
    if state.status is RunStatus.PAUSED:
        commands.extend(HoldResource(resource) for resource in _commanded(state))
    else:
        commands.extend(_adjusted(state))
    return commands


def _incident(
    state: RunState, record: r.IncidentOpened | r.IncidentResolved | r.IncidentClosed
) -> list[Command]:
    if not isinstance(record, r.IncidentOpened):
        return _let_go(state, record.resources)
    return _held_for(state, record.resources) if record.incident in state.incidents else []


def _held_for(state: RunState, resources: Iterable[str]) -> list[Command]:
    """Return the holds of what an incident keeps, but for what an operator steers."""
    return [HoldResource(resource) for resource in resources if resource not in state.taken]


def _let_go(state: RunState, resources: Iterable[str]) -> list[Command]:
    """Return the commands for what an incident has kept and nothing has now: what got a behavior
    has a command of its own, and what is being cancelled stops."""
    return [
        ResumeResource(resource)
        for resource in resources
        if resource not in state.held
        and resource not in state.taken
        and not incident_holding(state, resource)
    ]


def _commanded(state: RunState) -> list[str]:
    """Return the resources of behaviors that are neither being cancelled nor held already."""
    return [
        resource
        for resource, holders in state.held.items()
        if any(state.behaviors[holder].phase is BehaviorPhase.ACTIVE for holder in holders)
    ]


def _resources_to_resume(state: RunState, records: Sequence[Record]) -> list[str]:
    """Return the resources that resume what a pause held, without those that got a new behavior
    meanwhile: that has a command of its own."""
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
        tuple(state.kept[each].id for each in behavior.resources if each in state.kept),
    )


def _adjust(state: RunState, behavior: Behavior) -> AdjustBehavior:
    return AdjustBehavior(state.epoch, _start(state, behavior), behavior.adjusted)


def _adjusted(state: RunState) -> list[Command]:
    """Return what was adjusted since it was started, which a pause or a crash may have kept from
    the arbiters; they may get it twice."""
    return [
        _adjust(state, behavior)
        for behavior in state.behaviors.values()
        if behavior.adjusted and behavior.phase is BehaviorPhase.ACTIVE
    ]


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
