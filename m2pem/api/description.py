"""Records as sentences for people, with the names of the diagram.

`describe` is the one place that words records: the log of a terminal, the lines of `m2pem run`,
the event list of the page and the events over ROS all show its sentences. A unit chooses which
records it shows, and how `kind` and `importance` look.
"""

from collections.abc import Callable
from enum import StrEnum
from typing import Any, NamedTuple

from m2pem.api import records as r
from m2pem.api.choices import choice_sentence
from m2pem.api.run_view import RunView
from m2pem.api.runs import StampedRecord
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.losses import BATTERY_LOW

VALUE_CHARACTERS = 200
"""A sentence has so many characters of a value at most; the record has all of it."""


class Kind(StrEnum):
    """The subject of a record; units filter and colour by it."""

    RUN = "run"
    TOKENS = "tokens"
    BEHAVIORS = "behaviors"
    PROMPTS = "prompts"
    EVENTS = "events"
    DATA = "data"
    OPERATORS = "operators"


class Importance(StrEnum):
    """How much an operator needs to see a record.

    ATTENTION: it is expected, and needs a look, as a prompt does. WARNING: something may be wrong.
    ERROR: something has failed.
    """

    DETAIL = "detail"
    NORMAL = "normal"
    GOOD = "good"
    ATTENTION = "attention"
    WARNING = "warning"
    ERROR = "error"

    @property
    def is_urgent(self) -> bool:
        """Whether it is at least ATTENTION."""
        return self in (Importance.ATTENTION, Importance.WARNING, Importance.ERROR)


class Description(NamedTuple):
    """A sentence about a record, on one line."""

    text: str
    kind: Kind
    importance: Importance


def describe(stamped: StampedRecord, view: RunView) -> Description:
    """Describe a record of a run. `view` gives names, and may be of any time after the record.

    Behaviors and prompts that ended long before have their ids in place of their names.
    """
    record = stamped.record
    text, importance = _SENTENCE_OF.get(type(record), _unknown)(view, record)
    return Description(printable(text), kind_of(record), importance)


def kind_of(record: r.Record) -> Kind:
    """Return what a record is about."""
    return _KIND_OF.get(type(record), Kind.TOKENS)


def printable(text: str) -> str:
    """Return a text on one line, with "?" for control characters.

    Names come from files and networks; they must not control a terminal.
    """
    line = " ".join(text.split())
    return line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)


def _by(record: Any) -> str:
    return f" by {record.by}" if record.by else ""


def _in_brackets(text: str) -> str:
    return f" ({text})" if text else ""


def _after_colon(text: str) -> str:
    return f": {text}" if text else ""


def _caught(view: RunView, record: r.EscalationThrown | r.ErrorThrown) -> str:
    return f"caught by {view.label(record.caught_by)}" if record.caught_by else "not caught"


def _behavior(view: RunView, id_: str) -> str:
    behavior = view.behavior(id_)
    return f"{', '.join(behavior.resources)}: {behavior.name}" if behavior is not None else id_


_Sentence = tuple[str, Importance]


def _unknown(view: RunView, record: Any) -> _Sentence:
    element = getattr(record, "element", "")
    name = type(record).__name__
    return f"{name}: {view.label(element)}" if element else name, Importance.DETAIL


# --- requirements ---------------------------------------------------------------------------------


def _requirement_monitored(_: RunView, record: r.RequirementMonitored) -> _Sentence:
    text = f"requirement {record.requirement} is monitored: {record.english}"
    return text, Importance.DETAIL


def _requirement_dropped(_: RunView, record: r.RequirementDropped) -> _Sentence:
    return f"requirement {record.requirement} is no longer monitored", Importance.NORMAL


def _requirement_decided(_: RunView, record: r.RequirementDecided) -> _Sentence:
    violated = record.verdict is r.RequirementVerdict.VIOLATED
    said = record.english.rstrip(".")
    text = f"requirement {record.requirement} is {record.verdict}: {said}"
    importance = Importance.ERROR if violated else Importance.NORMAL
    return f"{text}{_in_brackets(record.because)}", importance


def _requirement_left_open(_: RunView, record: r.RequirementLeftOpen) -> _Sentence:
    text = f"requirement {record.requirement} stays open: {record.english.rstrip('.')}"
    return f"{text}{_in_brackets(record.because)}", Importance.WARNING


def _condition_changed(_: RunView, record: r.TelemetryConditionChanged) -> _Sentence:
    says = {True: "holds", False: "does not hold", None: "is not known"}[record.holds]
    return f"{record.condition} {says}", Importance.DETAIL


# --- the run --------------------------------------------------------------------------------------


def _run_started(view: RunView, record: r.RunStarted) -> _Sentence:
    return f"{view.run} of {view.label(record.process)} started{_by(record)}", Importance.GOOD


def _run_claimed(view: RunView, record: r.RunClaimed) -> _Sentence:
    text = f"{view.run} taken up again{_by(record)}"
    if not record.expression_rules:
        return text, Importance.GOOD
    rules = "conditions and values are decided from here on by the rules of this version of m2pem"
    return f"{text}; {rules}, which are others than those of its records", Importance.WARNING


def _run_paused(view: RunView, record: r.RunPaused) -> _Sentence:
    return f"{view.run} paused{_by(record)}", Importance.WARNING


def _run_resumed(view: RunView, record: r.RunResumed) -> _Sentence:
    return f"{view.run} resumed{_by(record)}", Importance.NORMAL


def _breakpoints_set(view: RunView, record: r.BreakpointsSet) -> _Sentence:
    if record.step:
        return f"{view.run} makes one step{_by(record)}", Importance.DETAIL
    where = [view.label(each) for each in record.elements]
    where += [f"when {each}" for each in record.conditions]
    text = f"breakpoints: {', '.join(where)}" if where else "no breakpoints any more"
    return f"{text}{_by(record)}", Importance.NORMAL


_REACHED = {
    r.StopReason.BREAKPOINT: "breakpoint at {place}",
    r.StopReason.CONDITION: "{condition} has become true; next is {place}",
    r.StopReason.STEP: "next is {place}",
}


def _breakpoint_reached(view: RunView, record: r.BreakpointReached) -> _Sentence:
    place = view.label(record.element) if record.element else "what comes from outside"
    text = _REACHED[record.reason].format(place=place, condition=record.condition)
    return text, Importance.WARNING


def _operator_set_data(view: RunView, record: r.OperatorSetData) -> _Sentence:
    return f"data of {view.label(record.element)} changed{_by(record)}", Importance.WARNING


def _run_ended(view: RunView, record: r.RunEnded) -> _Sentence:
    good = record.outcome in (r.RunOutcome.COMPLETED, r.RunOutcome.TERMINATED)
    text = f"{view.run} {record.outcome.value}{_after_colon(record.detail)}"
    return text, Importance.GOOD if good else Importance.ERROR


def _input_ignored(_: RunView, record: r.InputIgnored) -> _Sentence:
    return f"ignored: {record.reason}", Importance.DETAIL


def _input_deferred(_: RunView, __: r.InputDeferred) -> _Sentence:
    return "an input came during the pause, and waits for its end", Importance.DETAIL


def _input_seen(_: RunView, record: r.InputSeen) -> _Sentence:
    return f"input {record.id} accepted", Importance.DETAIL


def _operator_took(_: RunView, record: r.OperatorTookControl) -> _Sentence:
    return f"{record.resource} taken{_by(record)}", Importance.WARNING


def _operator_gave_back(_: RunView, record: r.OperatorGaveControlBack) -> _Sentence:
    text = f"{record.resource} given back{_by(record)}"
    if not record.holder:
        return text, Importance.NORMAL
    return f"{text}, from {record.holder}{_after_colon(record.reason)}", Importance.WARNING


def _control_requested(_: RunView, record: r.ControlRequested) -> _Sentence:
    return f"{record.by} asks {record.holder} for {record.resource}", Importance.WARNING


_ENDED_REQUESTS = {
    r.RequestOutcome.GIVEN: "gives it",
    r.RequestOutcome.REFUSED: "refuses",
    r.RequestOutcome.WITHDRAWN: "asks no longer",
    r.RequestOutcome.RETURNED: "has given it back to the missions",
}


def _control_request_ended(_: RunView, record: r.ControlRequestEnded) -> _Sentence:
    asked = f"{record.requested_by} asked for {record.resource}"
    if record.outcome is r.RequestOutcome.EXPIRED:
        return f"{asked}: without an answer, it stays", Importance.WARNING
    if not record.by:
        return f"{asked}: without an answer, it goes to {record.requested_by}", Importance.WARNING
    return f"{asked}: {record.by} {_ENDED_REQUESTS[record.outcome]}", Importance.NORMAL


def _operator_note(_: RunView, record: r.OperatorNote) -> _Sentence:
    return f"{record.by or 'an operator'}: {record.text}", Importance.NORMAL


def _geometry_received(_: RunView, record: r.GeometryReceived) -> _Sentence:
    return f"{record.name} received{_by(record)}", Importance.NORMAL


def _mission_revised(view: RunView, record: r.MissionRevised) -> _Sentence:
    moved = "".join(
        f"; {view.label(element)}: its token {f'goes to {view.label(to)}' if to else 'ends'}"
        for element, to in record.moves.items()
    )
    text = (
        f"{view.run} goes on with version {record.version[:12]} of its mission{_by(record)}{moved}"
    )
    return text, Importance.WARNING


# --- tokens and scopes ----------------------------------------------------------------------------


def _token_entered(view: RunView, record: r.TokenEntered) -> _Sentence:
    instance = f", instance {record.instance}" if record.instance is not None else ""
    return f"{view.label(record.element)}{instance}", Importance.NORMAL


def _token_left(view: RunView, record: r.TokenLeft) -> _Sentence:
    failed = record.outcome is r.TokenOutcome.FAILED
    text = f"{view.label(record.element)}: {record.outcome.value}"
    return text, Importance.ATTENTION if failed else Importance.NORMAL


def _flow_taken(view: RunView, record: r.FlowTaken) -> _Sentence:
    text = f"{view.label(record.element)}: flow {record.flow}{_in_brackets(record.reason)}"
    return text, Importance.NORMAL if record.reason else Importance.DETAIL


def _scope_opened(view: RunView, record: r.ScopeOpened) -> _Sentence:
    return f"{view.label(record.element)}: scope opened", Importance.DETAIL


def _scope_closed(view: RunView, record: r.ScopeClosed) -> _Sentence:
    return f"{view.label(record.element)}: scope {record.outcome.value}", Importance.DETAIL


# --- allocations, behaviors, prompts, services ----------------------------------------------------


def _allocation_requested(view: RunView, record: r.AllocationRequested) -> _Sentence:
    text = f"{view.label(record.element)}: asks for resources for {record.name}"
    return text, Importance.DETAIL


def _allocation_delayed(view: RunView, record: r.AllocationDelayed) -> _Sentence:
    label = _asking(view, record.allocation)
    if record.again:
        return f"{label}: asks again, as {record.reason}", Importance.DETAIL
    return f"{label}: {waiting(record.reason)}", Importance.NORMAL


def waiting(reason: str) -> str:
    """Say that a task waits for resources; `reason` "": why is not known yet."""
    return f"waits for {reason}" if reason.startswith("role ") else f"waits{_after_colon(reason)}"


def _resources_allocated(view: RunView, record: r.ResourcesAllocated) -> _Sentence:
    text = f"{view.label(record.element)}: {choice_sentence(record, view.holder)}"
    return text, Importance.NORMAL


def _allocation_ended(view: RunView, record: r.AllocationEnded) -> _Sentence:
    label = _asking(view, record.allocation)
    if not record.code:
        return f"{label}: no longer asks for resources", Importance.DETAIL
    text = f"{label}: gets no resources, {record.code}{_in_brackets(record.reason)}"
    return text, Importance.ATTENTION


def _asking(view: RunView, id_: str) -> str:
    allocation = view.allocation(id_)
    return view.label(allocation.element) if allocation is not None else id_


def _behavior_requested(view: RunView, record: r.BehaviorRequested) -> _Sentence:
    resources = ", ".join(record.resources)
    return f"{view.label(record.element)}: {resources} begins {record.name}", Importance.NORMAL


def _behavior_progressed(view: RunView, record: r.BehaviorProgressed) -> _Sentence:
    text = f"{_behavior(view, record.behavior)}: {record.state.value.lower()}"
    return text, Importance.DETAIL


def _behavior_adjusted(view: RunView, record: r.BehaviorAdjusted) -> _Sentence:
    changed = ", ".join(f"{name} {value}" for name, value in record.parameters.items())
    return f"{_behavior(view, record.behavior)}: goes on with {changed}", Importance.NORMAL


def _behavior_cancel_requested(view: RunView, record: r.BehaviorCancelRequested) -> _Sentence:
    why = f", {record.code}" if record.code else ""
    text = f"{_behavior(view, record.behavior)}: being cancelled{why}{_in_brackets(record.reason)}"
    return text, Importance.DETAIL


def _behavior_unsettled(view: RunView, record: r.BehaviorUnsettled) -> _Sentence:
    return f"{_behavior(view, record.behavior)}: held, {record.reason}", Importance.WARNING


def _behavior_continued(view: RunView, record: r.BehaviorContinued) -> _Sentence:
    return f"{_behavior(view, record.behavior)}: goes on{_by(record)}", Importance.NORMAL


def _behavior_restarted(view: RunView, record: r.BehaviorRestarted) -> _Sentence:
    return f"{_behavior(view, record.behavior)}: started again{_by(record)}", Importance.NORMAL


def _behavior_ended(view: RunView, record: r.BehaviorEnded) -> _Sentence:
    how = record.state.value.lower()
    if record.state is not BehaviorState.CANCELLED and record.code:
        how = f"{how}, {record.code}{_in_brackets(record.reason)}"
    elif record.state is BehaviorState.SUCCEEDED:
        how = f"{how}{_in_brackets(record.reason)}"
    behavior = view.behavior(record.behavior)
    name = behavior.name if behavior is not None else record.behavior
    resources = f"{', '.join(behavior.resources)} ends " if behavior is not None else ""
    text = f"{view.label(record.element)}: {resources}{name}: {how}"
    if record.state is BehaviorState.SUCCEEDED:
        return text, Importance.GOOD
    cancelled = record.state is BehaviorState.CANCELLED
    return text, Importance.DETAIL if cancelled else Importance.WARNING


def _work_reassigned(view: RunView, record: r.WorkReassigned) -> _Sentence:
    behavior = view.behavior(record.behavior)
    lost = ", ".join(behavior.resources if behavior is not None else record.excluded)
    why = f"{record.code}{_in_brackets(record.reason)}"
    who = "who does" if record.asks else "another is to do"
    text = f"{view.label(record.element)}: {who} what {lost} left, {why}"
    if record.asks:
        text += ": an operator is asked"
    return text, Importance.WARNING


def _resource_returned(_: RunView, record: r.ResourceReturned) -> _Sentence:
    charged = record.code == BATTERY_LOW
    how = "its battery is charged again" if charged else "it has returned, and is held"
    return f"{record.resource}: {how}{_in_brackets(record.reason)}", Importance.WARNING


def _resource_kept(view: RunView, record: r.ResourceKept) -> _Sentence:
    scope = view.scopes.get(record.until)
    until = f" until {view.label(scope.element)} ends" if scope is not None else ""
    text = f"{view.label(record.element)}: {record.resource} is kept{until}"
    return text, Importance.NORMAL


def _keeping_ended(_: RunView, record: r.KeepingEnded) -> _Sentence:
    text = f"{record.resource} is kept no longer{_in_brackets(record.reason)}"
    return text, Importance.NORMAL


def _prompt_opened(view: RunView, record: r.PromptOpened) -> _Sentence:
    return f"{view.label(record.element)} asks: {record.text}", Importance.ATTENTION


def _prompt_answered(view: RunView, record: r.PromptAnswered) -> _Sentence:
    text = f"{view.label(record.element)}: {record.decision}, answered{_by(record)}"
    return text, Importance.NORMAL


def _prompt_withdrawn(view: RunView, record: r.PromptWithdrawn) -> _Sentence:
    prompt = view.prompt(record.prompt)
    element = view.label(prompt.element) if prompt is not None else record.prompt
    return f"{element}: no longer asked", Importance.DETAIL


def _service_requested(view: RunView, record: r.ServiceRequested) -> _Sentence:
    return f"{view.label(record.element)}: runs {record.name}", Importance.NORMAL


def _service_ended(view: RunView, record: r.ServiceEnded) -> _Sentence:
    label = view.label(record.element)
    if not record.code:
        return f"{label}: done", Importance.NORMAL
    return f"{label}: failed, {record.code}{_in_brackets(record.reason)}", Importance.ERROR


def _service_withdrawn(view: RunView, record: r.ServiceWithdrawn) -> _Sentence:
    return f"service {record.service} withdrawn", Importance.NORMAL


# --- data and events ------------------------------------------------------------------------------


def _data_written(_: RunView, record: r.DataWritten) -> _Sentence:
    return f"{record.key} = {str(record.value)[:VALUE_CHARACTERS]}", Importance.DETAIL


def _event_awaited(view: RunView, record: r.EventAwaited) -> _Sentence:
    event = _event(view, record.trigger, record.ref)
    return f"{view.label(record.element)}: waits for {event}", Importance.NORMAL


def _event_triggered(view: RunView, record: r.EventTriggered) -> _Sentence:
    wait = view.wait(record.wait)
    if wait is None:
        return f"awaited event {record.wait} occurred", Importance.DETAIL
    event = _event(view, wait.trigger, wait.ref)
    return f"{view.label(wait.element)}: {event} occurred", Importance.NORMAL


def _event(view: RunView, trigger: r.Trigger, ref: str) -> str:
    return f"{trigger.value} '{view.reference(ref)}'" if ref else trigger.value


def _signal_thrown(view: RunView, record: r.SignalThrown) -> _Sentence:
    origin = view.label(record.element) if record.element else record.by or "outside"
    return f"{origin}: signal '{view.reference(record.signal)}'", Importance.NORMAL


def _message_thrown(view: RunView, record: r.MessageThrown) -> _Sentence:
    origin = view.label(record.element) if record.element else record.by or "outside"
    return f"{origin}: message '{view.reference(record.message)}'", Importance.NORMAL


def _escalation_thrown(view: RunView, record: r.EscalationThrown) -> _Sentence:
    what = record.code or record.escalation
    text = f"{view.label(record.element)}: escalation {what}, {_caught(view, record)}"
    return text, Importance.NORMAL


def _error_thrown(view: RunView, record: r.ErrorThrown) -> _Sentence:
    reason = _in_brackets(record.reason)
    text = f"{view.label(record.element)}: error {record.code}{reason}, {_caught(view, record)}"
    return text, Importance.ATTENTION if record.caught_by else Importance.ERROR


def _incident_opened(view: RunView, record: r.IncidentOpened) -> _Sentence:
    held = f"; held for it: {', '.join(record.resources)}" if record.resources else ""
    reason = _after_colon(record.reason)
    who = f"; for {record.operator_role}" if record.operator_role else ""
    what = f"incident {record.incident}, {record.code}{reason}{held}{who}"
    return f"{view.label(record.element)}: {what}", Importance.ERROR


def _incident_updated(view: RunView, record: r.IncidentUpdated) -> _Sentence:
    text = f"{view.label(record.element)}: data written for incident {record.incident}{_by(record)}"
    return text, Importance.NORMAL


_CHOSEN = {
    "retry": "starts again",
    "retry_with": "starts again with {roles}",
    "skip": "counts as done",
    "move": "the token moves to {to}",
    "end": "the run ends",
}


def _incident_resolved(view: RunView, record: r.IncidentResolved) -> _Sentence:
    roles = ", ".join(f"{', '.join(ids)} as {role}" for role, ids in record.roles.items())
    chosen = _CHOSEN[record.choice].format(roles=roles, to=view.label(record.to))
    label = view.label(record.element)
    return f"{label}: {chosen}, decided about {record.incident}{_by(record)}", Importance.NORMAL


def _incident_closed(view: RunView, record: r.IncidentClosed) -> _Sentence:
    return f"incident {record.incident} is over without a decision", Importance.NORMAL


# --- compensation and transactions ----------------------------------------------------------------


def _compensation_triggered(view: RunView, record: r.CompensationTriggered) -> _Sentence:
    what = "undoes what was done" if record.completions else "there is nothing to undo"
    return f"{view.label(record.element)}: {what}", Importance.NORMAL


def _compensation_began(view: RunView, record: r.CompensationBegan) -> _Sentence:
    return f"{view.label(record.activity)}: is undone", Importance.NORMAL


def _transaction_cancelled(view: RunView, record: r.TransactionCancelled) -> _Sentence:
    return f"{view.label(record.element)}: the transaction is cancelled", Importance.NORMAL


_SENTENCES: dict[Kind, dict[type, Callable[[RunView, Any], _Sentence]]] = {
    Kind.RUN: {
        r.RunStarted: _run_started,
        r.RunClaimed: _run_claimed,
        r.RunPaused: _run_paused,
        r.RunResumed: _run_resumed,
        r.BreakpointsSet: _breakpoints_set,
        r.BreakpointReached: _breakpoint_reached,
        r.RunEnded: _run_ended,
        r.RunYielded: _unknown,
        r.InputIgnored: _input_ignored,
        r.InputDeferred: _input_deferred,
        r.InputSeen: _input_seen,
        r.RequirementMonitored: _requirement_monitored,
        r.RequirementDropped: _requirement_dropped,
        r.RequirementDecided: _requirement_decided,
        r.RequirementLeftOpen: _requirement_left_open,
        r.MissionRevised: _mission_revised,
    },
    Kind.OPERATORS: {
        r.OperatorTookControl: _operator_took,
        r.OperatorGaveControlBack: _operator_gave_back,
        r.ControlRequested: _control_requested,
        r.ControlRequestEnded: _control_request_ended,
        r.OperatorNote: _operator_note,
        r.OperatorSetData: _operator_set_data,
        r.GeometryReceived: _geometry_received,
    },
    Kind.BEHAVIORS: {
        r.AllocationRequested: _allocation_requested,
        r.AllocationDelayed: _allocation_delayed,
        r.ResourcesAllocated: _resources_allocated,
        r.AllocationEnded: _allocation_ended,
        r.BehaviorRequested: _behavior_requested,
        r.BehaviorProgressed: _behavior_progressed,
        r.BehaviorAdjusted: _behavior_adjusted,
        r.BehaviorCancelRequested: _behavior_cancel_requested,
        r.BehaviorUnsettled: _behavior_unsettled,
        r.BehaviorContinued: _behavior_continued,
        r.BehaviorRestarted: _behavior_restarted,
        r.BehaviorEnded: _behavior_ended,
        r.WorkReassigned: _work_reassigned,
        r.ResourceReturned: _resource_returned,
        r.ResourceKept: _resource_kept,
        r.KeepingEnded: _keeping_ended,
        r.ServiceRequested: _service_requested,
        r.ServiceEnded: _service_ended,
        r.ServiceWithdrawn: _service_withdrawn,
    },
    Kind.PROMPTS: {
        r.PromptOpened: _prompt_opened,
        r.PromptAnswered: _prompt_answered,
        r.PromptWithdrawn: _prompt_withdrawn,
    },
    Kind.DATA: {
        r.DataWritten: _data_written,
        r.InstanceOutput: _unknown,
    },
    Kind.EVENTS: {
        r.SignalThrown: _signal_thrown,
        r.MessageThrown: _message_thrown,
        r.EscalationThrown: _escalation_thrown,
        r.ErrorThrown: _error_thrown,
        r.IncidentOpened: _incident_opened,
        r.IncidentUpdated: _incident_updated,
        r.IncidentResolved: _incident_resolved,
        r.IncidentClosed: _incident_closed,
        r.EventAwaited: _event_awaited,
        r.EventTriggered: _event_triggered,
        r.ConditionReset: _unknown,
        r.CompensationEnabled: _unknown,
        r.CompensationTriggered: _compensation_triggered,
        r.CompensationBegan: _compensation_began,
        r.CompensationEnded: _unknown,
        r.TransactionCancelled: _transaction_cancelled,
        r.TelemetryConditionChanged: _condition_changed,
    },
    Kind.TOKENS: {
        r.TokenEntered: _token_entered,
        r.TokenLeft: _token_left,
        r.FlowTaken: _flow_taken,
        r.ScopeOpened: _scope_opened,
        r.ScopeClosed: _scope_closed,
    },
}
"""By what records are about; those that are not here are about tokens."""

_SENTENCE_OF = {record: says for said in _SENTENCES.values() for record, says in said.items()}
_KIND_OF = {record: kind for kind, said in _SENTENCES.items() for record in said}
