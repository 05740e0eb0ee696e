"""What records about allocations, behaviors, prompts and services do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply.events import end_wait
from m2pem.engine.state import (
    AllocationRequest,
    Behavior,
    BehaviorPhase,
    Keeping,
    LostWork,
    OutOfReach,
    Prompt,
    RunState,
    Service,
)
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.losses import LINK_LOST, Loss


def allocation_requested(state: RunState, record: r.AllocationRequested) -> None:
    token = state.tokens[record.token]
    state.last_allocation += 1
    state.allocations[record.allocation] = AllocationRequest(
        record.allocation, token, record.parameters, record.deadline, record.at_us
    )
    token.allocation = record.allocation


def allocation_delayed(state: RunState, record: r.AllocationDelayed) -> None:
    request = state.allocations[record.allocation]
    request.reason = record.reason
    request.holders = record.holders
    if record.deadline:
        request.deadline = record.deadline


def allocation_ended(state: RunState, record: r.ResourcesAllocated | r.AllocationEnded) -> None:
    request = state.allocations.pop(record.allocation)
    request.token.allocation = ""
    wait = state.waits.get(request.deadline)
    if wait is not None:
        end_wait(state, wait)


def behavior_requested(state: RunState, record: r.BehaviorRequested) -> None:
    state.last_behavior += 1
    state.behaviors[record.behavior] = Behavior(
        record.behavior,
        record.token,
        record.element,
        record.process,
        record.scope,
        record.type,
        record.name,
        record.resources,
        record.roles,
        record.parameters,
        record.preempts,
    )
    for resource in record.resources:
        state.held.setdefault(resource, []).append(record.behavior)
        state.commanded[resource] = None
        state.lost.pop(resource, None)
    token = state.tokens[record.token]
    token.behavior = record.behavior
    token.replacements = None


def behavior_progressed(state: RunState, record: r.BehaviorProgressed) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.number = record.number
    behavior.state = record.state
    if record.native_ref is not None:
        behavior.native_ref = record.native_ref
    if record.remaining is not None:
        behavior.remaining = record.remaining


def behavior_adjusted(state: RunState, record: r.BehaviorAdjusted) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.parameters = {**behavior.parameters, **record.parameters}
    behavior.adjusted = tuple(dict.fromkeys((*behavior.adjusted, *record.parameters)))


def behavior_cancel_requested(state: RunState, record: r.BehaviorCancelRequested) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.CANCELLING
    _forget_behavior(state, behavior)


def behavior_unsettled(state: RunState, record: r.BehaviorUnsettled) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.UNSETTLED
    behavior.state = record.state


def behavior_continued(state: RunState, record: r.BehaviorContinued) -> None:
    state.behaviors[record.behavior].phase = BehaviorPhase.ACTIVE


def behavior_restarted(state: RunState, record: r.BehaviorRestarted) -> None:
    behavior = state.behaviors[record.behavior]
    behavior.phase = BehaviorPhase.ACTIVE
    behavior.state = None
    behavior.adjusted = ()
    behavior.number = 0
    behavior.native_ref = None


def behavior_ended(state: RunState, record: r.BehaviorEnded) -> None:
    behavior = state.behaviors.pop(record.behavior)
    for resource in behavior.resources:
        holders = state.held[resource]
        holders.remove(behavior.id)
        if not holders:
            del state.held[resource]
    is_out_of_reach = record.state is BehaviorState.LOST and record.code == LINK_LOST
    if is_out_of_reach and len(behavior.resources) == 1:
        state.lost[behavior.resources[0]] = OutOfReach(behavior.id, behavior.native_ref)
    _forget_behavior(state, behavior)


def work_reassigned(state: RunState, record: r.WorkReassigned) -> None:
    token, loss = state.tokens[record.token], Loss(record.code, record.reason)
    before = token.lost_work
    lost = {} if before is None else before.resources
    remaining = {} if before is None else before.remaining
    token.lost_work = LostWork(
        record.behavior,
        loss,
        {**remaining, **(record.remaining or {})},
        {**lost, **dict.fromkeys(record.excluded, loss)},
    )


def resource_returned(state: RunState, record: r.ResourceReturned) -> None:
    if record.code == LINK_LOST:
        state.lost.pop(record.resource, None)
    end_loss(state, record.resource, record.code)


def end_loss(state: RunState, resource: str, code: str) -> None:
    """Let tasks that lost a resource have it again, if that is why they lost it."""
    for token in state.tokens.values():
        lost = token.lost_work.resources if token.lost_work is not None else {}
        if resource in lost and lost[resource].code == code:
            del lost[resource]


def _forget_behavior(state: RunState, behavior: Behavior) -> None:
    token = state.tokens.get(behavior.token)
    if token is not None and token.behavior == behavior.id:
        token.behavior = ""


def resource_kept(state: RunState, record: r.ResourceKept) -> None:
    state.last_keeping += 1
    state.kept[record.resource] = Keeping(
        record.keeping,
        record.token,
        record.element,
        record.role,
        record.resource,
        state.scopes[record.until],
        record.priority,
    )


def keeping_ended(state: RunState, record: r.KeepingEnded) -> None:
    del state.kept[record.resource]


def prompt_opened(state: RunState, record: r.PromptOpened) -> None:
    token = state.tokens[record.token]
    state.last_prompt += 1
    state.prompts[record.prompt] = Prompt(
        record.prompt, token, record.text, record.decisions, record.role, record.behavior
    )
    token.prompt = record.prompt


def prompt_ended(state: RunState, record: r.PromptAnswered | r.PromptWithdrawn) -> None:
    state.prompts.pop(record.prompt).token.prompt = ""


def service_requested(state: RunState, record: r.ServiceRequested) -> None:
    token = state.tokens[record.token]
    state.last_service += 1
    state.services[record.service] = Service(
        record.service, token, record.name, record.roles, record.properties
    )
    token.service = record.service


def service_ended(state: RunState, record: r.ServiceEnded | r.ServiceWithdrawn) -> None:
    state.services.pop(record.service).token.service = ""
