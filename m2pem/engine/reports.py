"""What becomes of behaviors: their reports, faults of their resources, and what is found of them
after a restart (docs/architecture.md, section 6)."""

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.elements.completion import complete
from m2pem.engine.execution import Execution
from m2pem.engine.interruption import end_run
from m2pem.engine.records import RunOutcome
from m2pem.engine.state import Behavior, BehaviorPhase
from m2pem.engine.throwing import throw_error
from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from m2pem.mission.values import Value

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


def reported(x: Execution, item: i.BehaviorReported) -> None:
    """An arbiter's word: a terminal one completes the task, or throws its error."""
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        x.ignore(f"{item.state.value} for {item.behavior}, which is not active")
        return
    if not item.state.terminal:
        if item.number <= behavior.number:
            x.ignore(f"report {item.number} of {item.behavior} came before")
            return
        x.emit(r.BehaviorProgressed(item.behavior, item.number, item.state, item.native_ref))
        return
    _ended(x, behavior, item.state, item.code, item.reason, item.outputs)


def _ended(
    x: Execution,
    behavior: Behavior,
    state: BehaviorState,
    code: str = "",
    reason: str = "",
    outputs: dict[str, Value] | None = None,
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
    x.write_all(token, outputs or {})  # also of one that failed: the pictures it took are there
    if state is BehaviorState.SUCCEEDED:
        complete(x, token)
    else:
        throw_error(x, token, code, reason or f"{behavior.name} ended {state.value}")


def missing(x: Execution, item: i.BehaviorMissing) -> None:
    """After a restart it is not as it was: by its policy it starts again, fails, or is held."""
    behavior = x.state.behaviors.get(item.behavior)
    if behavior is None:
        x.ignore(f"{item.behavior} is not active")
        return
    if behavior.phase is BehaviorPhase.CANCELLING:
        _ended(x, behavior, BehaviorState.CANCELLED, "", item.reason)
        return
    if behavior.phase is BehaviorPhase.UNSETTLED:
        x.ignore(f"an operator is asked about {item.behavior} already")
        return
    if item.policy is ResumePolicy.RESTART:
        x.emit(r.BehaviorRestarted(behavior.id, x.state.epoch))
    elif item.policy is ResumePolicy.FAIL:
        _ended(x, behavior, BehaviorState.LOST, "FAILED", item.reason)
    else:
        _ask_what_to_do(x, behavior, item)


def _ask_what_to_do(x: Execution, behavior: Behavior, item: i.BehaviorMissing) -> None:
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


def settle(x: Execution, behavior: Behavior, answer: i.PromptAnswer) -> None:
    """An operator has said what to do with a behavior that was held after a restart."""
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


def fault(x: Execution, item: i.ResourceFault) -> None:
    """What a resource does for the run ends with the fault's error (`ResourceFault`)."""
    told = False
    for holder in list(x.state.held.get(item.resource, ())):
        behavior = x.state.behaviors[holder]
        if not item.reachable and len(behavior.resources) == 1:
            _ended(x, behavior, BehaviorState.LOST, item.code, item.reason)
        elif behavior.phase is not BehaviorPhase.CANCELLING:
            give_up(x, behavior, item.code, item.reason)
        else:
            continue  # it ends by its report, or when it has not answered its cancel in time
        told = True
    if not told:
        x.ignore(f"{item.code} of {item.resource}, which does nothing for this run")


def give_up(x: Execution, behavior: Behavior, code: str, reason: str) -> None:
    """Cancel it, for what can still be reached of its resources must stop."""
    token = x.state.tokens[behavior.token]
    if token.prompt:
        x.emit(r.PromptWithdrawn(token.prompt))
    x.emit(r.BehaviorCancelRequested(behavior.id, code, reason))
    throw_error(x, token, code, reason)
