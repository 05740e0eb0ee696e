"""A run as its operators see it, folded from its records.

`RunView.apply` takes the records of one run in order, without a gap. Every unit shows runs from
this view, so that all of them show the same.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec

from m2pem.api import records as r
from m2pem.api.requirement_states import RequirementStates
from m2pem.api.runs import RunId, RunStatus, RunSummary, StampedRecord
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission

FINISHED = 20
"""The last tokens that left an element, as many as `RunView.finished` keeps."""

NEWEST = 200
"""The last records, as many as `RunView.newest` keeps."""

NAMED = 1000
"""The last behaviors, prompts and waits that are over: `describe` needs their names."""

Place: TypeAlias = tuple[str, str]
"""The ids of a process and of an element in it."""


class ElementState(msgspec.Struct):
    """An element: the tokens on it now and so far, and the mission time of its last change.

    `failed`: the last token that left it had failed. `asking`: a prompt of it is open. `waiting`:
    a task of it waits for vehicles or payloads that are not free. `stopped`: an incident stops a
    token on it.
    """

    active: int = 0
    hits: int = 0
    last: float = 0.0
    failed: bool = False
    asking: bool = False
    waiting: bool = False
    stopped: bool = False


@dataclass(slots=True)
class Behavior:
    """A behavior that has not ended. `since_s`: mission time of the request.

    `state` is that of the last report in lower case, "unsettled" after a restart, "" before any.
    """

    id: str
    name: str
    resources: tuple[str, ...]
    process: str
    element: str
    token: int
    since_s: float
    state: str = ""


@dataclass(slots=True)
class Allocation:
    """A task that asks for vehicles or payloads to be chosen for its roles (docs/allocation.md).

    `name`: its behavior. `since_s`: mission time at which it asked. `reason`: why it waits, ""
    before that is known. `holders`: the behaviors, requests and operators who have what it could
    use, by resource.
    """

    id: str
    name: str
    process: str
    element: str
    token: int
    since_s: float
    reason: str = ""
    holders: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Service:
    """A service that has not ended."""

    id: str
    name: str
    token: int


@dataclass(frozen=True, slots=True)
class Wait:
    """An event that is awaited; `element` catches it.

    `token` 0: the scope waits, to begin an event subprocess. `due_s`: mission time at which a
    timer with a duration is due, None for all else.
    """

    element: str
    trigger: r.Trigger
    ref: str
    due_s: float | None
    token: int
    scope: int


@dataclass(slots=True)
class Token:
    """A token on an element. `seq`: of the record with which it came, for sorting.

    `since_us`: microseconds since the Unix epoch, by the executive's clock. `is_around`: it waits
    on a loop or multi-instance activity, around the instances, and is none of them.
    """

    id: int
    process: str
    element: str
    scope: int
    seq: int
    since_us: int
    instance: int | None = None
    is_around: bool = False
    work: dict[str, Behavior | Service | Allocation] = field(default_factory=dict)
    prompts: set[str] = field(default_factory=set)
    waits: dict[int, Wait] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FinishedToken:
    """A token that has left an element. `seq`: of the record with which it came."""

    element: str
    scope: int
    seq: int
    outcome: r.TokenOutcome


@dataclass(frozen=True, slots=True)
class Scope:
    """An instance of a process or subprocess; `token` sits on its activity in `parent`."""

    element: str
    parent: int | None
    token: int | None


@dataclass(frozen=True, slots=True)
class ActiveElement:
    """An element with tokens on it, the behaviors that they wait for, and the `allocations`: the
    requests for vehicles and payloads that they wait for.

    `since_us`: when the first of them came, microseconds since the Unix epoch.
    """

    element: str
    tokens: int
    since_us: int
    behaviors: tuple[Behavior, ...]
    allocations: tuple[Allocation, ...] = ()


@dataclass(slots=True)
class Changes:
    """The elements, behaviors, prompts, resources and requirements that changed since the last
    `clear`. `debugging`: those of `breakpoints`, `reached` and `stepping` that did."""

    elements: set[Place] = field(default_factory=set)
    behaviors: set[str] = field(default_factory=set)
    prompts: set[str] = field(default_factory=set)
    resources: set[str] = field(default_factory=set)
    requirements: set[str] = field(default_factory=set)
    debugging: set[str] = field(default_factory=set)

    def clear(self) -> None:
        self.elements.clear()
        self.behaviors.clear()
        self.prompts.clear()
        self.resources.clear()
        self.requirements.clear()
        self.debugging.clear()


class RunView:
    """Status, tokens, prompts, behaviors and waits of one run.

    `mission` gives names; None if its diagram cannot be read. `names`: names by id, used without a
    mission. `changes` is filled for readers that
    set it, and clear it when they have shown what changed.
    """

    def __init__(
        self,
        summary: RunSummary,
        mission: "Mission | None" = None,
        names: Mapping[str, str] | None = None,
    ) -> None:
        self.summary = summary
        self.mission = mission
        self._names = names or {}
        self.seq = 0
        """Number of the last record that was applied; they count from 1 without a gap."""
        self.t_s = 0.0
        """Mission time of the last record."""
        self.newest: deque[StampedRecord] = deque(maxlen=NEWEST)
        self.paused_by = ""
        self.breakpoints: r.BreakpointsSet | None = None
        """Where the run is paused to look at it; None: nowhere."""
        self.reached: r.BreakpointReached | None = None
        """The breakpoint at which the run is paused."""
        self.stepping = False
        """Whether the run is paused before its next step."""
        self.elements: dict[Place, ElementState] = {}
        self.scopes: dict[int, Scope] = {}
        self.tokens: dict[int, Token] = {}
        self.finished: deque[FinishedToken] = deque(maxlen=FINISHED)
        self.completed: set[str] = set()
        """Elements that a token has completed at least once."""
        self.behaviors: dict[str, Behavior] = {}
        self.allocations: dict[str, Allocation] = {}
        self.services: dict[str, Service] = {}
        self.prompts: dict[str, r.PromptOpened] = {}
        self.incidents: dict[str, r.IncidentOpened] = {}
        self.waits: dict[int, Wait] = {}
        self.kept: dict[str, r.ResourceKept] = {}
        """What the run keeps between tasks, by the id of that."""
        self.holders: dict[str, str] = {}
        """Operators who have taken a resource, by resource, as far as the run's records say."""
        self.requirements = RequirementStates()
        """The requirements that the run is monitored for, by id."""
        self.version = ""
        """The version of the mission that the last revision has brought; "": there was none."""
        self.changes: Changes | None = None
        self._ended_behaviors: dict[str, Behavior] = {}
        self._ended_allocations: dict[str, Allocation] = {}
        self._closed_prompts: dict[str, r.PromptOpened] = {}
        self._past_waits: dict[int, Wait] = {}
        self._paused_us = 0
        self._paused_at_us = 0

    def apply(self, stamped: StampedRecord) -> bool:
        """Apply the next record. False: it was applied before, and nothing changes."""
        if stamped.seq <= self.seq:
            return False
        self.seq = stamped.seq
        self.t_s = stamped.t_s
        self.newest.append(stamped)
        fold = _FOLDS.get(type(stamped.record))
        if fold is not None:
            fold(self, stamped.record)
        return True

    # --- what units show ------------------------------------------------------------------------

    @property
    def run(self) -> RunId:
        return self.summary.run

    @property
    def status(self) -> RunStatus:
        return self.summary.status

    @property
    def name(self) -> str:
        """The file name of the mission without its folder and ending."""
        file = self.mission.file if self.mission is not None else self.summary.mission
        return file.replace("\\", "/").rpartition("/")[2].removesuffix(".bpmn")

    @property
    def is_command(self) -> bool:
        """Whether it is one behavior that was commanded from outside of a mission."""
        from m2pem.bpmn.one_task import is_one_task  # noqa: PLC0415  # lxml loads slowly

        return self.mission is not None and is_one_task(self.mission)

    def label(self, element: str) -> str:
        """Return the name of an element in the diagram; its id, if it has none."""
        found = self.mission.elements.get(element) if self.mission is not None else None
        return found.label if found is not None else self._names.get(element) or element

    def reference(self, id_: str) -> str:
        """Return the name of a signal or message of the mission, given its id."""
        if self.mission is None:
            return self._names.get(id_) or id_
        found = self.mission.signals.get(id_) or self.mission.messages.get(id_)
        return found.name if found is not None and found.name else id_

    def behavior(self, id_: str) -> Behavior | None:
        """Return a behavior that goes on, or that was among the last to end."""
        return self.behaviors.get(id_) or self._ended_behaviors.get(id_)

    def allocation(self, id_: str) -> Allocation | None:
        """Return a request for resources that goes on, or that was among the last to end."""
        return self.allocations.get(id_) or self._ended_allocations.get(id_)

    def holder(self, id_: str) -> str:
        """Return words for who holds a resource: a behavior or request of this run by its name."""
        if (behavior := self.behavior(id_)) is not None:
            return f"{behavior.name} of {self.label(behavior.element)} ({id_})"
        if (allocation := self.allocation(id_)) is not None:
            return f"{self.label(allocation.element)} ({id_})"
        if (incident := self.incidents.get(id_)) is not None:
            return f"the incident of {self.label(incident.element)} ({id_})"
        if (kept := self.kept.get(id_)) is not None:
            return f"{self.label(kept.element)}, which keeps it ({id_})"
        return id_

    def prompt(self, id_: str) -> r.PromptOpened | None:
        """Return a prompt that is open, or that was among the last to be closed."""
        return self.prompts.get(id_) or self._closed_prompts.get(id_)

    def wait(self, id_: int) -> Wait | None:
        """Return an event that is awaited, or that was among the last to occur."""
        return self.waits.get(id_) or self._past_waits.get(id_)

    def active(self) -> list[ActiveElement]:
        """Return the elements with tokens, in the order in which the first token came."""
        found: dict[str, list[Token]] = {}
        for token in self.tokens.values():
            found.setdefault(token.element, []).append(token)
        return [_active(element, tokens) for element, tokens in found.items()]

    def signals(self) -> Mapping[str, tuple[str, bool]]:
        """Return the signals of the mission by id: the name, and whether one is awaited now."""
        if self.mission is None:
            return {}
        awaited = {wait.ref for wait in self.waits.values()}
        return {
            signal.id: (signal.name or signal.id, signal.id in awaited)
            for signal in self.mission.signals.values()
        }

    def progress(self) -> tuple[int, int]:
        """Count the activities that were completed at least once, and all of the mission."""
        activities = (
            {each.id for each in self.mission.activities()} if self.mission is not None else set()
        )
        return len(self.completed & activities), len(activities)

    def at_us(self, mission_time_s: float) -> int:
        """Return a mission time by the executive's clock, in microseconds since the Unix epoch.

        Pauses up to now are counted in.
        """
        return self.summary.started_us + self._paused_us + round(mission_time_s * US_PER_S)

    def counted(self) -> RunSummary:
        """Return the summary with the number of records up to now."""
        return replace(self.summary, records=self.seq)

    def interrupt(self) -> None:
        """Note that no executive drives the run, which its records cannot say."""
        self._update(status=RunStatus.INTERRUPTED)

    # --- the run --------------------------------------------------------------------------------

    def _update(self, **changes: Any) -> None:
        self.summary = replace(self.summary, **changes)

    def _start(self, record: r.RunStarted) -> None:
        self._update(status=RunStatus.RUNNING, process=record.process, started_us=record.started_us)

    def _claim(self, record: r.RunClaimed) -> None:
        self._read_requirement(record)
        self._update(status=RunStatus.PAUSED if self._paused_at_us else RunStatus.RUNNING)

    def _pause(self, record: r.RunPaused) -> None:
        self._paused_at_us = record.at_us
        self.paused_by = record.by
        self._debug("stepping", False)
        self._update(status=RunStatus.PAUSED)

    def _resume(self, record: r.RunResumed) -> None:
        self._paused_us += max(0, record.at_us - self._paused_at_us)
        self._paused_at_us = 0
        self.paused_by = ""
        self._debug("reached", None)
        self._update(status=RunStatus.RUNNING)

    def _set_breakpoints(self, record: r.BreakpointsSet) -> None:
        self._debug("breakpoints", record if record.elements or record.conditions else None)
        self._debug("stepping", record.step)

    def _reach_breakpoint(self, record: r.BreakpointReached) -> None:
        self._debug("reached", record)

    def _debug(
        self, name: str, value: r.BreakpointsSet | r.BreakpointReached | bool | None
    ) -> None:
        if getattr(self, name) == value:
            return
        setattr(self, name, value)
        if self.changes is not None:
            self.changes.debugging.add(name)

    def _end(self, record: r.RunEnded) -> None:
        self._update(
            status=RunStatus(record.outcome.value),
            ended_us=max(self.at_us(self.t_s), self._paused_at_us),
            detail=record.detail,
        )
        self._debug("reached", None)
        self._debug("stepping", False)
        for prompt in list(self.prompts):
            self._close_prompt(prompt)
        for place, state in self.elements.items():
            if state.active or state.asking or state.waiting or state.stopped:
                state.active = 0
                state.asking = False
                state.waiting = False
                state.stopped = False
                self._touch(place, state)
        self.tokens.clear()
        self.allocations.clear()
        self.incidents.clear()
        self.kept.clear()
        self.waits.clear()

    def _take(self, record: r.OperatorTookControl) -> None:
        self.holders[record.resource] = record.by
        if self.changes is not None:
            self.changes.resources.add(record.resource)

    def _give_back(self, record: r.OperatorGaveControlBack) -> None:
        self.holders.pop(record.resource, None)
        if self.changes is not None:
            self.changes.resources.add(record.resource)

    # --- requirements ---------------------------------------------------------------------------

    def _read_requirement(self, record: r.Record) -> None:
        changed = self.requirements.take(record, self.t_s)
        if self.changes is not None:
            self.changes.requirements.update(changed)

    # --- tokens and scopes ----------------------------------------------------------------------

    def _element(self, place: Place) -> ElementState:
        state = self.elements.get(place)
        if state is None:
            state = self.elements[place] = ElementState()
        return state

    def _touch(self, place: Place, state: ElementState) -> None:
        state.last = self.t_s
        if self.changes is not None:
            self.changes.elements.add(place)

    def _enter(self, record: r.TokenEntered) -> None:
        self.tokens[record.token] = Token(
            record.token,
            record.process,
            record.element,
            record.scope,
            self.seq,
            self.at_us(self.t_s),
            record.instance,
        )
        place = (record.process, record.element)
        state = self._element(place)
        state.active += 1
        state.hits += 1
        state.failed = False
        self._touch(place, state)

    def _leave(self, record: r.TokenLeft) -> None:
        token = self.tokens.pop(record.token, None)
        if token is None:
            return
        for wait in token.waits:
            self.waits.pop(wait, None)
        place = (record.process, record.element)
        state = self._element(place)
        if not token.is_around:
            state.active -= 1
        state.failed = record.outcome is r.TokenOutcome.FAILED
        self._touch(place, state)
        if record.outcome is r.TokenOutcome.CONSUMED:
            return
        if record.outcome is r.TokenOutcome.COMPLETED:
            self.completed.add(record.element)
        self.finished.append(FinishedToken(token.element, token.scope, token.seq, record.outcome))

    def _open_scope(self, record: r.ScopeOpened) -> None:
        self.scopes[record.scope] = Scope(record.element, record.parent, record.token)
        token = self.tokens.get(record.token) if record.token is not None else None
        if record.instances is not None and token is not None and not token.is_around:
            # The instances are counted, and not the token around them.
            token.is_around = True
            place = (record.process, record.element)
            state = self._element(place)
            state.active -= 1
            state.hits -= 1
            self._touch(place, state)

    def _close_scope(self, record: r.ScopeClosed) -> None:
        self.scopes.pop(record.scope, None)
        self._drop_waits_of_scope(record.scope)

    def _interrupt_scope(self, record: r.ScopeInterrupted) -> None:
        self._drop_waits_of_scope(record.scope)

    def _drop_waits_of_scope(self, scope: int) -> None:
        for id_ in [id_ for id_, w in self.waits.items() if w.scope == scope and not w.token]:
            del self.waits[id_]

    # --- what tokens wait for -------------------------------------------------------------------

    def _request_allocation(self, record: r.AllocationRequested) -> None:
        allocation = self.allocations[record.allocation] = Allocation(
            record.allocation,
            record.name,
            record.process,
            record.element,
            record.token,
            self.t_s,
        )
        if token := self.tokens.get(record.token):
            token.work[record.allocation] = allocation

    def _delay_allocation(self, record: r.AllocationDelayed) -> None:
        if allocation := self.allocations.get(record.allocation):
            allocation.reason = record.reason
            allocation.holders = record.holders
            self._note_waiting(allocation)

    def _end_allocation(self, record: r.ResourcesAllocated | r.AllocationEnded) -> None:
        allocation = self.allocations.pop(record.allocation, None)
        if allocation is None:
            return
        _keep(self._ended_allocations, record.allocation, allocation)
        if token := self.tokens.get(allocation.token):
            token.work.pop(record.allocation, None)
        self._note_waiting(allocation)

    def _note_waiting(self, allocation: Allocation) -> None:
        place = (allocation.process, allocation.element)
        state = self._element(place)
        waiting = any(
            each.reason and (each.process, each.element) == place
            for each in self.allocations.values()
        )
        if state.waiting != waiting:
            state.waiting = waiting
            self._touch(place, state)

    def _request_behavior(self, record: r.BehaviorRequested) -> None:
        behavior = self.behaviors[record.behavior] = Behavior(
            record.behavior,
            record.name,
            record.resources,
            record.process,
            record.element,
            record.token,
            self.t_s,
        )
        if token := self.tokens.get(record.token):
            token.work[record.behavior] = behavior
        if self.changes is not None:
            self.changes.behaviors.add(record.behavior)

    def _progress_behavior(self, record: r.BehaviorProgressed) -> None:
        self._set_state(record.behavior, record.state.value.lower())

    def _unsettle_behavior(self, record: r.BehaviorUnsettled) -> None:
        self._set_state(record.behavior, "unsettled")

    def _settle_behavior(self, record: r.BehaviorContinued | r.BehaviorRestarted) -> None:
        self._set_state(record.behavior, "")

    def _set_state(self, behavior: str, state: str) -> None:
        if found := self.behaviors.get(behavior):
            found.state = state

    def _end_behavior(self, record: r.BehaviorEnded) -> None:
        behavior = self.behaviors.pop(record.behavior, None)
        if behavior is not None:
            _keep(self._ended_behaviors, record.behavior, behavior)
            if token := self.tokens.get(behavior.token):
                token.work.pop(record.behavior, None)
        if self.changes is not None:
            self.changes.behaviors.add(record.behavior)

    def _request_service(self, record: r.ServiceRequested) -> None:
        service = self.services[record.service] = Service(record.service, record.name, record.token)
        if token := self.tokens.get(record.token):
            token.work[record.service] = service

    def _end_service(self, record: r.ServiceEnded | r.ServiceWithdrawn) -> None:
        service = self.services.pop(record.service, None)
        if service is not None and (token := self.tokens.get(service.token)):
            token.work.pop(record.service, None)

    def _open_prompt(self, record: r.PromptOpened) -> None:
        self.prompts[record.prompt] = record
        if token := self.tokens.get(record.token):
            token.prompts.add(record.prompt)
        place = (record.process, record.element)
        state = self._element(place)
        state.asking = True
        self._touch(place, state)
        if self.changes is not None:
            self.changes.prompts.add(record.prompt)

    def _answer_prompt(self, record: r.PromptAnswered | r.PromptWithdrawn) -> None:
        self._close_prompt(record.prompt)

    def _close_prompt(self, id_: str) -> None:
        prompt = self.prompts.pop(id_, None)
        if prompt is None:
            return
        _keep(self._closed_prompts, id_, prompt)
        if token := self.tokens.get(prompt.token):
            token.prompts.discard(id_)
        place = (prompt.process, prompt.element)
        state = self._element(place)
        state.asking = any((p.process, p.element) == place for p in self.prompts.values())
        self._touch(place, state)
        if self.changes is not None:
            self.changes.prompts.add(id_)

    def _open_incident(self, record: r.IncidentOpened) -> None:
        self.incidents[record.incident] = record
        token = self.tokens.get(record.token)
        for id_, wait in list(token.waits.items()) if token is not None else ():
            if record.rearm or wait.element == record.element:
                self.waits.pop(id_, None)
        self._note_stopped(record)

    def _close_incident(self, record: r.IncidentResolved | r.IncidentClosed) -> None:
        opened = self.incidents.pop(record.incident, None)
        if opened is not None:
            self._note_stopped(opened)

    def _keep_resource(self, record: r.ResourceKept) -> None:
        self.kept[record.keeping] = record

    def _end_keeping(self, record: r.KeepingEnded) -> None:
        self.kept.pop(record.keeping, None)

    def _note_stopped(self, record: r.IncidentOpened) -> None:
        place = (record.process, record.element)
        state = self._element(place)
        state.stopped = any((i.process, i.element) == place for i in self.incidents.values())
        self._touch(place, state)

    def _await_event(self, record: r.EventAwaited) -> None:
        lasts = record.trigger is r.Trigger.TIMER and not record.calendar
        wait = self.waits[record.wait] = Wait(
            record.element,
            record.trigger,
            record.ref,
            record.due_us / US_PER_S if lasts else None,
            record.token,
            record.scope,
        )
        if token := self.tokens.get(record.token):
            token.waits[record.wait] = wait

    def _revise(self, record: r.MissionRevised) -> None:
        self.version = record.version
        for number in record.disarmed:
            wait = self.waits.pop(number, None)
            if wait is not None and (token := self.tokens.get(wait.token)):
                token.waits.pop(number, None)

    def _trigger_event(self, record: r.EventTriggered) -> None:
        wait = self.waits.pop(record.wait, None)
        if wait is not None:
            _keep(self._past_waits, record.wait, wait)
        if wait is not None and (token := self.tokens.get(wait.token)):
            token.waits.pop(record.wait, None)


def _keep(kept: dict[Any, Any], id_: str | int, value: Any) -> None:
    kept[id_] = value
    if len(kept) > NAMED:
        del kept[next(iter(kept))]


def _active(element: str, tokens: list[Token]) -> ActiveElement:
    return ActiveElement(
        element,
        sum(not token.is_around for token in tokens) or len(tokens),
        min(token.since_us for token in tokens),
        tuple(
            work for token in tokens for work in token.work.values() if isinstance(work, Behavior)
        ),
        tuple(
            work for token in tokens for work in token.work.values() if isinstance(work, Allocation)
        ),
    )


_FOLDS: dict[type, Callable[[RunView, Any], None]] = {
    r.RunStarted: RunView._start,
    r.RunClaimed: RunView._claim,
    r.RunPaused: RunView._pause,
    r.RunResumed: RunView._resume,
    r.BreakpointsSet: RunView._set_breakpoints,
    r.BreakpointReached: RunView._reach_breakpoint,
    r.RunEnded: RunView._end,
    r.OperatorTookControl: RunView._take,
    r.OperatorGaveControlBack: RunView._give_back,
    r.ScopeOpened: RunView._open_scope,
    r.ScopeClosed: RunView._close_scope,
    r.ScopeInterrupted: RunView._interrupt_scope,
    r.TokenEntered: RunView._enter,
    r.TokenLeft: RunView._leave,
    r.AllocationRequested: RunView._request_allocation,
    r.AllocationDelayed: RunView._delay_allocation,
    r.ResourcesAllocated: RunView._end_allocation,
    r.AllocationEnded: RunView._end_allocation,
    r.BehaviorRequested: RunView._request_behavior,
    r.BehaviorProgressed: RunView._progress_behavior,
    r.BehaviorUnsettled: RunView._unsettle_behavior,
    r.BehaviorContinued: RunView._settle_behavior,
    r.BehaviorRestarted: RunView._settle_behavior,
    r.BehaviorEnded: RunView._end_behavior,
    r.ServiceRequested: RunView._request_service,
    r.ServiceEnded: RunView._end_service,
    r.ServiceWithdrawn: RunView._end_service,
    r.PromptOpened: RunView._open_prompt,
    r.PromptAnswered: RunView._answer_prompt,
    r.PromptWithdrawn: RunView._answer_prompt,
    r.IncidentOpened: RunView._open_incident,
    r.IncidentResolved: RunView._close_incident,
    r.IncidentClosed: RunView._close_incident,
    r.ResourceKept: RunView._keep_resource,
    r.KeepingEnded: RunView._end_keeping,
    r.EventAwaited: RunView._await_event,
    r.EventTriggered: RunView._trigger_event,
    r.RequirementMonitored: RunView._read_requirement,
    r.RequirementDropped: RunView._read_requirement,
    r.RequirementDecided: RunView._read_requirement,
    r.RequirementLeftOpen: RunView._read_requirement,
    r.TelemetryConditionChanged: RunView._read_requirement,
    r.MissionRevised: RunView._revise,
}
