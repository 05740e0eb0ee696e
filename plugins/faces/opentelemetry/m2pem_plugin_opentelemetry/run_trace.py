"""The trace of a run: a tree of spans, made of the run's records alone.

    run -> scope (process, subprocess, instances of a loop) -> activity -> behavior, prompt, ...

A span is handed on when it ends. Times are those of the records, by the executive's clock; during a
pause mission time stands, and so do they.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from m2pem.api import records as r
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import Activity, Event, IntermediateCatchEvent
from m2pem_plugin_opentelemetry.spans import (
    Attribute,
    Link,
    Span,
    named,
    span_id_of,
    trace_id_of,
)

if TYPE_CHECKING:
    from m2pem.api.run_view import RunView
    from m2pem.api.runs import StampedRecord

Ended: TypeAlias = Callable[[Span, r.Record], None]
"""Takes each span that has ended, with the record that ended it."""

ROOT_SEQ = 0
"""The root has the id of no record: it is known before the first one."""

WELL = (BehaviorState.SUCCEEDED, BehaviorState.CANCELLED)
"""Ends of behaviors that are no errors."""


class RunTrace:
    """The spans of one run that have not ended. Apply all records of the run to it, in order.

    `whole` False: only behaviors and prompts, which are measured, with the ids that they have in
    the whole tree.
    """

    def __init__(
        self, view: "RunView", started: r.RunStarted, ended: Ended, *, whole: bool = True
    ) -> None:
        self.seq = 0
        self._handlers = _HANDLERS if whole else _MEASURED
        self.trace_id = trace_id_of(view.run, started.process, started.started_us)
        self.is_over = False
        """Whether the run has ended, with all that it commanded."""
        self._view = view
        self._ended = ended
        summary = view.summary
        attributes = {
            "run_id": view.run,
            "mission_file": summary.mission,
            "process_id": started.process,
            "operator_name": started.by,
        }
        self._root = self._span(
            f"run {summary.mission or started.process}",
            ROOT_SEQ,
            started.started_us,
            None,
            **attributes,
        )
        self._run_ended = False
        self._scopes: dict[int, Span] = {}
        self._activities: dict[int, Span] = {}
        self._work: dict[str, Span] = {}
        """Behaviors, requests for resources, prompts, services and incidents, by their ids."""
        self._behaviors: dict[str, Span] = {}
        """Those of `_work` that are behaviors."""
        self._latest: dict[int, Span] = {}
        """The latest behavior of each token, also one that has ended."""
        self._reassigned: set[int] = set()
        """The tokens whose next behavior does what is left of the latest one."""

    def apply(self, stamped: "StampedRecord") -> None:
        """Apply the next record; the view has it already. One that came before changes nothing."""
        if stamped.seq <= self.seq:
            return
        self.seq = stamped.seq
        record = stamped.record
        handle = self._handlers.get(type(record))
        if handle is not None:
            handle(self, record, stamped.seq, self._view.at_us(stamped.t_s))
        self.is_over = self._run_ended and not self._behaviors

    # --- spans ----------------------------------------------------------------------------------

    def _span(
        self, name: str, seq: int, at_us: int, parent: Span | None, **attributes: Attribute
    ) -> Span:
        parent_id = None if parent is None else parent.span_id
        all_of = {"m2pem.run.id": self._view.run, "m2pem.record.seq": seq, **named(attributes)}
        return Span(name, self.trace_id, seq, at_us, parent_id, all_of)

    def _end(
        self, span: Span | None, record: r.Record, at_us: int, error: str = "", **more: Attribute
    ) -> None:
        if span is not None:
            span.end(at_us, error, **more)
            self._ended(span, record)

    def _around(self, token: int, scope: int) -> Span:
        """What a token's work is a part of."""
        return self._activities.get(token) or self._scopes.get(scope) or self._root

    def _element(self, element: str) -> dict[str, Attribute]:
        return {"element_id": element, "element_name": self._view.label(element)}

    # --- the run --------------------------------------------------------------------------------

    def _claimed(self, record: r.RunClaimed, seq: int, at_us: int) -> None:
        self._root.add("run claimed", at_us, epoch=record.epoch, records_lost=record.lost)

    def _paused(self, record: r.RunPaused, seq: int, at_us: int) -> None:
        for span in (self._root, *self._behaviors.values()):
            span.add("held", record.at_us, operator_name=record.by)

    def _resumed(self, record: r.RunResumed, seq: int, at_us: int) -> None:
        for span in (self._root, *self._behaviors.values()):
            span.add("resumed", record.at_us, operator_name=record.by)

    def _taken(self, record: r.OperatorTookControl, seq: int, at_us: int) -> None:
        self._root.add(
            "operator took control", at_us, resource_id=record.resource, operator_name=record.by
        )

    def _given_back(self, record: r.OperatorGaveControlBack, seq: int, at_us: int) -> None:
        self._root.add(
            "operator gave back", at_us, resource_id=record.resource, operator_name=record.by
        )

    def _over(self, record: r.RunEnded, seq: int, at_us: int) -> None:
        # What the run leaves open is over with it, but behaviors that are still being cancelled.
        open_work = [each for each in self._work if each not in self._behaviors]
        spans = [
            *map(self._work.pop, open_work),
            *self._activities.values(),
            *self._scopes.values(),
        ]
        for span in spans:
            self._end(span, record, at_us)
        self._activities.clear()
        self._scopes.clear()
        self._run_ended = True
        failed = record.outcome is r.RunOutcome.FAILED
        error = (record.detail or "the run failed") if failed else ""
        self._end(
            self._root,
            record,
            at_us,
            error,
            run_outcome=record.outcome.value,
            run_detail=record.detail,
        )

    # --- scopes and tokens ----------------------------------------------------------------------

    def _scope_opened(self, record: r.ScopeOpened, seq: int, at_us: int) -> None:
        parent = self._root
        if record.parent is not None:
            parent = self._scopes.get(record.parent, parent)
        if record.token is not None:
            parent = self._activities.get(record.token, parent)
        what = "scope" if record.instances is None else "instances"
        more: dict[str, Attribute] = {}
        if record.instances is not None and record.instances >= 0:
            more["scope_instances"] = record.instances
        self._scopes[record.scope] = self._span(
            f"{what} {self._view.label(record.element)}",
            seq,
            at_us,
            parent,
            scope_id=record.scope,
            **self._element(record.element),
            **more,
        )

    def _scope_reopened(self, record: r.ScopeReopened, seq: int, at_us: int) -> None:
        self._scopes[record.scope] = self._span(
            f"compensation {self._view.label(record.element)}",
            seq,
            at_us,
            self._activities.get(record.token, self._root),
            scope_id=record.scope,
            **self._element(record.element),
        )

    def _scope_closed(self, record: r.ScopeClosed, seq: int, at_us: int) -> None:
        span = self._scopes.pop(record.scope, None)
        self._end(span, record, at_us, _failure(record.outcome), outcome=record.outcome.value)

    def _entered(self, record: r.TokenEntered, seq: int, at_us: int) -> None:
        mission = self._view.mission
        node = None if mission is None else mission.elements.get(record.element)
        if node is not None and not isinstance(node, (Activity, IntermediateCatchEvent)):
            return
        kind = "" if node is None else node.kind
        more: dict[str, Attribute] = {}
        if record.instance is not None:
            more["loop_instance"] = record.instance
        self._activities[record.token] = self._span(
            self._view.label(record.element),
            seq,
            at_us,
            self._scopes.get(record.scope, self._root),
            element_type="event" if isinstance(node, Event) else kind,
            token_id=record.token,
            **self._element(record.element),
            **more,
        )

    def _left(self, record: r.TokenLeft, seq: int, at_us: int) -> None:
        span = self._activities.pop(record.token, None)
        if span is None:
            return
        self._reassigned.discard(record.token)
        self._latest.pop(record.token, None)
        self._end(span, record, at_us, _failure(record.outcome), outcome=record.outcome.value)

    # --- behaviors ------------------------------------------------------------------------------

    def _asked_for(self, record: r.AllocationRequested, seq: int, at_us: int) -> None:
        self._work[record.allocation] = self._span(
            f"allocate {record.name}",
            seq,
            at_us,
            self._around(record.token, record.scope),
            allocation_id=record.allocation,
            behavior_name=record.name,
        )

    def _delayed(self, record: r.AllocationDelayed, seq: int, at_us: int) -> None:
        if (span := self._work.get(record.allocation)) is not None:
            holders = tuple(f"{name}: {holder}" for name, holder in record.holders.items())
            span.add("waits", at_us, reason=record.reason, holders=holders)

    def _allocated(self, record: r.ResourcesAllocated, seq: int, at_us: int) -> None:
        resources = tuple(each for filled in record.roles.values() for each in filled)
        self._end(self._work.pop(record.allocation, None), record, at_us, resource_ids=resources)

    def _not_allocated(self, record: r.AllocationEnded, seq: int, at_us: int) -> None:
        error = _error(record.code, record.reason)
        self._end(
            self._work.pop(record.allocation, None), record, at_us, error, error_code=record.code
        )

    def _behavior(self, record: r.BehaviorRequested, seq: int, at_us: int) -> None:
        span = self._span(
            record.name,
            seq,
            at_us,
            self._around(record.token, record.scope),
            behavior_id=record.behavior,
            behavior_name=record.name,
            behavior_type=record.type,
            resource_ids=record.resources,
            **self._element(record.element),
        )
        if record.token in self._reassigned and record.token in self._latest:
            span.links.append(_link(self._latest[record.token], "does what is left of"))
        self._reassigned.discard(record.token)
        self._latest[record.token] = span
        for preempted in record.preempts:
            span.add("preempts", at_us, behavior_id=preempted)
            if (other := self._behaviors.get(preempted)) is not None:
                other.add("preempted", at_us, behavior_id=record.behavior)
                span.links.append(_link(other, "preempts"))
        self._work[record.behavior] = self._behaviors[record.behavior] = span

    def _progressed(self, record: r.BehaviorProgressed, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            span.add(record.state.value, at_us, native_reference=record.native_ref or "")

    def _adjusted(self, record: r.BehaviorAdjusted, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            changed = tuple(f"{name}={value}" for name, value in record.parameters.items())
            span.add("adjusted", at_us, parameters=changed)

    def _cancelling(self, record: r.BehaviorCancelRequested, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            span.add("cancel requested", at_us, error_code=record.code, reason=record.reason)

    def _unsettled(self, record: r.BehaviorUnsettled, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            span.add("unknown after restart", at_us, state=record.state.value, reason=record.reason)

    def _continued(self, record: r.BehaviorContinued, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            span.add("continued", at_us, operator_name=record.by)

    def _restarted(self, record: r.BehaviorRestarted, seq: int, at_us: int) -> None:
        if (span := self._behaviors.get(record.behavior)) is not None:
            span.add("attempt", at_us, epoch=record.epoch, operator_name=record.by)

    def _behavior_ended(self, record: r.BehaviorEnded, seq: int, at_us: int) -> None:
        self._work.pop(record.behavior, None)
        span = self._behaviors.pop(record.behavior, None)
        state = record.state.value
        well = record.state in WELL
        error = "" if well else _error(record.code or state, record.reason)
        self._end(
            span,
            record,
            at_us,
            error,
            behavior_state=state,
            error_code=record.code,
            reason=record.reason,
        )

    def _reassign(self, record: r.WorkReassigned, seq: int, at_us: int) -> None:
        around = self._around(record.token, 0)
        around.add("work reassigned", at_us, error_code=record.code, reason=record.reason)
        self._reassigned.add(record.token)

    # --- prompts, services and incidents --------------------------------------------------------

    def _prompt(self, record: r.PromptOpened, seq: int, at_us: int) -> None:
        about = self._behaviors.get(record.behavior)
        self._work[record.prompt] = self._span(
            "prompt",
            seq,
            at_us,
            about or self._around(record.token, record.scope),
            prompt_id=record.prompt,
            prompt_text=record.text,
            prompt_role=record.role,
        )

    def _answered(self, record: r.PromptAnswered, seq: int, at_us: int) -> None:
        self._end(
            self._work.pop(record.prompt, None),
            record,
            at_us,
            prompt_decision=record.decision,
            operator_name=record.by,
        )

    def _withdrawn(self, record: r.PromptWithdrawn, seq: int, at_us: int) -> None:
        self._end(self._work.pop(record.prompt, None), record, at_us, prompt_decision="withdrawn")

    def _service(self, record: r.ServiceRequested, seq: int, at_us: int) -> None:
        self._work[record.service] = self._span(
            f"service {record.name}",
            seq,
            at_us,
            self._around(record.token, record.scope),
            service_id=record.service,
            service_class=record.name,
        )

    def _served(self, record: r.ServiceEnded, seq: int, at_us: int) -> None:
        error = _error(record.code, record.reason)
        self._end(
            self._work.pop(record.service, None), record, at_us, error, error_code=record.code
        )

    def _not_served(self, record: r.ServiceWithdrawn, seq: int, at_us: int) -> None:
        self._end(self._work.pop(record.service, None), record, at_us, outcome="withdrawn")

    def _incident(self, record: r.IncidentOpened, seq: int, at_us: int) -> None:
        span = self._span(
            f"incident {record.code}",
            seq,
            at_us,
            self._around(record.token, record.scope),
            incident_id=record.incident,
            error_code=record.code,
            reason=record.reason,
            resource_ids=record.resources,
            **self._element(record.element),
        )
        self._work[record.incident] = span

    def _incident_updated(self, record: r.IncidentUpdated, seq: int, at_us: int) -> None:
        if (span := self._work.get(record.incident)) is not None:
            span.add("data written", at_us, operator_name=record.by)

    def _resolved(self, record: r.IncidentResolved, seq: int, at_us: int) -> None:
        self._end_incident(record, at_us, record.choice.value, record.by)

    def _incident_closed(self, record: r.IncidentClosed, seq: int, at_us: int) -> None:
        self._end_incident(record, at_us, "closed", "")

    def _end_incident(
        self, record: r.IncidentResolved | r.IncidentClosed, at_us: int, choice: str, by: str
    ) -> None:
        span = self._work.pop(record.incident, None)
        if span is not None:
            code, reason = (
                str(span.attributes.get(f"m2pem.{each}", "")) for each in ("error.code", "reason")
            )
            error = _error(code, reason)
            self._end(span, record, at_us, error, incident_choice=choice, operator_name=by)

    # --- what is thrown -------------------------------------------------------------------------

    def _signal(self, record: r.SignalThrown, seq: int, at_us: int) -> None:
        around = self._around(record.token, record.scope)
        around.add("signal", at_us, signal_id=record.signal, operator_name=record.by)

    def _message(self, record: r.MessageThrown, seq: int, at_us: int) -> None:
        around = self._around(record.token, record.scope)
        around.add("message", at_us, message_id=record.message, operator_name=record.by)

    def _escalation(self, record: r.EscalationThrown, seq: int, at_us: int) -> None:
        around = self._around(record.token, record.scope)
        around.add("escalation", at_us, code=record.code, caught_by=record.caught_by)

    def _error(self, record: r.ErrorThrown, seq: int, at_us: int) -> None:
        self._around(record.token, record.scope).add(
            "error",
            at_us,
            error_code=record.code,
            reason=record.reason,
            caught_by=record.caught_by,
        )

    def _cancelled(self, record: r.TransactionCancelled, seq: int, at_us: int) -> None:
        self._around(record.token, record.scope).add("transaction cancelled", at_us)


def root_id(trace_id: int) -> int:
    """The id of the root of a trace."""
    return span_id_of(trace_id, ROOT_SEQ)


def _failure(outcome: r.TokenOutcome) -> str:
    return "it failed" if outcome is r.TokenOutcome.FAILED else ""


def _error(code: str, reason: str) -> str:
    return f"{code}: {reason}" if code and reason else code


def _link(span: Span, why: str) -> Link:
    return Link(span.trace_id, span.span_id, {"m2pem.link": why})


_HANDLERS: dict[type, Callable[..., None]] = {
    r.RunClaimed: RunTrace._claimed,
    r.RunPaused: RunTrace._paused,
    r.RunResumed: RunTrace._resumed,
    r.OperatorTookControl: RunTrace._taken,
    r.OperatorGaveControlBack: RunTrace._given_back,
    r.RunEnded: RunTrace._over,
    r.ScopeOpened: RunTrace._scope_opened,
    r.ScopeReopened: RunTrace._scope_reopened,
    r.ScopeClosed: RunTrace._scope_closed,
    r.TokenEntered: RunTrace._entered,
    r.TokenLeft: RunTrace._left,
    r.AllocationRequested: RunTrace._asked_for,
    r.AllocationDelayed: RunTrace._delayed,
    r.ResourcesAllocated: RunTrace._allocated,
    r.AllocationEnded: RunTrace._not_allocated,
    r.BehaviorRequested: RunTrace._behavior,
    r.BehaviorProgressed: RunTrace._progressed,
    r.BehaviorAdjusted: RunTrace._adjusted,
    r.BehaviorCancelRequested: RunTrace._cancelling,
    r.BehaviorUnsettled: RunTrace._unsettled,
    r.BehaviorContinued: RunTrace._continued,
    r.BehaviorRestarted: RunTrace._restarted,
    r.BehaviorEnded: RunTrace._behavior_ended,
    r.WorkReassigned: RunTrace._reassign,
    r.PromptOpened: RunTrace._prompt,
    r.PromptAnswered: RunTrace._answered,
    r.PromptWithdrawn: RunTrace._withdrawn,
    r.ServiceRequested: RunTrace._service,
    r.ServiceEnded: RunTrace._served,
    r.ServiceWithdrawn: RunTrace._not_served,
    r.IncidentOpened: RunTrace._incident,
    r.IncidentUpdated: RunTrace._incident_updated,
    r.IncidentResolved: RunTrace._resolved,
    r.IncidentClosed: RunTrace._incident_closed,
    r.SignalThrown: RunTrace._signal,
    r.MessageThrown: RunTrace._message,
    r.EscalationThrown: RunTrace._escalation,
    r.ErrorThrown: RunTrace._error,
    r.TransactionCancelled: RunTrace._cancelled,
}

_MEASURED: dict[type, Callable[..., None]] = {
    kind: _HANDLERS[kind]
    for kind in (
        r.RunEnded,
        r.BehaviorRequested,
        r.BehaviorEnded,
        r.PromptOpened,
        r.PromptAnswered,
        r.PromptWithdrawn,
    )
}
